#include "tpm/haptics/session/session_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tpm/files/row_log.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/device/plugin_device.hpp"
#include "tpm/haptics/device/replay_device.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::int64_t kPassOnEvery_ns = 50'000'000;

Eigen::Matrix3Xd motion_of(const HilRecording& recording) {
  Eigen::Matrix3Xd motion(3, static_cast<Eigen::Index>(recording.rows.size()));
  for (Eigen::Index i = 0; i < motion.cols(); ++i) {
    motion.col(i) =
        Eigen::Map<const Eigen::Vector3d>(recording.rows[static_cast<std::size_t>(i)].position_m);
  }
  return motion;
}

/// Where a session with the motion of a recording asks the tool to be, every period.
Eigen::Matrix3Xd asked_motion(const HilSession& session) {
  OperatorScript script = session.operator_script();
  Eigen::Matrix3Xd motion(3, static_cast<Eigen::Index>(session.servo.phase_ends.back()));
  for (Eigen::Index i = 0; i < motion.cols(); ++i) {
    const double depth_m = script.at(static_cast<double>(i) * session.servo.period_s).value;
    motion.col(i) = session.servo.surface_m + depth_m * session.servo.push;
  }
  return motion;
}

/// Marks rows and lists them: buttons that go down, keys of the operator.
class Markers {
 public:
  explicit Markers(std::shared_ptr<const std::atomic<std::uint32_t>> keys)
      : keys_(std::move(keys)), seen_(keys_ ? keys_->load() : 0) {}
  void see(ServoRecord& row) {
    const std::uint32_t keys = keys_ ? keys_->load() : 0;
    if (keys != seen_) add(row, "key");
    if ((row.buttons & ~buttons_) != 0) add(row, "button");
    seen_ = keys;
    buttons_ = row.buttons;
  }
  /// A button that is down when the session begins, as the one that begins it, marks nothing.
  void wait(const ServoRecord& row) { buttons_ = row.buttons; }
  [[nodiscard]] const Json& list() const { return list_; }

 private:
  void add(ServoRecord& row, const char* by) {
    row.flags |= kMarked;
    list_.push_back({{"cycle", row.cycle}, {"by", by}});
  }

  std::shared_ptr<const std::atomic<std::uint32_t>> keys_;
  std::uint32_t seen_, buttons_ = 0;
  Json list_ = Json::array();
};

/// Files that a session writes while its loop runs.
struct SessionLog {
  RowLogWriter& rows;
  Markers& markers;
  FindingNotices& notices;
  double& largest_force_N;

  void take(const ServoRecord& written, const std::function<void(const ServoRecord&)>& watcher) {
    ServoRecord row = written;
    const bool waits = row.phase < 0 && row.stop == StopCause::none;
    if (waits) {
      markers.wait(row);
    } else {
      markers.see(row);
      const Eigen::Map<const Eigen::Vector3d> force_N(row.commanded_N);
      largest_force_N = std::max(largest_force_N, force_N.norm());
      rows.append(&row);
    }
    if (watcher) watcher(row);
  }
};

/// @param prepare prepares the device and lets the recording appear
ServoOutcome run_loop(const HilSession& session, const std::shared_ptr<HapticDevice>& device,
                      const std::shared_ptr<ContactModel>& stepped, const ServoSettings& servo,
                      const SessionRunOptions& options, SessionLog log,
                      const std::function<void()>& prepare) {
  const RecordSink sink = [&](const ServoRecord& row) { log.take(row, options.watcher); };
  if (!options.real_time) {
    prepare();
    return run_in_virtual_time(*device, *stepped, servo, sink, options.interrupted);
  }
  RealTimeOptions real = real_time_options(session, options.wish, options.interrupted);
  real.prepare = prepare;
  std::int64_t passed_on_ns = now_ns();
  real.idle = [&log, &passed_on_ns] {
    if (now_ns() - passed_on_ns < kPassOnEvery_ns) return;
    log.rows.flush();
    log.notices.look();
    passed_on_ns = now_ns();
  };
  return run_in_real_time(device, stepped, servo, sink, real);
}

