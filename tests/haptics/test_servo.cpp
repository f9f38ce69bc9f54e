// The servo step: what it renders, limits, counts and refuses.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "counted_allocations.hpp"
#include "hil_scenes.hpp"
#include "late_hand.hpp"
#include "shaken_contact.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/contact/element_contact.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/servo_loop.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::Puppet;

TpmParameters slow_liver() {
  TpmParameters p;
  p.eta1_Pa_s = 2.4e4;  // tau 1 s
  return p;
}

ServoSettings plain(std::uint64_t cycles = 1'000'000) {
  ServoSettings s;
  s.phase_ends = {cycles};
  s.push = Eigen::Vector3d::UnitZ();
  s.ramp_in_s = 0.0;
  s.slew_limit_N_per_s = 1e9;
  s.force_limit_N = 1e9;
  s.most_damping_N_s_per_m = 0.0;
  s.energy_allowance_J = std::numeric_limits<double>::infinity();
  s.watch_oscillation = false;
  s.most_speed_m_per_s = std::numeric_limits<double>::infinity();
  return s;
}

TEST_CASE("What is taken from the heap is counted, by new and by Eigen") {
  const testing::HeapWatch heap;
  const auto text = std::make_unique<std::string>(100, 'x');
  const Eigen::VectorXd vector = Eigen::VectorXd::Random(100);
  const long taken = heap.calls();
  CHECK(taken == 3);  // a string, its text, a vector
  CHECK(text->size() + static_cast<std::size_t>(vector.size()) == 200);
}

TEST_CASE("A step neither allocates nor frees") {
  const HilSession session = test::parsed(test::short_session());
  VirtualOmega7 device(session.plant, session.operator_script());
  device.prepare(session.preparation);
  device.enable_forces();
  ElementContact model(slow_liver(), session.servo.period_s);
  ServoSettings settings{session.servo};
  ServoStep step(device, model, settings);
  ServoRecord row;
  StopCause cause = StopCause::none;
  const testing::HeapWatch heap;
  while (cause == StopCause::none) {
    cause = step.cycle(0, row);
    device.advance(settings.period_s);
  }
  const long calls = heap.calls();
  CHECK(cause == StopCause::finished);
  CHECK(calls == 0);
}

TEST_CASE("A ramp and hold renders Eq. 11's ramp in closed form") {
  const TpmParameters p = slow_liver();
  Puppet device;
  ElementContact model(p, 1e-3);
  ServoStep step(device, model, plain());
  const double speed = 4e-3, depth = 8e-3, tau = p.relaxation_time_s(), tr = depth / speed;
  const double a = p.E2_Pa / (p.E1_Pa + p.E2_Pa);
  ServoRecord row;
  for (int i = 0; i < 5000; ++i) {
    const double t = 1e-3 * i, e = std::min(speed * t, depth);
    device.at.z() = e;
    REQUIRE(step.cycle(0, row) == StopCause::none);
    const auto ramp = [&](double s) { return a * speed * (s + tau * std::expm1(-s / tau)); };
    const double e1 =
        t <= tr ? ramp(t) : a * depth + (ramp(tr) - a * depth) * std::exp(-(t - tr) / tau);
    const double force =
        (p.E2_Pa * (e - e1) + lambda1_Pa(p.Eprime_Pa, e, p.spacing_m) * e) * p.A0_m2 / p.l0_m;
    REQUIRE_THAT(-device.force.z(), WithinAbs(force, 1e-10));
  }
}

TEST_CASE("The surface lets go at zero force, recovers, and is met again where it is") {
  const TpmParameters p = slow_liver();
  ElementContact model(p, 1e-3);
  OneSidedContact contact(model, Eigen::Vector3d::UnitZ());
  for (int i = 1; i <= 2000; ++i) (void)contact.press(4e-3);  // two relaxation times
  OneSidedContact::Answer answer;
  for (int i = 1; i <= 40; ++i) {
    answer = contact.press(4e-3 - 1e-4 * i);
    REQUIRE(answer.force_N >= 0.0);
  }
  CHECK_FALSE(answer.touching);
  CHECK(answer.surface_m > 0.5e-3);  // its viscous state keeps it down
  // Free recovery: E2 (e - e1) + lambda1 e = 0, close to creep to zero with tau (E1 + E2) / E1.
  const double left = answer.surface_m;
  double elapsed = 0.0;
  while (answer.surface_m > 0.5 * left) {
    answer = contact.press(0.0);
    elapsed += 1e-3;
    REQUIRE(answer.force_N == 0.0);
  }
  CHECK_THAT(elapsed, WithinRel(2.0 * p.relaxation_time_s() * std::log(2.0), 0.01));
  const double met = answer.surface_m;
  answer = contact.press(met + 1e-4);
  CHECK(answer.touching);
  CHECK_THAT(answer.force_N, WithinRel(contact.stiffness_N_per_m() * 1e-4, 0.05));
}

