#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <random>
#include <vector>

#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/contact_model.hpp"
#include "tpmkit/device.hpp"

namespace tpm::test {
using namespace haptics;

/// A spring of stiffness K in every direction.
class LinearSpring : public ContactModel {
 public:
  LinearSpring(double stiffness_N_per_m, double period_s)
      : stiffness_N_per_m_(stiffness_N_per_m), period_s_(period_s) {}
  void reset() noexcept override {}
  ContactAnswer step(const ToolPose& tool) noexcept override {
    ContactAnswer answer;
    answer.force_N = -stiffness_N_per_m_ * tool.displacement_m;
    return answer;
  }
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return stiffness_N_per_m_ * Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return instantaneous_stiffness();
  }

 private:
  double stiffness_N_per_m_, period_s_;
};

/// A device in a hand, along z, whose forces come as late as the clock says and not after whole
/// periods. The hand comes from 2 mm above the surface, pushes, and goes back.
struct LateHandSettings {
  double mass_kg = 0.2, damping_N_s_per_m = 0.2, stiffness_N_per_m = 5.0;  ///< device included
  double friction_N_s_per_m = 0.0;  ///< of the device, in addition: what it takes up is not given
  double delay_s = 0.0;
  double jitter_s = 0.0;  ///< of each force, evenly within +-
  double later_s = 0.0;   ///< the delay from `grows_at_s` on; 0: as before
  double grows_at_s = std::numeric_limits<double>::infinity();
  double push_N = 0.5;                       ///< of the hand against a wall
  double least_speed_m_per_s = 0.01;         ///< of the place where the hand means to be
  double pushes_s = 0.6, withdraws_s = 3.0;  ///< when it does so
  double encoder_step_m = 1e-5, period_s = 1e-3;
};

/// Outcome of a run with a hand.
struct HandTrace {
  /// Of each part of a period: the force that acts less the one that would act if no delay had
  /// grown, N.
  std::vector<double> of_growth_N;
  std::vector<double> read_m, sent_N;  ///< of each cycle
  std::vector<double> most_given_J;    ///< until each cycle
};

class LateHand final : public HapticDevice {
 public:
  static constexpr int kParts = 16;  ///< of a period

  /// @param trace is filled; may be null
  /// @param adds what the hand does beside its spring: `of_growth_N` of another run; may be null
  explicit LateHand(const LateHandSettings& settings, HandTrace* trace = nullptr,
                    const HandTrace* adds = nullptr)
      : s_(settings),
        trace_(trace),
        adds_(adds),
        decay_(std::exp(-(s_.damping_N_s_per_m + s_.friction_N_s_per_m) / s_.mass_kg * s_.period_s /
                        kParts)) {}

