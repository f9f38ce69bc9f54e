// Prints tables of reports/haptics/report.md, "A delay that grows": what no supervisor can tell
// from positions and forces, and what other thresholds would do.
//     measure_late_twins twins              for each run that passes too much or is late, a hand on
//                                           the device as it was told that moves in the same way
//     measure_late_twins thresholds         runs that miss, by the threshold of the fit
//     measure_late_twins motions FIRST COUNT  the largest sign of passive set-ups in random hands
// The runs are those of measure_hands passive, the motions those of test_safety_slow.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "late_hand.hpp"
#include "program.hpp"
#include "random_ways.hpp"
#include "tpm/haptics/session/six_hands.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

constexpr double kPeriod_s = 1e-3;
constexpr double kStiffnesses[] = {100, 150, 200, 300, 400, 600, 1000, 2000, 4000};
constexpr double kMeasured_s[] = {0.0, 1e-3, 2e-3};
constexpr double kGrown_s[] = {5e-3, 10e-3, 20e-3};
constexpr std::array kThresholds{0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0};

struct Cell {
  double stiffness_N_per_m;
  ServoSettings settings;
  test::LateHandSettings hand;
};

/// Calls work(cell) for each run of measure_hands passive with this delay. @param grown_s 0: stays
template <class Work>
void for_cells(double measured_s, double grown_s, const Work& work) {
  for (const double stiffness : kStiffnesses) {
    Cell cell;
    cell.stiffness_N_per_m = stiffness;
    cell.settings.delay_periods =
        static_cast<int>(std::ceil((measured_s + kPeriod_s) / kPeriod_s - 1e-9));
    cell.settings.friction_N_s_per_m =
        1.0001 * stiffness * (0.5 + cell.settings.delay_periods) * kPeriod_s;
    cell.hand.friction_N_s_per_m = cell.settings.friction_N_s_per_m;
    cell.hand.delay_s = measured_s;
    cell.hand.later_s = grown_s;
    if (grown_s > 0.0) cell.hand.grows_at_s = 1.0;
    for (const SafeHand& hand : kSafeHands) {
      cell.hand.mass_kg = hand.mass_kg;
      cell.hand.damping_N_s_per_m = hand.damping_N_s_per_m;
      cell.hand.stiffness_N_per_m = hand.stiffness_N_per_m;
      for (const double push_N : {0.2, 1.0}) {
        for (const double speed : {0.01, 0.1}) {
          cell.hand.push_N = push_N;
          cell.hand.least_speed_m_per_s = speed;
          work(cell);
        }
      }
    }
  }
}

/// The hands of test_safety_slow: an arm of 135 N/m whose place moves at 100 mm/s at most.
constexpr double kUsualRise_N_per_s = 13.5;