/// 100 N/m that never pull, as a law without relaxing branches.
class ElasticSurface final : public test::LinearSpring {
 public:
  ElasticSurface() : LinearSpring(100.0, 1e-3) {}
  ContactAnswer step(const ToolPose& tool) noexcept override {
    return {Eigen::Vector3d(0.0, 0.0, -100.0 * std::max(tool.displacement_m.z(), 0.0))};
  }
};

TEST_CASE("A surface that never pulls does not follow the tool into the air") {
  ElasticSurface model;
  OneSidedContact contact(model, Eigen::Vector3d::UnitZ());
  CHECK(contact.press(1e-3).force_N == 0.1);
  CHECK_FALSE(contact.press(-1e-6).touching);
  const OneSidedContact::Answer away = contact.press(-2e-3);
  CHECK_FALSE(away.touching);
  CHECK_THAT(away.surface_m, WithinAbs(0.0, 2e-6));
  const OneSidedContact::Answer back = contact.press(1e-3);
  CHECK(back.touching);
  CHECK(back.force_N == 0.1);
}

TEST_CASE("One-sided contact is a contact model itself, whatever it wraps") {
  ElementContact inner(slow_liver(), 1e-3), same(slow_liver(), 1e-3);
  OneSidedContact wrapped(inner, Eigen::Vector3d::UnitZ());
  OneSidedContact pressed(same, Eigen::Vector3d::UnitZ());
  ContactModel& model = wrapped;
  CHECK(model.period_s() == inner.period_s());
  CHECK(model.instantaneous_stiffness() == inner.instantaneous_stiffness());
  for (const double depth_m : {1e-3, 3e-3, 2e-3, -1e-3, 0.5e-3, 2e-3}) {
    const Eigen::Vector3d aside(2e-3, -1e-3, depth_m);  // motion across does not reach the tissue
    const ContactAnswer answer = model.step(aside);
    CHECK(answer.force_N.z() == -pressed.press(depth_m).force_N);
    CHECK(answer.force_N.head(2).isZero(0.0));
    CHECK(answer.force_N.z() <= 0.0);  // it pushes and never pulls
  }
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX()));
  model.reset();
  pressed.reset();
  CHECK(model.step({Eigen::Vector3d(0.0, 0.0, 1e-3), turned}).force_N.z() ==
        -pressed.press(1e-3).force_N);
}

TEST_CASE("A tool that touches and lets go at random gains nothing from a soft tissue") {
  // What a tool gets back beyond what it gave is what a held force leaks, K dx^2 / 2 a period; with
  // the force taken as linear within a period nothing must be left over.
  ElementContact model(slow_liver(), 1e-3);
  OneSidedContact contact(model, Eigen::Vector3d::UnitZ());
  Random random(0);
  double at = 0.0, force = 0.0, work = 0.0, least = 0.0, target = 0.0;
  for (int i = 0; i < 1'000'000; ++i) {
    if (i % 50 == 0) target = -2e-3 + 10e-3 * random.uniform();
    const double next = at + 0.02 * (target - at);
    const double now = contact.press(next).force_N;
    work += 0.5 * (force + now) * (next - at);
    least = std::min(least, work);
    at = next;
    force = now;
  }
  CHECK(work > 0.0);
  CHECK(least > -1e-9);
}

TEST_CASE("Limits: force, rise, ramp-in: the model's tool slips, falls pass, each is counted") {
  Puppet device;
  ElementContact model(slow_liver(), 1e-3);
  ServoSettings settings = plain();
  settings.force_limit_N = 0.5;
  settings.slew_limit_N_per_s = 100.0;
  ServoStep step(device, model, settings);
  ServoRecord row;
  double before_N = 0.0;
  for (int i = 1; i <= 200; ++i) {  // in at 100 mm/s, 15 N/s at first: below the limit of rises
    device.at.z() = std::min(8e-3, 1e-4 * i);
    (void)step.cycle(0, row);
    REQUIRE(-device.force.z() <= 0.5 + 1e-12);
    REQUIRE(-device.force.z() - before_N <= 0.1 + 1e-12);
    // What is felt is what the model answers: its tool slips, its force is not cut.
    REQUIRE_THAT(-device.force.z(), WithinRel(row.model_force_N, 0.02));
    before_N = -device.force.z();
  }
  CHECK(before_N > 0.45);
  CHECK(step.counts().slipped == 0);
  CHECK(step.counts().force_limited > 20);
  // Withdrawn, the force falls at once and by its whole stiffness, from where the tool slipped to.
  device.at.z() = 7e-3;
  (void)step.cycle(0, row);
  CHECK_THAT(-device.force.z(), WithinAbs(before_N - 1e-3 * 151.0, 0.02));
  device.at.z() = 2e-3;
  (void)step.cycle(0, row);
  CHECK(device.force.z() == 0.0);
  CHECK(step.counts().slipped == 0);

  ElementContact jumped(slow_liver(), 1e-3);
  ServoStep jump(device, jumped, settings);
  device.at.z() = 8e-3;  // a jump: above 1 N
  for (int i = 1; i <= 10; ++i) {
    (void)jump.cycle(0, row);
    REQUIRE(-device.force.z() <= 0.1 * i + 1e-12);
  }
  CHECK(jump.counts().slipped > 0);
  settings = plain();
  settings.force_limit_N = 0.5;
  settings.ramp_in_s = 1.0;
  ElementContact other(slow_liver(), 1e-3);
  ServoStep ramped(device, other, settings);
  for (int i = 0; i <= 500; ++i) {
    device.at.z() = 2e-5 * i;
    (void)ramped.cycle(0, row);
    REQUIRE(-device.force.z() <= 0.5e-3 * i + 1e-12);
  }
  CHECK(ramped.counts().ramping_in > 100);
}

