// Contacts stepped from Python, and recordings of haptic sessions.
#include "binding.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/session/loop_contact.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::python {
namespace {

std::unique_ptr<LoopContact> opened(const std::filesystem::path& file, double rate_Hz,
                                    bool start_gate, double longest_s, bool accept_unstable,
                                    const std::string& device,
                                    const std::filesystem::path& device_file) {
  LoopContactOptions options;
  options.rate_Hz = rate_Hz;
  options.start_gate = start_gate;
  options.longest_s = longest_s;
  options.accept_unstable = accept_unstable;
  options.device = device;
  options.device_file = device_file;
  const py::gil_scoped_release released;
  return std::make_unique<LoopContact>(file, options);
}

Error stopped(StopCause cause) {
  return {ExitCode::answer_is_no, "contact", "has stopped: " + std::string(to_string(cause)),
          "reset() before the next step"};
}

Eigen::Vector3d step_once(LoopContact& contact, const Eigen::Vector3d& position_m, int missed) {
  Eigen::Vector3d force_N;
  const StopCause cause = contact.step(position_m, force_N, missed);
  if (cause != StopCause::none) throw stopped(cause);
  return force_N;
}

/// One call at a time of the caller's clock; none for a time that cannot be the next one.
std::optional<Eigen::Vector3d> step_once_at(LoopContact& contact, double time_s,
                                            const Eigen::Vector3d& position_m) {
  Eigen::Vector3d force_N;
  const StopCause cause = contact.step_at(time_s, position_m, force_N);
  if (cause == LoopContact::kBadTime) return std::nullopt;
  if (cause != StopCause::none) throw stopped(cause);
  return force_N;
}

/// Many periods; where the contact stops, the forces end.
py::array_t<double> step_through(LoopContact& contact, const Numbers& positions_m) {
  if (positions_m.ndim() != 2 || positions_m.shape(1) != 3) {
    throw bad_input("positions_m", "is not a table of three columns", "an array of shape (n, 3)");
  }
  const py::ssize_t n = positions_m.shape(0);
  py::array_t<double> forces_N({n, py::ssize_t{3}});
  const double* const from = positions_m.data();
  double* const to = forces_N.mutable_data();
  StopCause cause = StopCause::none;
  const LongCall call;
  const std::function<bool()> interrupted = call.interrupted();
  call.run([&] {
    Eigen::Vector3d force_N;
    for (py::ssize_t i = 0; i < n && cause == StopCause::none; ++i) {
      constexpr py::ssize_t kAskEvery = 1024;
      if (i % kAskEvery == 0 && interrupted()) throw Interrupted("contact: interrupted");
      cause = contact.step(Eigen::Map<const Eigen::Vector3d>(from + 3 * i), force_N);
      std::copy_n(force_N.data(), 3, to + 3 * i);
    }
  });
  if (cause != StopCause::none) throw stopped(cause);
  return forces_N;
}

py::dict state_of(LoopContact& contact) {
  const LoopContactState s = contact.state();
  return py::dict(
      py::arg("time_s") = s.time_s,
      py::arg("position_m") = Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(s.row.position_m)),
      py::arg("force_N") = Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(s.row.commanded_N)),
      py::arg("tool_depth_m") = s.row.tool_depth_m,
      py::arg("surface_depth_m") = s.row.surface_depth_m,
      py::arg("model_force_N") = s.row.model_force_N,
      py::arg("model_error_N") = s.row.model_error_N,
      py::arg("touching") = (s.row.flags & kTouching) != 0,
      py::arg("waiting") = (s.row.flags & kWaiting) != 0,
      py::arg("valid") = (s.row.flags & kBeyondModel) == 0,
      py::arg("stop") = std::string(to_string(s.row.stop)));
}

py::dict info_of(const LoopContact& contact) {
  const RenderingCheck& check = contact.rendering();
  const SessionServo& servo = contact.session().servo;
  return py::dict(
      py::arg("model") = contact.loop().name, py::arg("error_bound") = contact.loop().error_bound,
      py::arg("period_s") = contact.period_s(),
      py::arg("stiffness_N_per_m") = check.stiffness_N_per_m,
      py::arg("stable_N_per_m") = check.stable_N_per_m,
      py::arg("passive_N_per_m") = check.passive_N_per_m, py::arg("verdict") = check.verdict(),
      py::arg("passive") = check.passive(), py::arg("acceptable") = check.acceptable(),
      py::arg("warnings") = remark_texts(check.remarks), py::arg("surface_m") = servo.surface_m,
      py::arg("push") = servo.push, py::arg("force_limit_N") = servo.force_limit_N,
      py::arg("spheres") = contact.spheres());
}

