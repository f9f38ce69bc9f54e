// Scenes run and sweeps computed.
#include "binding.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/run/recorder.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/plan/plan.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpm/plan/show/simulation_remarks.hpp"
#include "tpm/sweep/run_sweep.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpm/sweep/sweep_result.hpp"
#include "tpmkit/error.hpp"

namespace tpm::python {
namespace {

namespace fs = std::filesystem;

/// x, y, z of every sphere at every output, time first.
py::array_t<double> positions_of(const SimulationRun& run, const RunNetwork& network) {
  const py::ssize_t times = static_cast<py::ssize_t>(run.record.outputs.size());
  const py::ssize_t spheres = network.network.organ.position.cols();
  py::array_t<double> table({times, spheres, py::ssize_t{3}});
  double* at = table.mutable_data();
  for (const QuasiStaticState& state : run.record.outputs) {
    const Positions there = network.spheres(state.position);
    at = std::copy_n(there.data(), there.size(), at);
  }
  return table;
}

py::dict answer_of(const ExperimentScene& scene, const RunNetwork& network,
                   const SimulationRun& run) {
  const auto column = [&](const auto& value) {
    std::vector<double> values;
    values.reserve(run.record.curve.size());
    for (const CurvePoint& p : run.record.curve) values.push_back(value(p));
    return handed_over(std::move(values));
  };
  std::vector<double> output_times;
  for (const QuasiStaticState& state : run.record.outputs) output_times.push_back(state.time_s);
  py::dict answer(py::arg("time_s") = column([](const CurvePoint& p) { return p.time_s; }),
                  py::arg("imposed") = column([](const CurvePoint& p) { return p.imposed; }),
                  py::arg("response") = column([](const CurvePoint& p) { return p.response; }),
                  py::arg("output_s") = handed_over(std::move(output_times)),
                  py::arg("position_m") = positions_of(run, network));
  answer["depth_is_imposed"] = scene.protocol.drive() == Drive::displacement;
  answer["formulation"] = scene.formulation.kind;
  answer["scene"] = scene.text;
  answer["error_estimate"] = run.record.error_estimate;
  answer["warnings"] = remark_texts(simulation_remarks(run));
  if (scene.formulation.masses) return answer;
  answer["work_J"] = column([](const CurvePoint& p) { return p.energy.work_J; });
  answer["dissipated_J"] = column([](const CurvePoint& p) { return p.energy.dissipated_J; });
  answer["stored_J"] = column([](const CurvePoint& p) { return p.energy.stored_J; });
  return answer;
}

/// @param scene a file, or with `folder` the text of a scene
py::dict run_scene(const std::string& text, const std::string& where, const fs::path& folder,
                   const std::string& output, py::object progress) {
  ExperimentScene scene = parse_experiment(parse_json(text, where), where, folder);
  scene.text = text;
  if (!output.empty()) {
    require_not_read(output);
    will_update({output + ".checkpoint"});
    (void)Hdf5Writer(output);  // before a long run: can the result be written?
  }
  const LongCall call(std::move(progress));
  SimulationControls controls;
  controls.interrupted = call.interrupted();
  if (call.has_progress()) {
    controls.progress = [&](std::size_t done, std::size_t total) { call.tell(done, total); };
  }
  if (!output.empty()) controls.checkpoint = output + ".checkpoint";
  const RunNetwork network = call.run([&] { return network_to_run(scene); });
  const SimulationRun run = call.run([&] { return simulate(scene, network, controls); });
  call.raise();
  if (!output.empty()) {
    (void)write_simulation(scene, network, run, output);
    fs::remove(output + ".checkpoint");
  }
  return answer_of(scene, network, run);
}

/// As `tpm sweep`: a log beside the output lets an interrupted sweep go on.
py::dict compute_sweep(const fs::path& file, const fs::path& output, int workers,
                       py::object progress) {
  const Sweep sweep = read_sweep(file);
  const fs::path log_file = log_path(output);
  require_not_read(output);
  will_update({output});  // a result that stands already is asked which sweep it holds
  if (fs::exists(log_file) || fingerprint_of(output) != sweep.fingerprint) {
    require_replaceable(output);
    const LongCall call(std::move(progress));
    SweepControls controls;
    controls.workers = workers;
    controls.interrupted = call.interrupted();
    if (call.has_progress()) {
      controls.progress = [&](std::uint64_t done, std::uint64_t total) { call.tell(done, total); };
    }
    BlockLog log(log_file, sweep, [](const std::string& note) {
      PySys_WriteStderr("tpmkit: %.900s\n", note.c_str());
    });
    const SweepRun run = call.run([&] { return run_sweep(sweep, log, controls); });
    if (run.interrupted) {
      log.sync();
      call.raise();
      throw Interrupted("sweep: interrupted; the same call goes on");
    }
    const CellTally tally = call.run([&] { return write_sweep(sweep, {&log}, output, workers); });
    fs::remove(log_file);
    return py::dict(py::arg("done") = tally.done, py::arg("skipped") = tally.skipped,
                    py::arg("failed") = tally.failed, py::arg("computed") = true);
  }
  return py::dict(py::arg("computed") = false);
}

/// @returns the plan as JSON and in words
py::tuple plan_of(const std::string& text, const std::string& where, const fs::path& folder,
                  const std::string& tolerance, const std::string& outputs,
                  std::optional<double> rate_Hz, const std::string& wall, const std::string& costs,
                  py::object progress) {
  const ExperimentScene scene = parse_experiment(parse_json(text, where), where, folder);
  PlanRequest request;
  set_tolerance(request, tolerance);
  if (outputs == "field") {
    request.measure = {PlanOutput::field, 0.0};
  } else if (outputs != "force") {
    throw bad_input("outputs", "'" + printable(outputs) + "'", "force or field");
  }
  if (rate_Hz && !(*rate_Hz >= 1.0 && *rate_Hz <= 1e6)) {
    throw bad_input("rate_Hz", std::to_string(*rate_Hz), "a servo rate of 1 to 1e6 Hz");
  }
  request.budget.rate_Hz = rate_Hz;
  if (!wall.empty()) request.budget.wall_s_per_s = parse_wall_budget(wall);
  if (costs != "nominal") request.costs = read_costs(costs);
  constexpr std::uint64_t kSteps = 6;
  const LongCall call(std::move(progress));
  const std::function<bool()> interrupted = call.interrupted();
  std::uint64_t done = 0;
  request.progress = [&](const std::string&) {
    call.tell(std::min(++done, kSteps), kSteps);
    if (interrupted()) throw Interrupted("plan: interrupted");
  };
  const Plan plan = call.run([&] { return make_plan(scene, request); });
  return py::make_tuple(to_text(plan_json(plan)), show::to_text(short_answer(plan)));
}

}  // namespace

void bind_runs(py::module_& module) {
  module.def("simulate", &run_scene);
  module.def("read_text", [](const fs::path& file) { return read_file(file); });
  module.def("sweep", &compute_sweep);
  module.def("plan", &plan_of);
}

}  // namespace tpm::python