TEST_CASE("A force that is no number stops the session before it is sent") {
  class Broken final : public EmptySpace {
   public:
    ContactAnswer step(const ToolPose&) noexcept override {
      ContactAnswer answer;
      if (++steps_ > 10) answer.force_N.z() = std::numeric_limits<double>::quiet_NaN();
      return answer;
    }

   private:
    int steps_ = 0;
  };
  Puppet device;
  Broken model;
  ServoStep step(device, model, plain());
  ServoRecord row;
  StopCause cause = StopCause::none;
  for (int i = 0; i < 20 && cause == StopCause::none; ++i) cause = step.cycle(0, row);
  CHECK(cause == StopCause::force_not_finite);
  CHECK(device.force.allFinite());
  CHECK(device.stops == 1);
}

TEST_CASE("Missed periods: the model lives through them, time is not stretched") {
  Puppet device;
  ElementContact every(slow_liver(), 1e-3), some(slow_liver(), 1e-3);
  ServoSettings settings = plain();
  settings.most_late = 1000;
  ServoStep served(device, every, settings), late(device, some, settings);
  ServoRecord a, b;
  for (int i = 0; i <= 1000; ++i) {
    device.at.z() = 4e-6 * i;
    (void)served.cycle(0, a);
    if (i % 5 == 0) (void)late.cycle(i == 0 ? 0 : 4, b);
  }
  CHECK(a.cycle == b.cycle);
  CHECK_THAT(b.model_force_N, WithinRel(a.model_force_N, 1e-12));
  CHECK(late.counts().late == 200);
  CHECK(late.counts().missed == 800);
}

TEST_CASE("A storm of late cycles, or a gap too long, stops the session") {
  Puppet device;
  ElementContact model(slow_liver(), 1e-3);
  ServoSettings settings = plain();
  settings.most_late = 10;
  ServoStep step(device, model, settings);
  ServoRecord row;
  int cycles = 0;
  StopCause cause = StopCause::none;
  for (; cause == StopCause::none && cycles < 100; ++cycles) cause = step.cycle(1, row);
  CHECK(cause == StopCause::overrun_storm);
  CHECK(cycles == 11);
  ServoStep other(device, model, settings);
  CHECK(other.cycle(settings.most_missed + 1, row) == StopCause::overrun_storm);
}

TEST_CASE("The observer's deficit is the predicted leak of the held force") {
  // Random motion of a device without friction on a relaxing contact. The tissue itself, with its
  // force linear within a period, stores and dissipates; what the observer lacks of that is the
  // leak.
  const TpmParameters p = slow_liver();
  ElementContact model(p, 1e-3);
  Puppet device;
  ServoStep step(device, model, plain(2'000'000));
  Random random(7);
  double tissue_J = 0.0, before_m = 3e-3, before_N = 0.0, target = 3e-3;
  device.at.z() = before_m;
  ServoRecord row;
  (void)step.cycle(0, row);
  before_N = row.model_force_N;
  const TensionLaw tension{p.Eprime_Pa, p.spacing_m};
  double leak_J = 0.0;
  for (int i = 0; i < 1'000'000; ++i) {
    if (i % 10 == 0) target = 3e-3 + 1e-3 * random.uniform();
    device.at.z() = before_m + 0.1 * (target - before_m);
    (void)step.cycle(0, row);
    const double moved = device.at.z() - before_m;
    const double tangent =
        (p.E2_Pa + tension.slope(before_m + 0.5 * moved)) * p.modulus_to_stiffness_m();
    tissue_J += 0.5 * (before_N + row.model_force_N) * moved;
    leak_J += 0.5 * tangent * moved * moved;
    before_m = device.at.z();
    before_N = row.model_force_N;
  }
  const double deficit = tissue_J - row.observed_J;
  CHECK(row.observed_J < 0.0);
  CHECK_THAT(deficit, WithinRel(leak_J, 0.01));
  CHECK_THAT(row.leak_J, WithinRel(leak_J, 0.1));  // with the stiffness at rest
}