void require_acceptable(const RenderingCheck& rendering, const DeviceChoice& choice,
                        const DeviceLimits& limits, const SessionRunOptions& options) {
  if (options.accept_unstable && !limits.plant) {
    throw Error(ExitCode::usage, "--accept-unstable", "is not for the device '" + choice.kind + "'",
                "--device virtual");
  }
  const auto unmet = rendering.unmet(options.accept_unstable);
  if (!unmet || choice.kind == "replay") return;
  std::string expected(remedy(*unmet));
  const bool by_delay =
      *unmet == RenderingCondition::stability || *unmet == RenderingCondition::delay;
  if (!limits.plant && by_delay) {
    expected +=
        "; a device file with a measured delay (tpm hil identify); the device 'virtual', where "
        "nothing has motors";
  } else if (limits.plant && rendering.acceptable_if_unstable()) {
    expected += "; --accept-unstable";
  }
  throw Error(ExitCode::answer_is_no, to_string(*unmet), rendering.refusal(options.accept_unstable),
              expected);
}

std::shared_ptr<PluginDevice> plugin_of(const DeviceChoice& choice) {
  if (choice.plugin.empty()) {
    throw Error(ExitCode::usage, "--device plugin", "no plugin is named",
                "--plugin FILE, a shared library after tpmkit/haptic_device.h");
  }
  return std::make_shared<PluginDevice>(choice.plugin, choice.which);
}

constexpr const char* kCallersOwn = "the caller's own";

/// Of a device of the caller's; those of this library refuse in prepare().
void require_clock(const DeviceChoice& choice, const DeviceIdentity& device, bool real_time) {
  if (choice.kind != kCallersOwn || real_time || !device.hardware) return;
  throw Error(ExitCode::usage, "device '" + printable(device.name) + "'",
              "a device with motors keeps the clock", "a session in real time");
}

/// Limits with the delay of the device as it is now: the larger one of file and check counts.
DeviceLimits checked_limits(const DeviceLimits& limits, const DelayCheck& check) {
  DeviceLimits now = limits;
  if (check.delay_s) {
    now.measured_delay_s = std::max(*limits.measured_delay_s, *check.delay_s);
  } else {
    now.measured_delay_s.reset();
    now.measured_friction_N_s_per_m.reset();
  }
  return now;
}

/// Measures the delay for a second, and the rendering once more with what was found. Throws as
/// run_session().
void check_at_start(AdmittedSession& admitted, const HilSession& session,
                    const DeviceChoice& choice, const DeviceLimits& limits,
                    const SessionRunOptions& options) {
  DeviceIdentifyOptions second;
  second.real_time = options.real_time;
  second.wish = options.wish;
  second.interrupted = options.interrupted;
  second.opened = [&choice](const DeviceIdentity& device) { require_same_device(choice, device); };
  second.watcher = [&options](const ServoRecord& row) {
    if (row.phase < 0 && options.watcher) options.watcher(row);  // what the check waits for
  };
  if (options.checking) {
    options.checking(std::min(kMostIdentifyingForce_N, session.servo.force_limit_N));
  }
  const DelayCheck check = check_delay(make_device(choice, session), choice, session, second);
  admitted.rendering =
      check_rendering(session, *admitted.stepped, admitted.model, checked_limits(limits, check));
  admitted.rendering.delay_at_start_s = check.delay_s;
  if (!check.delay_s) {
    admitted.rendering.delay_note =
        "the handle did not follow the forces of the check before the session; let go of it";
  }
  require_acceptable(admitted.rendering, choice, limits, options);
}

