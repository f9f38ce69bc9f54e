// Prints the measured numbers of reports/haptics/report.md, "Six hands", as CSV:
//     measure_hands gate     what the gate lets pass, delay wrong by half a period, with jitter
//     measure_hands grown    a delay that grows unseen, beside an oracle
//     measure_hands passive  the same where the rendering is passive with the friction of the
//     device
//                            at the delay measured, and without any growth
//     measure_hands limits   the gate's stiffness for some delays
// A spring of 100 to 4000 N/m, forces 0 to 20 ms late, six hands (haptics/six_hands.hpp), 1 kHz.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "late_hand.hpp"
#include "program.hpp"
#include "tpm/haptics/session/six_hands.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kStiffnesses[] = {100, 150, 200, 300, 400, 600, 1000, 2000, 4000};
constexpr double kDelays_s[] = {0.0, 1e-3, 2e-3, 3e-3, 5e-3, 7e-3, 10e-3, 15e-3, 20e-3};
constexpr double kPushes_N[] = {0.2, 1.0};
constexpr double kSpeeds_m_per_s[] = {0.01, 0.1};

test::LateHandSettings in_hand(const SafeHand& hand, double push_N, double speed_m_per_s) {
  test::LateHandSettings s;
  s.mass_kg = hand.mass_kg;
  s.damping_N_s_per_m = hand.damping_N_s_per_m;
  s.stiffness_N_per_m = hand.stiffness_N_per_m;
  s.push_N = push_N;
  s.least_speed_m_per_s = speed_m_per_s;
  return s;
}

/// A loop that was told a delay and no friction.
ServoSettings told(double delay_s) {
  ServoSettings settings;
  settings.friction_N_s_per_m = 0.0;
  settings.delay_periods = static_cast<int>(std::ceil(delay_s / kPeriod_s - 1e-9));
  return settings;
}

/// Largest energy of a cell over pushes and speeds.
struct Cell {
  double most_J = 0.0;
  int runs = 0, stopped = 0;
};

void print_gate() {
  fmt::print("stiffness_N_per_m,measured_delay_ms,hand,let_pass,runs,stopped,most_into_hand_mJ\n");
  for (const double stiffness : kStiffnesses) {
    for (const double delay_s : kDelays_s) {
      const double counted_s = delay_s + kPeriod_s;
      const bool let = stiffness <= largest_stiffness_for_hands(counted_s, 0.0, kPeriod_s);
      for (const SafeHand& hand : kSafeHands) {
        Cell cell;
        for (const double error_s : {-0.5 * kPeriod_s, 0.0, 0.5 * kPeriod_s}) {
          for (const double push_N : kPushes_N) {
            for (const double speed : kSpeeds_m_per_s) {
              test::LateHandSettings s = in_hand(hand, push_N, speed);
              s.delay_s = std::max(0.0, delay_s + error_s);
              s.jitter_s = 0.5 * kPeriod_s;
              const test::HandRun run = test::run_hand(s, stiffness, told(counted_s));
              cell.most_J = std::max(cell.most_J, run.most_given_J);
              cell.stopped += run.cause == StopCause::finished ? 0 : 1;
              ++cell.runs;
            }
          }
        }
        fmt::print("{},{},\"{}\",{},{},{},{:.3f}\n", stiffness, 1e3 * delay_s, hand.name,
                   let ? 1 : 0, cell.runs, cell.stopped, 1e3 * cell.most_J);
      }
    }
  }
}