/// Column by column, as numpy takes them.
py::dict session_of(const std::filesystem::path& file) {
  const HilRecording recording = read_recording(file);
  py::dict columns;
  const auto column = [&](const char* name, const auto& value) {
    std::vector<double> values;
    values.reserve(recording.rows.size());
    for (const ServoRecord& row : recording.rows) values.push_back(static_cast<double>(value(row)));
    columns[name] = handed_over(std::move(values));
  };
  column("time_s", [&](const ServoRecord& r) { return recording.time_s(r); });
  column("phase", [](const ServoRecord& r) { return r.phase; });
  constexpr const char* kPosition[] = {"position_x_m", "position_y_m", "position_z_m"};
  constexpr const char* kForce[] = {"commanded_x_N", "commanded_y_N", "commanded_z_N"};
  for (std::size_t k = 0; k < 3; ++k) {
    column(kPosition[k], [k](const ServoRecord& r) { return r.position_m[k]; });
    column(kForce[k], [k](const ServoRecord& r) { return r.commanded_N[k]; });
  }
  column("commanded_N", [&](const ServoRecord& r) { return recording.commanded_N(r); });
  column("tool_depth_m", [](const ServoRecord& r) { return r.tool_depth_m; });
  column("surface_depth_m", [](const ServoRecord& r) { return r.surface_depth_m; });
  column("model_force_N", [](const ServoRecord& r) { return r.model_force_N; });
  column("model_error_N", [](const ServoRecord& r) { return r.model_error_N; });
  column("observed_J", [](const ServoRecord& r) { return r.observed_J; });
  column("busy_s", [](const ServoRecord& r) { return r.busy_s; });
  column("flags", [](const ServoRecord& r) { return r.flags; });
  std::vector<std::string> warnings = remark_texts(recording_remarks(recording));
  if (const auto& rendering = recording.opened.rendering) {
    for (std::string& text : rendering->texts()) warnings.push_back(std::move(text));
  }
  py::list phases;
  double start_s = 0.0;
  for (const SessionPhase& phase : recording.session.phases) {
    phases.append(py::make_tuple(phase.name, start_s, phase.end_s));
    start_s = phase.end_s;
  }
  return py::dict(
      py::arg("columns") = columns, py::arg("phases") = phases,
      py::arg("header") = to_text(recording.header), py::arg("simulated") = recording.simulated(),
      py::arg("device") = device_line(recording), py::arg("damage") = damage_line(recording),
      py::arg("warnings") = warnings, py::arg("name") = recording.name);
}

/// A session on the simulated device, as fast as it goes.
std::string run_virtual(const std::filesystem::path& session, const std::filesystem::path& output,
                        const std::string& law, bool accept_unstable, py::object progress) {
  SessionChanges changes;
  changes.law = law;
  const HilSession read = read_session(session, changes);
  const LongCall call(std::move(progress));
  SessionRunOptions options;
  options.recording = output;
  options.accept_unstable = accept_unstable;
  options.interrupted = call.interrupted();
  const auto total = static_cast<std::uint64_t>(read.phases.size());
  std::int32_t phase = -1;
  options.watcher = [&](const ServoRecord& row) {
    if (row.phase <= phase) return;
    phase = row.phase;
    call.tell(std::min(total, static_cast<std::uint64_t>(phase)), total);
  };
  const SessionRun run = call.run([&] { return run_session(read, {}, options); });
  call.raise();
  return std::string(to_string(run.outcome.cause));
}

}  // namespace

void bind_contacts(py::module_& module) {
  py::class_<LoopContact>(module, "Contact")
      .def(py::init(&opened), py::arg("file"), py::arg("rate_Hz"), py::arg("start_gate"),
           py::arg("longest_s"), py::arg("accept_unstable"), py::arg("device"),
           py::arg("device_file"))
      .def("step", &step_once, py::arg("position_m"), py::arg("missed") = 0)
      .def("step_at", &step_once_at, py::arg("t_s"), py::arg("position_m"))
      .def("steps", &step_through, py::arg("positions_m"))
      .def("reset", &LoopContact::reset)
      .def_property_readonly("state", &state_of)
      .def_property_readonly("info", &info_of)
      .def("positions", [](LoopContact& contact) {
        Eigen::Matrix3Xd all(3, contact.spheres());
        contact.positions(all);
        return Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>(all.transpose());
      });
  module.def("read_session_recording", &session_of);
  module.def("run_session", &run_virtual);
}

}  // namespace tpm::python
