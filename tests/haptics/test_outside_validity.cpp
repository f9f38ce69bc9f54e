// Forces outside the validity of a model: what is rendered instead, and for how long.
#include <catch2/catch.hpp>
#include <cmath>

#include "counted_allocations.hpp"
#include "late_hand.hpp"
#include "shaken_contact.hpp"
#include "tpm/haptics/loop/servo_step.hpp"

namespace tpm::haptics {
namespace {

using test::guarded;
using test::Puppet;

/// A spring of which every second answer, or none after a while, is valid.
class OftenInvalid final : public test::LinearSpring {
 public:
  enum class Way { alternating, for_good };
  explicit OftenInvalid(Way way) : LinearSpring(200.0, 1e-3), way_(way) {}
  void reset() noexcept override { steps_ = 0; }
  ContactAnswer step(const ToolPose& tool) noexcept override {
    ++steps_;
    ContactAnswer answer;
    answer.valid = way_ == Way::alternating ? steps_ < 500 || steps_ % 2 == 0 : steps_ < 500;
    answer.force_N = (answer.valid ? -200.0 : -600.0) * tool.displacement_m;
    return answer;
  }

 private:
  Way way_;
  int steps_ = 0;
};

struct RenderedInvalid {
  double largest_N = 0.0, largest_jump_N = 0.0, last_N = 0.0, energy_J = 0.0;
  StopCause cause = StopCause::none;
  int cycles_after = 0;
};

/// To 2 mm in 0.4 s, held, and slowly on: 0.4 N are valid.
RenderedInvalid rendered(OftenInvalid::Way way, bool in_space) {
  OftenInvalid model(way);
  Puppet device;
  ServoSettings settings = guarded();
  if (in_space) settings.to_model = Eigen::Matrix3d::Identity();
  ServoStep step(device, model, settings);
  ServoRecord row;
  RenderedInvalid result;
  double before_N = 0.0;
  for (int i = 1; i <= 5000 && result.cause == StopCause::none; ++i) {
    const double before_m = device.at.z();
    device.at.z() = i <= 400 ? 5e-6 * i : 2e-3 + 2e-7 * (i - 400);
    result.cause = step.cycle(0, row);
    if (result.cause != StopCause::none) break;
    const double force = -device.force.z();
    result.energy_J += before_N * (device.at.z() - before_m);
    result.largest_N = std::max(result.largest_N, force);
    result.largest_jump_N = std::max(result.largest_jump_N, std::abs(force - before_N));
    result.last_N = before_N = force;
    result.cycles_after = i - 500;
  }
  return result;
}

TEST_CASE("A force outside validity is not sent: the last valid one fades, and the session ends") {
  for (const bool in_space : {false, true}) {
    CAPTURE(in_space);
    const RenderedInvalid result = rendered(OftenInvalid::Way::for_good, in_space);
    CHECK(result.cause == StopCause::outside_validity);
    CHECK(result.largest_N < 0.41);  // the model answers 1.2 N
    CHECK(result.largest_jump_N < 0.005);
    CHECK(result.cycles_after <= 501);
    CHECK(result.last_N < 0.41 * std::exp(-4.9));
    const RenderedInvalid wave = rendered(OftenInvalid::Way::alternating, in_space);
    CHECK(wave.largest_N < 0.45);  // the wave was one of 0.8 N at 500 Hz
    CHECK(wave.largest_jump_N < 0.02);
    CHECK(wave.cause == StopCause::outside_validity);
  }
}

TEST_CASE("A force outside validity gives back no more than its stiffness stored") {
  OftenInvalid model(OftenInvalid::Way::for_good);
  Puppet device;
  ServoStep step(device, model, guarded());
  ServoRecord row;
  for (int i = 1; i <= 510; ++i) {
    device.at.z() = std::min(2e-3, 5e-6 * i);
    REQUIRE(step.cycle(0, row) == StopCause::none);
  }
  const double held_N = -device.force.z();
  CHECK((row.flags & kBeyondModel) != 0);
  double delivered_J = 0.0;
  for (int i = 1; i <= 40; ++i) {
    const double force = -device.force.z(), before = device.at.z();
    device.at.z() -= 5e-5;
    REQUIRE(step.cycle(0, row) == StopCause::none);
    delivered_J += 0.5 * (force - device.force.z()) * (before - device.at.z());
  }
  CHECK(device.force.z() == 0.0);
  CHECK(delivered_J <= 1.001 * held_N * held_N / (2.0 * 200.0));
}

TEST_CASE("No part of the watch allocates, also when it acts") {
  OftenInvalid model(OftenInvalid::Way::alternating);
  Puppet device;
  ServoSettings settings = guarded();
  settings.gate = StartGateSettings{};
  ServoStep step(device, model, settings);
  ServoRecord row;
  StopCause cause = StopCause::none;
  device.at.z() = -2e-3;
  const testing::HeapWatch heap;
  for (int i = 0; i < 5000 && cause == StopCause::none; ++i) {
    if (i > 300) device.at.z() = -2e-3 + 8e-3 * (i % 2);
    cause = step.cycle(i % 7 == 0 ? 3 : 0, row);
  }
  const long calls = heap.calls();
  CHECK(cause != StopCause::none);
  CHECK(calls == 0);
}

}  // namespace
}  // namespace tpm::haptics
