// Prints the measured numbers of reports/inverse/report.md, as Markdown:
//     measure_inverse SESSION [SECONDS]
// The loopback round trip of a force and its state between the library's client and server, both
// looking again and again, then both sleeping between messages; a loop of 2 kHz on --device
// inverse3 in real time, with its missed periods; and the delay that tpm hil identify finds in real
// time on a stand-in service that is 0, 2 and 5 ms late. SECONDS each (default 60).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "measure/program.hpp"
#include "stand_in_inverse.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpm/haptics/serve/inverse_server.hpp"
#include "tpm/haptics/session/identify_run.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

/// A hand that does nothing: what is measured are messages.
class StillHand final : public ServedHand {
 public:
  InverseState state() noexcept override { return {}; }
  void push(const Eigen::Vector3d& /*force_N*/) noexcept override {}
  void move_to(const std::optional<Eigen::Vector3d>& /*position_m*/) noexcept override {}
  void let_go() noexcept override {}
};

void round_trips(bool poll, double seconds) {
  StillHand hand;
  InverseServerSettings settings;
  settings.poll = poll;
  settings.device.id = "SIMULATED";
  settings.device.simulated = true;
  settings.device.settings.handedness = "right";
  const InverseServer server(hand, settings);
  WebSocketClient client(server.port(), "/", 2.0, kMostInventoryBytes);
  (void)client.receive(2.0);
  TimeHistogram times;
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (now_ns() < until_ns) {
    const std::int64_t begin_ns = now_ns();
    const bool sent = client.send(
        force_message(InverseFormat::vector, "SIMULATED", Eigen::Vector3d(0.0, 0.0, 1.5)));
    const auto text = client.receive(2.0, poll);
    if (!sent || !text) throw Error(ExitCode::environment, "round trip", client.over(), "a state");
    (void)parse_state(*text, "SIMULATED");
    times.note(now_ns() - begin_ns);
  }
  fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} |\n",
             poll ? "both look again and again" : "both sleep", times.count(),
             1e6 * times.quantile_s(0.5), 1e6 * times.quantile_s(0.99),
             1e6 * times.quantile_s(0.999), 1e6 * times.max_s());
}

DeviceChoice choice_of(const test::StandInInverse& service, bool poll) {
  DeviceChoice choice;
  choice.kind = "inverse3";
  choice.inverse = service.address();
  choice.inverse.poll = poll;
  return choice;
}

PlantSettings free_plant(const HilSession& session, double late_s) {
  PlantSettings plant = session.plant;
  plant.arm = {1e-9, 0.0, 0.0, 0.0};
  plant.push = session.servo.push;
  plant.period_s = 0.25e-3;
  plant.delay_periods = static_cast<int>(std::lround(late_s / plant.period_s));
  return plant;
}

HilSession measured_session(const std::string& file) {
  HilSession session = read_session(file);
  session.servo.most_late = 1001;  // counted, not ended by
  session.servo.most_missed = 100'000;
  session.cycle_timeout_s = 1.0;
  session.preparation.watchdog_s = 1.0;
  return session;
}

void two_kHz(const std::string& file, double seconds) {
  HilSession session = measured_session(file);
  session.servo.period_s = 0.5e-3;
  test::StandInInverse service(free_plant(session, 0.0), {}, true);
  DeviceIdentifyOptions options;
  options.real_time = true;
  options.duration_s = seconds;
  const IdentifyRun run = run_identification(choice_of(service, false), session, options);
  const ServoOutcome& o = run.outcome;
  fmt::print("| {} | {} | {} | {} | {:.0f} | {:.0f} | {} |\n", to_string(o.cause), o.cycles,
             o.counts.missed, o.counts.time_guards, 1e6 * o.woke_late.quantile_s(0.99),
             1e6 * o.busy.quantile_s(0.99), service.forces());
}

void delays(const std::string& file, double seconds) {
  for (const double late_s : {0.0, 2e-3, 5e-3}) {
    const HilSession session = measured_session(file);
    test::StandInInverse service(free_plant(session, late_s), {}, true);
    DeviceIdentifyOptions options;
    options.real_time = true;
    options.duration_s = seconds;
    const IdentifyRun run = run_identification(choice_of(service, false), session, options);
    const auto ms = [](const std::optional<double>& s) {
      return s ? fmt::format("{:.2f}", 1e3 * *s) : std::string("not found");
    };
    fmt::print("| {} | {} | {} | {} | {} | {} |\n", 1e3 * late_s, ms(run.found.delay_mean_s),
               ms(run.found.delay_largest_s), ms(run.found.delay_jitter_s), run.found.edges,
               to_string(run.outcome.cause));
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(
      argc, argv, 1, 2, "usage: measure_inverse SESSION [SECONDS]",
      [](const std::vector<std::string>& words) {
        const double seconds = words.size() > 1 ? std::stod(words[1]) : 60.0;
        fmt::print("{}, {} s each; {}\n\n", host_line(), seconds,
                   become_real_time(RealTimeWish::ignore));
        fmt::print("| round trip | messages | p50 / us | p99 / us | p99.9 / us | max / us |\n");
        fmt::print("| --- | --- | --- | --- | --- | --- |\n");
        for (const bool poll : {true, false}) round_trips(poll, seconds);
        fmt::print(
            "\n| loop of 2 kHz ended | cycles | missed periods | cycles with the position "
            "before | woke late p99 / us | busy p99 / us | messages |\n");
        fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
        two_kHz(words[0], seconds);
        fmt::print(
            "\n| put in / ms | mean found / ms | largest / ms | spread / ms | edges | ended "
            "|\n| --- | --- | --- | --- | --- | --- |\n");
        delays(words[0], std::min(seconds, 20.0));
      });
}