void print_grown() {
  fmt::print(
      "stiffness_N_per_m,measured_delay_ms,grown_to_ms,hand,push_N,speed_m_per_s,into_hand_mJ,"
      "oracle_mJ,reaches_2_mJ,off_after_2_mJ_ms,allowed_ms,off_s,cause\n");
  for (const double delay_s : {0.0, 1e-3, 2e-3}) {
    const double counted_s = delay_s + kPeriod_s;
    for (const double grown_s : {5e-3, 10e-3, 20e-3}) {
      for (const double stiffness : kStiffnesses) {
        if (stiffness > largest_stiffness_for_hands(counted_s, 0.0, kPeriod_s)) continue;
        for (const SafeHand& hand : kSafeHands) {
          for (const double push_N : kPushes_N) {
            for (const double speed : kSpeeds_m_per_s) {
              test::LateHandSettings s = in_hand(hand, push_N, speed);
              s.delay_s = delay_s;
              s.later_s = grown_s;
              s.grows_at_s = 1.0;
              const test::HandRun run = test::run_hand(s, stiffness, told(counted_s));
              const test::HandRun oracle = test::run_hand(s, stiffness, told(counted_s), true);
              const bool reached = run.first_2_mJ_s >= 0.0;
              const double after_s = reached ? run.off_s - run.first_2_mJ_s : 0.0;
              fmt::print("{},{},{},\"{}\",{},{},{:.3f},{:.3f},{},{:.1f},{:.0f},{:.3f},{}\n",
                         stiffness, 1e3 * delay_s, 1e3 * grown_s, hand.name, push_N, speed,
                         1e3 * run.most_given_J, 1e3 * oracle.most_given_J, reached ? 1 : 0,
                         1e3 * after_s, 1e3 * (3.0 * grown_s + 0.02), run.off_s,
                         to_string(run.cause));
            }
          }
        }
      }
    }
  }
}

void print_passive() {
  fmt::print(
      "stiffness_N_per_m,friction_N_s_per_m,measured_delay_ms,grown_to_ms,hand,push_N,speed_m_per_"
      "s,"
      "into_hand_mJ,oracle_mJ,reaches_2_mJ,off_after_2_mJ_ms,allowed_ms,off_s,cause\n");
  for (const double delay_s : {0.0, 1e-3, 2e-3}) {
    ServoSettings settings = told(delay_s + kPeriod_s);
    for (const double grown_s : {0.0, 5e-3, 10e-3, 20e-3}) {  // 0: it does not grow
      for (const double stiffness : kStiffnesses) {
        // 0.01 % above the boundary of passivity at the delay told.
        const double friction = 1.0001 * stiffness * (0.5 + settings.delay_periods) * kPeriod_s;
        settings.friction_N_s_per_m = friction;
        for (const SafeHand& hand : kSafeHands) {
          for (const double push_N : kPushes_N) {
            for (const double speed : kSpeeds_m_per_s) {
              test::LateHandSettings s = in_hand(hand, push_N, speed);
              s.friction_N_s_per_m = friction;
              s.delay_s = delay_s;
              s.later_s = grown_s;
              if (grown_s > 0.0) s.grows_at_s = 1.0;
              const test::HandRun run = test::run_hand(s, stiffness, settings);
              const test::HandRun oracle = test::run_hand(s, stiffness, settings, true);
              const bool reached = run.first_2_mJ_s >= 0.0;
              const double after_s = reached ? run.off_s - run.first_2_mJ_s : 0.0;
              fmt::print("{},{:.4f},{},{},\"{}\",{},{},{:.3f},{:.3f},{},{:.1f},{:.0f},{:.3f},{}\n",
                         stiffness, friction, 1e3 * delay_s, 1e3 * grown_s, hand.name, push_N,
                         speed, 1e3 * run.most_given_J, 1e3 * oracle.most_given_J, reached ? 1 : 0,
                         1e3 * after_s, 1e3 * (3.0 * grown_s + 0.02), run.off_s,
                         to_string(run.cause));
            }
          }
        }
      }
    }
  }
}

void print_limits() {
  fmt::print("delay_ms,largest_stiffness_N_per_m\n");
  for (const double delay_s : {0.0, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3}) {
    fmt::print("{},{:.0f}\n", 1e3 * delay_s, largest_stiffness_for_hands(delay_s, 0.0, kPeriod_s));
  }
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 1, 1, "measure_hands gate|grown|passive|limits",
                        [](const std::vector<std::string>& words) {
                          if (words[0] == "gate") return print_gate();
                          if (words[0] == "grown") return print_grown();
                          if (words[0] == "passive") return print_passive();
                          if (words[0] == "limits") return print_limits();
                          throw Error(ExitCode::usage, "measure_hands", words[0],
                                      "gate, grown, passive or limits");
                        });
}