double allowed_s(double grown_s) {
  return 3.0 * grown_s + 0.02;
}
double allowed_J(double oracle_J) {
  return 1.5 * oracle_J + 1e-3;
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

/// Of runs that miss, and their twins.
struct Twins {
  int runs = 0, misses = 0, same = 0, usual = 0;
  double most_given_J = 0.0;  ///< by the twin's rendering, on time
  std::vector<double> force_N, rise_N_per_s;
};

/// The run of a cell; if it misses, the twin: the device as it was told, in a hand that adds what
/// the growth did.
void add_twin(Twins& twins, const Cell& cell) {
  ++twins.runs;
  test::HandTrace late;
  const test::HandRun run =
      test::run_hand(cell.hand, cell.stiffness_N_per_m, cell.settings, false, &late);
  const test::HandRun oracle =
      test::run_hand(cell.hand, cell.stiffness_N_per_m, cell.settings, true);
  const double due_s =
      run.first_2_mJ_s < 0.0 ? 1e9 : run.first_2_mJ_s + allowed_s(cell.hand.later_s);
  const bool misses_time = run.off_s > due_s + 1e-9;
  const double most_J = allowed_J(oracle.most_given_J);
  if (!misses_time && run.most_given_J <= most_J) return;
  ++twins.misses;
  // When forces would have had to be off.
  std::size_t until = late.most_given_J.size();
  if (misses_time) until = std::min(until, static_cast<std::size_t>(due_s / kPeriod_s));
  const auto over = std::find_if(late.most_given_J.begin(), late.most_given_J.end(),
                                 [&](double given_J) { return given_J > most_J; });
  until = std::min(until, static_cast<std::size_t>(over - late.most_given_J.begin()));

  test::LateHandSettings hand = cell.hand;
  hand.later_s = 0.0;
  test::HandTrace twin;
  const test::HandRun other =
      test::run_hand(hand, cell.stiffness_N_per_m, cell.settings, false, &twin, &late);
  if (twin.read_m == late.read_m && twin.sent_N == late.sent_N && other.cause == run.cause &&
      other.off_s == run.off_s) {
    ++twins.same;
  }
  twins.most_given_J = std::max(twins.most_given_J, other.most_given_J);
  constexpr std::size_t kRise = 20 * test::LateHand::kParts;  // over 20 ms
  const std::size_t parts =
      std::min(late.of_growth_N.size(), until * static_cast<std::size_t>(test::LateHand::kParts));
  double force_N = 0.0, rise_N = 0.0;
  for (std::size_t i = 0; i < parts; ++i) {
    force_N = std::max(force_N, std::abs(late.of_growth_N[i]));
    if (i < kRise) continue;
    rise_N = std::max(rise_N, std::abs(late.of_growth_N[i] - late.of_growth_N[i - kRise]));
  }
  twins.force_N.push_back(force_N);
  const double rise_N_per_s = rise_N / 20e-3;
  twins.rise_N_per_s.push_back(rise_N_per_s);
  twins.usual += rise_N_per_s <= kUsualRise_N_per_s ? 1 : 0;
}

void print_row(const std::string& what, const Twins& t) {
  fmt::print(
      "| {} | {} | {} | {} | {:.2g} | {:.2g}, {:.2g}, {:.2g} | {:.2g}, {:.2g}, {:.2g} | {} |\n",
      what, t.runs, t.misses, t.same, 1e3 * t.most_given_J, quantile(t.force_N, 0.5),
      quantile(t.force_N, 0.9), quantile(t.force_N, 1.0), quantile(t.rise_N_per_s, 0.5),
      quantile(t.rise_N_per_s, 0.9), quantile(t.rise_N_per_s, 1.0), t.usual);
}

void print_twins() {
  fmt::print(
      "| measured, grown to, ms | runs | miss | twins that are the same | most given to a twin, mJ "
      "| its force, N: median, 90 %, largest | its rise, N/s: median, 90 %, largest | no faster "
      "than {} N/s |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- |\n",
      kUsualRise_N_per_s);
  Twins all;
  for (const double measured_s : kMeasured_s) {
    for (const double grown_s : kGrown_s) {
      Twins twins;
      for_cells(measured_s, grown_s, [&](const Cell& cell) { add_twin(twins, cell); });
      print_row(fmt::format("{}, {}", 1e3 * measured_s, 1e3 * grown_s), twins);
      all.runs += twins.runs;
      all.misses += twins.misses;
      all.same += twins.same;
      all.usual += twins.usual;
      all.most_given_J = std::max(all.most_given_J, twins.most_given_J);
      all.force_N.insert(all.force_N.end(), twins.force_N.begin(), twins.force_N.end());
      all.rise_N_per_s.insert(all.rise_N_per_s.end(), twins.rise_N_per_s.begin(),
                              twins.rise_N_per_s.end());
    }
  }
  print_row("all", all);
}

/// The supervision of a passive rendering, apart from the loop: what it says with each threshold.
class Supervision {
 public:
  explicit Supervision(const ServoSettings& s)
      : oscillation_({.period_s = s.period_s}),
        late_({.period_s = s.period_s,
               .told_s = s.delay_periods * s.period_s,
               .friction_N_s_per_m = s.friction_N_s_per_m}),
        delay_({.period_s = s.period_s, .told_s = s.delay_periods * s.period_s}),
        push_(s.push) {}

  /// After a cycle.
  void see(const ServoStep& step, const ServoRecord& row) {
    const Eigen::Vector3d at_m(row.position_m[0], row.position_m[1], row.position_m[2]);
    const Eigen::Vector3d moved_m =
        begun_ ? Eigen::Vector3d(at_m - at_m_) : Eigen::Vector3d::Zero();
    const double tissue_J = step.energy().tissue_J();
    oscillation_.observe(sent_N_.norm(), 1);
    late_.observe(sent_N_, moved_m, tissue_J - tissue_J_, 1);
    delay_.observe(push_.dot(at_m), push_.dot(sent_N_), 1);
    oscillates_ = oscillates_ || oscillation_.found();
    sign_ = late_.found() ? delay_.sign() : 0.0;
    at_m_ = at_m;
    begun_ = true;
    tissue_J_ = tissue_J;
    sent_N_ = {row.commanded_N[0], row.commanded_N[1], row.commanded_N[2]};
  }
  [[nodiscard]] bool oscillates() const { return oscillates_; }
  /// Of a delay that has grown, now; found is above the threshold.
  [[nodiscard]] double sign() const { return sign_; }

 private:
  OscillationWatch oscillation_;
  LateEnergyWatch late_;
  DelayWatch delay_;
  Eigen::Vector3d push_, at_m_ = Eigen::Vector3d::Zero(), sent_N_ = Eigen::Vector3d::Zero();
  double tissue_J_ = 0.0, sign_ = 0.0;
  bool begun_ = false, oscillates_ = false;
};

/// A run in which nothing but an energy given ends forces, and when they would have gone off.
struct WatchedRun {
  std::array<double, kThresholds.size()> off_s{}, given_J{};
  std::array<bool, kThresholds.size()> stopped{};
  double first_2_mJ_s = -1.0;
};

WatchedRun watched_run(const Cell& cell) {
  ServoSettings settings = cell.settings;
  settings.period_s = cell.hand.period_s;
  settings.push = Eigen::Vector3d::UnitZ();
  settings.phase_ends = {5000};
  Supervision supervision(settings);
  settings.watch_oscillation = false;
  test::LateHand device(cell.hand);
  test::LinearSpring spring(cell.stiffness_N_per_m, cell.hand.period_s);
  ServoStep step(device, spring, settings);
  ServoRecord row;
  WatchedRun run;
  StopCause cause = StopCause::none;
  while (cause == StopCause::none) {
    cause = step.cycle(0, row);
    if (cause == StopCause::none) supervision.see(step, row);
    for (std::size_t i = 0; i < kThresholds.size(); ++i) {
      const bool stops = supervision.oscillates() || supervision.sign() > kThresholds[i];
      if (run.stopped[i] || (!stops && cause == StopCause::none)) continue;
      run.stopped[i] = cause != StopCause::finished;
      run.off_s[i] = device.time_s();
      run.given_J[i] = device.most_given_J();
    }
    if (std::all_of(run.stopped.begin(), run.stopped.end(), [](bool b) { return b; })) break;
    device.stores(0.5 * row.model_force_N * row.model_force_N / cell.stiffness_N_per_m);
    device.advance(cell.hand.period_s);
  }
  run.first_2_mJ_s = device.first_2_mJ_s();
  return run;
}

void print_thresholds() {
  std::array<int, kThresholds.size()> late{}, much{}, any{}, stopped{};
  std::array<double, kThresholds.size()> most_J{};
  int runs = 0, without = 0;
  for (const double measured_s : kMeasured_s) {
    for (const double grown_s : kGrown_s) {
      for_cells(measured_s, grown_s, [&](const Cell& cell) {
        ++runs;
        const WatchedRun run = watched_run(cell);
        const test::HandRun oracle =
            test::run_hand(cell.hand, cell.stiffness_N_per_m, cell.settings, true);
        for (std::size_t i = 0; i < kThresholds.size(); ++i) {
          // What comes after forces are off does not count.
          const bool reached = run.first_2_mJ_s >= 0.0 && run.off_s[i] >= run.first_2_mJ_s;
          const bool is_late =
              reached && run.off_s[i] - run.first_2_mJ_s > allowed_s(grown_s) + 1e-9;
          const bool is_much = run.given_J[i] > allowed_J(oracle.most_given_J);
          late[i] += is_late ? 1 : 0;
          much[i] += is_much ? 1 : 0;
          any[i] += is_late || is_much ? 1 : 0;
          most_J[i] = std::max(most_J[i], run.given_J[i]);
        }
      });
    }
    for_cells(measured_s, 0.0, [&](const Cell& cell) {
      ++without;
      const WatchedRun run = watched_run(cell);
      for (std::size_t i = 0; i < kThresholds.size(); ++i) stopped[i] += run.stopped[i] ? 1 : 0;
    });
  }
  fmt::print(
      "| threshold | off too late, of {0} | too much passes | either | most into a hand, mJ | "
      "stopped without growth, of {1} |\n| --- | --- | --- | --- | --- | --- |\n",
      runs, without);
  for (std::size_t i = 0; i < kThresholds.size(); ++i) {
    fmt::print("| {} | {} | {} | {} | {:.0f} | {} |\n", kThresholds[i], late[i], much[i], any[i],
               1e3 * most_J[i], stopped[i]);
  }
}

void print_motions(int first, int count) {
  constexpr int kWays = 1000;
  Random random(2024);
  std::array<int, kThresholds.size()> beyond{};
  int ended = 0;
  double largest = 0.0, most_delivered_J = 0.0;
  for (int i = 0; i < first + count; ++i) {
    const test::PassiveSetUp s = test::next_passive_set_up(random, i, kWays);
    if (i < first) continue;
    contact::ElementContact model(s.tissue, s.servo.period_s);
    VirtualOmega7 device(s.plant, s.script);
    (void)device.open();
    device.prepare({});
    device.enable_forces();
    ServoSettings settings = s.servo;
    Supervision supervision(settings);
    settings.watch_oscillation = false;
    ServoStep step(device, model, settings);
    ServoRecord row;
    StopCause cause = StopCause::none;
    double sign = 0.0;
    while (cause == StopCause::none) {
      cause = step.cycle(0, row);
      if (cause == StopCause::none) supervision.see(step, row);
      sign = std::max(sign, supervision.sign());
      device.advance(s.servo.period_s);
    }
    most_delivered_J = std::max(most_delivered_J, step.energy().most_delivered_J());
    ended += cause != StopCause::finished || supervision.oscillates() ? 1 : 0;
    largest = std::max(largest, sign);
    for (std::size_t k = 0; k < kThresholds.size(); ++k) beyond[k] += sign > kThresholds[k] ? 1 : 0;
  }
  fmt::print(
      "set-ups {} to {}, {} motions: ended by anything else {}, largest sign {:.3f}, most "
      "delivered {:.3f} mJ; set-ups beyond",
      first, first + count - 1, count * kWays, ended, largest, 1e3 * most_delivered_J);
  for (std::size_t k = 0; k < kThresholds.size(); ++k) {
    fmt::print("{} {}: {}", k == 0 ? "" : ",", kThresholds[k], beyond[k]);
  }
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 1, 3, "measure_late_twins twins|thresholds|motions FIRST COUNT",
                        [](const std::vector<std::string>& words) {
                          if (words[0] == "twins") return print_twins();
                          if (words[0] == "thresholds") return print_thresholds();
                          if (words[0] == "motions" && words.size() == 3) {
                            return print_motions(std::stoi(words[1]), std::stoi(words[2]));
                          }
                          throw Error(ExitCode::usage, "measure_late_twins", words[0],
                                      "twins, thresholds or motions FIRST COUNT");
                        });
}