/// The gate as far as it needs no device.
AdmittedSession admit_to(const HilSession& session, const DeviceChoice& choice,
                         const DeviceLimits& limits, const SessionRunOptions& options) {
  require_within(session, limits);
  AdmittedSession admitted;
  admitted.model = make_loop_model(session, options.planning);
  admitted.stepped = std::move(admitted.model.model);
  admitted.rendering = check_rendering(session, *admitted.stepped, admitted.model, limits);
  if (choice.kind == "virtual") {
    const DeviceLimits real =
        choice.file.empty() ? limits_of("omega7") : limits_from(read_device_file(choice.file));
    admitted.on_hardware = check_rendering(session, *admitted.stepped, admitted.model, real);
    admitted.hardware_kind = real.kind;
  }
  require_acceptable(admitted.rendering, choice, limits, options);
  return admitted;
}

/// A session that was admitted, to the end of its recording.
SessionRun run_admitted(AdmittedSession admitted, const HilSession& session,
                        const DeviceChoice& choice, const SessionRunOptions& options,
                        const std::shared_ptr<HapticDevice>& device) {
  SessionRun run;
  run.model = std::move(admitted.model);
  run.rendering = std::move(admitted.rendering);
  run.on_hardware = std::move(admitted.on_hardware);
  run.hardware_kind = std::move(admitted.hardware_kind);
  const ForcesOffGuard guard(*device);
  const DevicePreparation preparation =
      preparation_for(session, choice, options.real_time, options.interrupted);
  try {
    run.device = device->open();
    require_same_device(choice, run.device);
    require_clock(choice, run.device, options.real_time);
    if (options.opened) options.opened(run.device, run.model);
    FindingNotices notices(*device, options.noticed);
    notices.look();
    RowLogWriter log(options.recording,
                     to_text(recording_header(session, run.device, run.model, options.real_time,
                                              options.notes, to_json(run.rendering))),
                     sizeof(ServoRecord), RowLogWriter::Name::later);
    const ServoSettings servo =
        loop_settings(session, run.model, run.rendering, choice.kind != "replay");
    Markers markers(options.markers);
    run.outcome = run_loop(session, device, admitted.stepped, servo, options,
                           {log, markers, notices, run.largest_force_N}, [&] {
                             device->prepare(preparation);
                             log.appear();
                           });
    run.findings = device->findings();
    notices.look();
    Json closing = recording_closing(run.outcome);
    if (!run.findings.empty()) closing["device_findings"] = remarks_json(run.findings);
    if (!markers.list().empty()) closing["markers"] = markers.list();
    log.close(to_text(closing));
  } catch (...) {
    device->stop();
    throw;
  }
  return run;
}

}  // namespace

DeviceLimits limits_of(const DeviceChoice& choice) {
  DeviceLimits limits =
      choice.kind == "plugin" ? plugin_of(choice)->limits() : limits_of(choice.kind);
  if (choice.file.empty() || limits.plant) return limits;
  return limits_by_file(limits, read_device_file(choice.file));
}

std::shared_ptr<HapticDevice> make_device(const DeviceChoice& choice, const HilSession& session) {
  if (choice.kind == "plugin") return plugin_of(choice);
  const DeviceLimits limits = limits_of(choice.kind);
  if (limits.plant) {
    return std::make_shared<VirtualOmega7>(session.plant, session.operator_script(), limits);
  }
  if (choice.kind == "inverse3") {
    return std::make_shared<InverseDevice>(choice.inverse, limits_of(choice));
  }
  if (limits.hardware()) {
    return std::make_shared<ForceDimension>(choice.library, choice.kind, choice.which);
  }
  if (choice.replay.empty() && session.phases.back().kind == SessionPhaseKind::motion) {
    return std::make_shared<ReplayDevice>(asked_motion(session), session.phases.back().name);
  }
  if (choice.replay.empty()) {
    throw Error(ExitCode::usage, "--device replay", "has nothing to replay",
                "--device-recording FILE beside it");
  }
  const HilRecording recording = read_recording(choice.replay);
  return std::make_shared<ReplayDevice>(motion_of(recording), recording.name);
}

void forgive_stalls(HilSession& session) {
  constexpr double kOfRehearsals_s = 1.0;
  session.plant.least_watchdog_s = std::max(session.plant.least_watchdog_s, kOfRehearsals_s);
  session.cycle_timeout_s = std::max(session.cycle_timeout_s, kOfRehearsals_s);
}