TEST_CASE("With friction above the boundary, observer and device never lose energy") {
  // Motion is straight between samples, which is the least that friction can take.
  const TpmParameters p = slow_liver();
  const double period = 1e-3;
  ElementContact model(p, period);
  const double boundary = 0.5 * period * 185.0;  // tangent stiffness at 8 mm, at once
  const auto least_J = [&](double friction) {
    model.reset();
    Puppet device;
    ServoStep step(device, model, plain(2'000'000));
    Random random(0);
    ServoRecord row;
    double at = 0.0, taken_J = 0.0, least = 0.0;
    for (int i = 0; i < 1'000'000; ++i) {
      const double next = 8e-3 * random.uniform();
      taken_J += friction * (next - at) * (next - at) / period;
      device.at.z() = at = next;
      (void)step.cycle(0, row);
      least = std::min(least, row.observed_J + taken_J);
    }
    return least;
  };
  CHECK(least_J(1.02 * boundary) >= -1e-12);
  CHECK(least_J(0.5 * boundary) < -1.0);
}

TEST_CASE("The passivity controller takes back what a delay gives away") {
  PlantSettings plant;
  plant.delay_periods = 25;
  plant.push = Eigen::Vector3d::UnitZ();
  struct Run {
    double least_J = 0.0;
    StopCause cause = StopCause::none;
  };
  const auto run = [&](double allowance_J, double damping) {
    VirtualOmega7 device(plant, OperatorScript({{OperatorPiece::Aim::place, 20.0, 5e-3, 5e-3}}));
    ElementContact model(slow_liver(), 1e-3);
    ServoSettings settings = plain(20'000);
    settings.most_damping_N_s_per_m = damping;
    settings.energy_allowance_J = allowance_J;
    settings.delay_periods = plant.delay_periods;
    DevicePreparation preparation;
    device.prepare(preparation);
    Run made;
    made.cause = run_in_virtual_time(device, model, settings, [&](const ServoRecord& row) {
                   made.least_J = std::min(made.least_J, row.observed_J);
                 }).cause;
    return made;
  };
  // It acts from a tenth of the allowance on.
  const Run without = run(1e-2, 0.0), with = run(1e-2, 5.0);
  INFO("work of the hand at least " << without.least_J << " J without, " << with.least_J
                                    << " J with damping");
  CHECK(without.least_J < -1e-3);
  CHECK(with.least_J > 0.8 * without.least_J);
  // Where the allowance is small, only the damping keeps the session alive.
  CHECK(run(2e-3, 0.0).cause == StopCause::energy);
  CHECK(run(2e-3, 5.0).cause == StopCause::finished);
}

TEST_CASE("A session in virtual time is the same to the bit each time") {
  const test::TempFolder folder;
  const HilSession session = test::parsed(test::short_session());
  SessionRunOptions options;
  options.recording = folder / "a";
  (void)run_session(session, {}, options);
  options.recording = folder / "b";
  (void)run_session(session, {}, options);
  CHECK(read_file(folder / "a") == read_file(folder / "b"));
}

TEST_CASE("A replayed session gives the forces of the recorded one") {
  const test::TempFolder folder;
  const HilSession session = test::parsed(test::short_session());
  SessionRunOptions options;
  options.recording = folder / "a";
  (void)run_session(session, {}, options);
  DeviceChoice replay;
  replay.kind = "replay";
  replay.replay = folder / "a";
  options.recording = folder / "b";
  const SessionRun run = run_session(session, replay, options);
  CHECK_FALSE(run.device.hardware);
  const HilRecording a = read_recording(folder / "a"), b = read_recording(folder / "b");
  REQUIRE(a.rows.size() == b.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    REQUIRE(a.commanded_N(a.rows[i]) == b.commanded_N(b.rows[i]));
  }
}

TEST_CASE("A sink that fails stops the session safely, with the cause") {
  PlantSettings plant;
  VirtualOmega7 device(plant, OperatorScript({{OperatorPiece::Aim::place, 1.0, 0.0, 0.0}}));
  device.prepare({});
  ElementContact model(slow_liver(), 1e-3);
  const ServoOutcome outcome =
      run_in_virtual_time(device, model, plain(), [](const ServoRecord& row) {
        if (row.cycle == 100) throw Error(ExitCode::environment, "disk", "full");
      });
  CHECK(outcome.cause == StopCause::exception);
  CHECK(outcome.detail == "disk: full");
  CHECK(device.status().forces_off == ForcesOff::software);
}

}  // namespace
}  // namespace tpm::haptics