  const DeviceIdentity& open() override { return identity_; }
  void prepare(const DevicePreparation&) override {}
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    position_m = {0.0, 0.0, std::round(at_m_ / s_.encoder_step_m) * s_.encoder_step_m};
    return DeviceAnswer::ok;
  }
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override {
    const double delay_s = s_.later_s > 0.0 && time_s_ >= s_.grows_at_s ? s_.later_s : s_.delay_s;
    const double jitter_s = s_.jitter_s * even_(random_);
    newest_s_ = std::max({time_s_, newest_s_, time_s_ + delay_s + jitter_s});
    coming_.push_back({newest_s_, force_N.z()});
    if (trace_ != nullptr) as_told_.push_back({time_s_ + s_.delay_s, force_N.z()});
    return DeviceAnswer::ok;
  }
  DeviceStatus status() noexcept override { return {}; }
  void stop() noexcept override {
    coming_.clear();
    as_told_.clear();
    force_N_ = told_N_ = 0.0;
    if (off_s_ < 0.0) off_s_ = time_s_;
  }
  void cut_forces() noexcept override { stop(); }
  void advance(double seconds) noexcept override {
    const double part_s = seconds / kParts;
    for (int i = 0; i < kParts; ++i) step(part_s);
  }

  /// Energy that the tissue stores now: what the hand did not receive of its own work. J
  void stores(double energy_J) noexcept { stored_J_ = energy_J; }
  /// Most that the hand received beyond what the tissue stored and gave back, J.
  [[nodiscard]] double most_given_J() const noexcept { return most_given_J_; }
  [[nodiscard]] double time_s() const noexcept { return time_s_; }
  [[nodiscard]] double off_s() const noexcept { return off_s_; }  ///< forces off; < 0: on
  /// When the energy given first exceeded 2 mJ; < 0: never.
  [[nodiscard]] double first_2_mJ_s() const noexcept { return first_2_mJ_s_; }
  [[nodiscard]] double fastest_m_per_s() const noexcept { return fastest_m_per_s_; }

 private:
  struct Coming {
    double at_s, force_N;
  };

  void step(double part_s) noexcept {
    while (!coming_.empty() && coming_.front().at_s <= time_s_ + 1e-9) {
      force_N_ = coming_.front().force_N;
      coming_.pop_front();
    }
    while (!as_told_.empty() && as_told_.front().at_s <= time_s_ + 1e-9) {
      told_N_ = as_told_.front().force_N;
      as_told_.pop_front();
    }
    if (trace_ != nullptr) trace_->of_growth_N.push_back(force_N_ - told_N_);
    const double adds_N =
        adds_ != nullptr && part_ < adds_->of_growth_N.size() ? adds_->of_growth_N[part_++] : 0.0;
    const double wall_m = s_.push_N / s_.stiffness_N_per_m;
    const bool pushes = time_s_ >= s_.pushes_s && time_s_ < s_.withdraws_s;
    const double speed = std::max(s_.least_speed_m_per_s, wall_m / 0.5);
    const double wants_m = (pushes ? wall_m : kAbove_m) - meant_m_;
    meant_m_ += std::clamp(wants_m, -speed * part_s, speed * part_s);
    const double before_m = at_m_;
    const double spring_N = s_.stiffness_N_per_m * (meant_m_ - at_m_);
    speed_ = speed_ * decay_ + (force_N_ + adds_N + spring_N) / s_.mass_kg * part_s;
    at_m_ += speed_ * part_s;
    time_s_ += part_s;
    fastest_m_per_s_ = std::max(fastest_m_per_s_, std::abs(speed_));
    if (off_s_ >= 0.0) return;
    given_J_ += (force_N_ - s_.friction_N_s_per_m * speed_) * (at_m_ - before_m);
    const double now_J = given_J_ + stored_J_;
    least_J_ = std::min(least_J_, now_J);
    most_given_J_ = std::max(most_given_J_, now_J - least_J_);
    if (most_given_J_ > 2e-3 && first_2_mJ_s_ < 0.0) first_2_mJ_s_ = time_s_;
  }

  static constexpr double kAbove_m = -2e-3;
  LateHandSettings s_;
  HandTrace* trace_;
  const HandTrace* adds_;
  std::size_t part_ = 0;
  double decay_, told_N_ = 0.0;
  DeviceIdentity identity_;
  std::deque<Coming> coming_, as_told_;
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> even_{-1.0, 1.0};
  double time_s_ = 0.0, newest_s_ = 0.0, at_m_ = kAbove_m, meant_m_ = kAbove_m, speed_ = 0.0;
  double force_N_ = 0.0, given_J_ = 0.0, stored_J_ = 0.0, least_J_ = 0.0, most_given_J_ = 0.0;
  double off_s_ = -1.0, first_2_mJ_s_ = -1.0, fastest_m_per_s_ = 0.0;
};

struct HandRun {
  double most_given_J = 0.0, first_2_mJ_s = -1.0, off_s = -1.0, fastest_m_per_s = 0.0;
  StopCause cause = StopCause::none;
};

/// The hand on a spring for five seconds, supervised as the settings say.
/// @param oracle forces go off one delay after the energy given exceeds 2 mJ, by nothing else
/// @param trace, adds see LateHand
inline HandRun run_hand(const LateHandSettings& hand, double stiffness_N_per_m,
                        ServoSettings settings, bool oracle = false, HandTrace* trace = nullptr,
                        const HandTrace* adds = nullptr) {
  constexpr double kLength_s = 5.0;
  settings.period_s = hand.period_s;
  settings.push = Eigen::Vector3d::UnitZ();
  settings.phase_ends = {static_cast<std::uint64_t>(std::llround(kLength_s / hand.period_s))};
  if (oracle) {
    settings.energy_allowance_J = std::numeric_limits<double>::infinity();
    settings.watch_oscillation = false;
    settings.most_damping_N_s_per_m = 0.0;
  }
  LateHand device(hand, trace, adds);
  LinearSpring spring(stiffness_N_per_m, hand.period_s);
  ServoStep step(device, spring, settings);
  ServoRecord row;
  HandRun run;
  const double late_s = std::max(hand.delay_s, hand.later_s);
  while (run.cause == StopCause::none) {
    run.cause = step.cycle(0, row);
    if (trace != nullptr) {
      trace->read_m.push_back(row.position_m[2]);
      trace->sent_N.push_back(row.commanded_N[2]);
      trace->most_given_J.push_back(device.most_given_J());
    }
    device.stores(0.5 * row.model_force_N * row.model_force_N / stiffness_N_per_m);
    device.advance(hand.period_s);
    const double since_s = device.first_2_mJ_s();
    if (oracle && since_s >= 0.0 && device.time_s() >= since_s + late_s) {
      device.stop();
      break;
    }
  }
  run.most_given_J = device.most_given_J();
  run.first_2_mJ_s = device.first_2_mJ_s();
  run.off_s = device.off_s();
  run.fastest_m_per_s = device.fastest_m_per_s();
  return run;
}

}  // namespace tpm::test
