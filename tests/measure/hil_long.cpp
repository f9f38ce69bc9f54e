// Prints the measured numbers of reports/haptics/report.md, "Ten hours":
//     measure_hil_long SESSION HOURS FOLDER
// One motion again and again in virtual time through the whole servo step, with the session's
// model; every row is written, the log starting anew each simulated hour. Resident memory after
// each hour, and how far the last forces are from the first.
#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <memory>
#include <string>

#include "endless_motion.hpp"
#include "program.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/files/row_log.hpp"
#include "tpm/haptics/session/session.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

void run(const std::string& file, double hours, const std::filesystem::path& folder) {
  constexpr double kRound_s = 4.0, kDepth_m = 4e-3;
  constexpr double kHour_s = 3600.0,
                   kForgotten = 80.0;  // relaxation times, the contact's longest is two
  HilSession session = read_session(file);
  LoopModel loop = make_loop_model(session);
  ServoSettings servo{session.servo};
  servo.model_push = loop.push;
  servo.to_model = loop.to_model;
  const double tau_s =
      parse_tissue(session.scene, session.scene_place, {}).bonds().relaxation_time_s();
  const double period_s = session.servo.period_s;
  const auto cycles = [period_s](double seconds) {
    return static_cast<std::uint64_t>(std::llround(seconds / period_s));
  };
  const auto rounds = static_cast<std::uint64_t>(std::llround(hours * kHour_s / kRound_s));
  const auto settled = static_cast<std::uint64_t>(std::ceil(kForgotten * tau_s / kRound_s));
  if (rounds <= settled + 1) throw Error(ExitCode::usage, "HOURS", "too few to settle in");
  const auto rounds_an_hour = static_cast<std::uint64_t>(std::llround(kHour_s / kRound_s));

  test::EndlessMotion device(cycles(kRound_s), kDepth_m);
  const std::filesystem::path path = folder / "hour.rows";
  auto log = std::make_unique<RowLogWriter>(path, "{}", sizeof(ServoRecord));
  fmt::print("{}\nsimulated_h,resident_MB,cpu_s\n", loop.name);
  const auto tell = [](double hour) {
    fmt::print("{:.2f},{:.3f},{:.1f}\n", hour, 1e-6 * test::resident_bytes(),
               static_cast<double>(std::clock()) / CLOCKS_PER_SEC);
    (void)std::fflush(stdout);
  };
  tell(0.0);
  const test::Drift drift = test::endless_run(
      device, *loop.model, servo, cycles(kRound_s), rounds, settled, cycles(kForgotten * tau_s),
      [&](const ServoRecord& row) { log->append(&row); },
      [&](std::uint64_t done) {
        if (done % rounds_an_hour != 0 && done != rounds && done != settled) return;
        tell(static_cast<double>(done) * kRound_s / kHour_s);
        if (done % rounds_an_hour != 0) return;
        log->close("{}");
        log.reset();
        log = std::make_unique<RowLogWriter>(path, "{}", sizeof(ServoRecord));
      });
  log.reset();
  std::filesystem::remove(path);
  fmt::print(
      "largest force {:.6g} N\nlast round less round {}: at most {:.3g} N\na round after "
      "{:.0f} s of rest less the first: at most {:.3g} N\n",
      drift.peak_N, settled + 1, drift.late_rounds_N, kForgotten * tau_s, drift.end_start_N);
  if (const auto* condensed = dynamic_cast<const CondensedContact*>(loop.model.get())) {
    fmt::print("viscous states that the guard kept: {}\n", condensed->kept_viscous_states());
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 3, 3, "measure_hil_long SESSION HOURS FOLDER",
                        [](const auto& words) { run(words[0], std::stod(words[1]), words[2]); });
}