DevicePreparation preparation_for(const HilSession& session, const DeviceChoice& choice,
                                  bool real_time, const std::function<bool()>& interrupted) {
  DevicePreparation preparation = session.preparation;
  preparation.period_s = session.servo.period_s;
  preparation.may_move = choice.may_move;
  preparation.take_as_ready = choice.take_as_ready;
  preparation.real_time = real_time;
  preparation.interrupted = interrupted;
  return preparation;
}

RealTimeOptions real_time_options(const HilSession& session, RealTimeWish wish,
                                  const std::function<bool()>& interrupted) {
  RealTimeOptions options;
  options.wish = wish;
  options.cycle_timeout_s = session.cycle_timeout_s;
  options.interrupted = interrupted;
  return options;
}

void require_same_device(const DeviceChoice& choice, const DeviceIdentity& device) {
  if (choice.file.empty() || choice.kind == "virtual") return;
  const DeviceFile file = read_device_file(choice.file);
  if (file.simulated && device.hardware) {
    throw Error(ExitCode::environment, file.where + ": key /measurement/simulated_device",
                "was measured on a simulated device, and this one has motors",
                "the file of this device (tpm hil identify)");
  }
  const auto other = [&file](const char* key, const std::string& theirs, const std::string& ours) {
    return Error(ExitCode::environment, fmt::format("{}: key /{}", file.where, key),
                 theirs.empty()
                     ? fmt::format("is missing: what was measured may be of another device than "
                                   "this, '{}'",
                                   printable(ours))
                     : fmt::format("was measured on the device '{}', and this is '{}'",
                                   printable(theirs), printable(ours)),
                 "the file of this device (tpm hil identify)");
  };
  const bool must_say = file.measured && device.hardware;
  if (file.serial != device.serial && (!file.serial.empty() || must_say)) {
    throw other("serial", file.serial, device.serial);
  }
  if (file.measured && !file.name.empty() && !device.name.empty() && file.name != device.name) {
    throw other("name", file.name, device.name);
  }
}

ServoSettings loop_settings(const HilSession& session, const LoopModel& model,
                            const RenderingCheck& rendering, bool guided) {
  ServoSettings servo{session.servo};
  servo.friction_N_s_per_m = rendering.friction_N_s_per_m;
  servo.delay_periods = guided ? rendering.delay_periods : 0;
  servo.passive = rendering.passive();
  if (!guided) {
    servo.gate.reset();
    servo.energy_allowance_J = std::numeric_limits<double>::infinity();
    servo.watch_oscillation = false;
    servo.most_speed_m_per_s = std::numeric_limits<double>::infinity();
  }
  servo.model_push = model.push;
  servo.to_model = model.to_model;
  return servo;
}

AdmittedSession admit_session(const HilSession& session, const DeviceChoice& choice,
                              const SessionRunOptions& options) {
  const DeviceLimits limits = limits_of(choice);
  AdmittedSession admitted = admit_to(session, choice, limits, options);
  const bool checks = options.check_delay && options.real_time && limits.hardware() &&
                      limits.measured_delay_s.has_value();
  if (checks) check_at_start(admitted, session, choice, limits, options);
  return admitted;
}

SessionRun run_session(const HilSession& session, const DeviceChoice& choice,
                       const SessionRunOptions& options) {
  AdmittedSession admitted = admit_session(session, choice, options);
  return run_admitted(std::move(admitted), on_device(session, limits_of(choice)), choice, options,
                      make_device(choice, session));
}

SessionRun run_session_on(const HilSession& session, const std::shared_ptr<HapticDevice>& device,
                          const DeviceLimits& limits, const DevicePermissions& permissions,
                          const SessionRunOptions& options) {
  DeviceChoice choice;
  choice.kind = kCallersOwn;
  choice.file = permissions.file;
  choice.may_move = permissions.may_move;
  choice.take_as_ready = permissions.take_as_ready;
  return run_admitted(admit_to(session, choice, limits, options), on_device(session, limits),
                      choice, options, device);
}

}  // namespace tpm::haptics
