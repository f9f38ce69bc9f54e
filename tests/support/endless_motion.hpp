#pragma once
// One motion again and again, to the bit, for as long as is asked: does anything grow or drift?
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::test {
using namespace haptics;

/// Positions of one round of a motion along -z, repeated: to a depth and back, held, the second
/// half in the air. Encoder steps as of an Omega.7.
class EndlessMotion final : public HapticDevice {
 public:
  EndlessMotion(std::uint64_t cycles_a_round, double depth_m) {
    constexpr double kStep_m = 1e-5, kAir_m = 2e-3;
    for (std::uint64_t i = 0; i < cycles_a_round; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(cycles_a_round);
      const double depth = (depth_m + kAir_m) * std::sin(2.0 * std::numbers::pi * part) - kAir_m;
      depth_m_.push_back(kStep_m * std::round(depth / kStep_m));
    }
  }
  /// The tool stays in the air from now on, or starts a round.
  void lift(bool lifted) {
    lifted_ = lifted;
    next_ = 0;
  }
  const DeviceIdentity& open() override { return identity_; }
  void prepare(const DevicePreparation&) override {}
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    position_m = {0.0, 0.0, lifted_ ? -depth_m_.front() : -depth_m_[next_]};
    return DeviceAnswer::ok;
  }
  void advance(double) noexcept override {
    if (!lifted_) next_ = (next_ + 1) % depth_m_.size();
  }
  DeviceAnswer write(const Eigen::Vector3d&) noexcept override { return DeviceAnswer::ok; }
  DeviceStatus status() noexcept override { return {}; }
  void stop() noexcept override {}
  void cut_forces() noexcept override {}

 private:
  std::vector<double> depth_m_;
  std::size_t next_ = 0;
  bool lifted_ = false;
  DeviceIdentity identity_;
};

/// Resident memory of this process, bytes.
inline double resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return 1024.0 * std::stod(line.substr(6));
  }
  return 0.0;
}

/// Largest differences of the force commanded, N.
struct Drift {
  double peak_N = 0.0;
  double late_rounds_N = 0.0;  ///< of the last round from the one by which rest is forgotten
  double end_start_N = 0.0;    ///< of a round after the end and a rest from the first
};

/// A whole servo step, period for period: `rounds` rounds, a rest, one more round.
/// @param settled from this round on the tissue has forgotten that it began at rest
/// @param rest_cycles in the air, after which it has forgotten everything
/// @param round_done called with the number of rounds done
template <class Sink, class RoundDone>
Drift endless_run(EndlessMotion& device, ContactModel& model, ServoSettings settings,
                  std::uint64_t cycles_a_round, std::uint64_t rounds, std::uint64_t settled,
                  std::uint64_t rest_cycles, Sink&& sink, RoundDone&& round_done) {
  settings.ramp_in_s = 0.0;  // or the first round would differ by it
  settings.gate.reset();     // and wait for a hand at rest
  settings.phase_ends = {(rounds + 2) * cycles_a_round + rest_cycles};
  ServoStep step(device, model, settings);
  std::vector<double> first(cycles_a_round), steady(cycles_a_round);
  ServoRecord row;
  Drift drift;
  const auto cycle = [&] {
    (void)step.cycle(0, row);
    sink(row);
    device.advance(settings.period_s);
    return -settings.push.dot(
        Eigen::Vector3d(row.commanded_N[0], row.commanded_N[1], row.commanded_N[2]));
  };
  device.lift(false);
  for (std::uint64_t round = 0; round < rounds; ++round) {
    for (std::uint64_t i = 0; i < cycles_a_round; ++i) {
      const double force = cycle();
      if (round == 0) first[i] = force;
      if (round == settled) steady[i] = force;
      drift.peak_N = std::max(drift.peak_N, force);
      if (round + 1 == rounds) {
        drift.late_rounds_N = std::max(drift.late_rounds_N, std::abs(force - steady[i]));
      }
    }
    round_done(round + 1);
  }
  device.lift(true);
  for (std::uint64_t i = 0; i < rest_cycles; ++i) (void)cycle();
  device.lift(false);
  for (std::uint64_t i = 0; i < cycles_a_round; ++i) {
    drift.end_start_N = std::max(drift.end_start_N, std::abs(cycle() - first[i]));
  }
  return drift;
}

}  // namespace tpm::test
