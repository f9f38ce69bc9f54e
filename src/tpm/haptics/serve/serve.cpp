#include "tpm/haptics/serve/serve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/serve/simulated_hand.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr double kForEver_s = 1e9;
constexpr double kCycleTimeout_s = 1.0;  // a machine that stalls ends no server

/// Supervision of a session where nobody holds the device.
ServoSettings served_settings(const HilSession& session, const LoopModel& model,
                              const RenderingCheck& rendering, double duration_s) {
  ServoSettings servo = loop_settings(session, model, rendering, false);
  servo.outside_validity_limit_s = kForEver_s;
  servo.most_damping_N_s_per_m = 0.0;
  servo.most_late = std::numeric_limits<int>::max();
  servo.most_missed = std::numeric_limits<int>::max();
  const double lasts_s = duration_s > 0.0 ? duration_s : kForEver_s;
  const auto end = static_cast<std::uint64_t>(lasts_s / servo.period_s);
  for (std::uint64_t& phase_end : servo.phase_ends) phase_end = std::min(phase_end, end);
  servo.phase_ends.back() = end;
  return servo;
}

InverseServerSettings server_settings(const ServeOptions& options) {
  InverseServerSettings settings;
  settings.port = options.port;
  settings.events_port = options.events_port;
  settings.poll = options.poll;
  settings.log = options.log;
  settings.page = read_file(share_dir() / "pages" / "hand.html");
  settings.device.id = "SIMULATED";
  settings.device.type = "inverse3";
  settings.device.simulated = true;
  settings.device.settings.handedness = "right";
  settings.device.settings.preset = "defaults";
  settings.device.settings.filters_named = settings.device.settings.damping_named = true;
  // The simulated hand has no weight.
  settings.device.settings.gravity_named = settings.device.settings.gravity_compensation = true;
  settings.device.settings.gravity_scaling = 1.0;
  return settings;
}

}  // namespace

ServeRun serve_session(const HilSession& session, const ServeOptions& options) {
  DeviceLimits limits = limits_of("virtual");
  limits.stop_along_x_m = 0.0;  // the simulated hand of the service moves within a sphere
  require_within(session, limits);
  ServeRun run;
  LoopModel model = make_loop_model(session);
  const std::shared_ptr<ContactModel> stepped = std::move(model.model);
  run.rendering = check_rendering(session, *stepped, model, limits);
  if (const auto unmet = run.rendering.unmet(false)) {
    throw Error(ExitCode::answer_is_no, to_string(*unmet), run.rendering.verdict(), remedy(*unmet));
  }
  SimulatedHandSettings hand_settings;
  hand_settings.plant = session.plant;
  hand_settings.plant.period_s = session.servo.period_s;
  hand_settings.plant.motor_limit_N = std::min(session.plant.motor_limit_N, limits.force_N);
  hand_settings.script = session.operator_script();
  hand_settings.force_limit_N = session.servo.force_limit_N;
  hand_settings.reach_m = limits.reach_m;
  const auto hand = std::make_shared<SimulatedHand>(std::move(hand_settings));
  const DeviceIdentity identity = hand->open();
  InverseServer server(*hand, server_settings(options));
  if (options.opened) options.opened(server, identity, model);

  RealTimeOptions real;
  real.wish = options.wish;
  real.cycle_timeout_s = kCycleTimeout_s;
  real.interrupted = options.interrupted;
  DevicePreparation preparation = session.preparation;
  preparation.period_s = session.servo.period_s;
  preparation.max_force_N = session.servo.force_limit_N;
  preparation.real_time = true;
  real.prepare = [&] { hand->prepare(preparation); };
  const RecordSink sink = [&](const ServoRecord& row) {
    if (options.watcher) options.watcher(row);
  };
  run.outcome = run_in_real_time(hand, stepped,
                                 served_settings(session, model, run.rendering, options.duration_s),
                                 sink, real);
  run.counts = server.counts();
  run.largest_force_N = hand->largest_N();
  return run;
}

std::string serve_text(const HilSession& session, const ServeRun& run) {
  const InverseServer::Counts& c = run.counts;
  return fmt::format(
      "SIMULATED DEVICE, compatible with the Inverse service: {}\n"
      "ended        {} after {} cycles, {} periods missed\n"
      "clients      {} connections, {} refused, {} closed for a fault\n"
      "messages     {}, {} of them unreadable; {} states\n"
      "force        at most {} N, limit {} N\n",
      session.title, to_string(run.outcome.cause), run.outcome.cycles, run.outcome.counts.missed,
      c.connections, c.refused, c.closed_for_fault, c.messages, c.unreadable, c.states,
      significant(run.largest_force_N, 4), significant(session.servo.force_limit_N, 4));
}

Json serve_json(const HilSession& session, const ServeRun& run) {
  const InverseServer::Counts& c = run.counts;
  return {{"simulated_device", true},
          {"title", session.title},
          {"cause", to_string(run.outcome.cause)},
          {"cycles", run.outcome.cycles},
          {"missed_periods", run.outcome.counts.missed},
          {"connections", c.connections},
          {"refused", c.refused},
          {"closed_for_fault", c.closed_for_fault},
          {"messages", c.messages},
          {"unreadable", c.unreadable},
          {"states", c.states},
          {"largest_force_N", run.largest_force_N},
          {"force_limit_N", session.servo.force_limit_N}};
}

}  // namespace tpm::haptics
