// What tpm hil identify says of handles, devices and runs that it cannot identify.
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "hil_scenes.hpp"
#include "identified_handle.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/rendering_check.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

/// The simulated device, which fails after so many positions in the way of a test.
class FailingHandle final : public VirtualOmega7 {
 public:
  FailingHandle(const HilSession& session, int after, ForcesOff how = ForcesOff::unplugged,
                std::vector<DeviceFinding> findings = {})
      : VirtualOmega7(session.plant, session.operator_script()),
        left_(after),
        how_(how),
        findings_(std::move(findings)) {}
  const DeviceIdentity& open() override {
    if (left_ > 0) return VirtualOmega7::open();
    throw Error(ExitCode::environment, "inverse3", "the service is silent",
                "a service that answers each message");
  }
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    return --left_ > 0 ? VirtualOmega7::read(position_m) : DeviceAnswer::failed;
  }
  DeviceStatus status() noexcept override {
    DeviceStatus status = VirtualOmega7::status();
    if (left_ <= 0) status.forces_off = how_;
    return status;
  }
  std::vector<DeviceFinding> findings() const override { return findings_; }

 private:
  int left_;
  ForcesOff how_;
  std::vector<DeviceFinding> findings_;
};

/// Of a free handle, 4 ms late.
HilSession late_and_free() {
  HilSession like = test::parsed(test::short_session());
  like.plant.delay_periods = 4;
  like.plant.arm = {0.0, 0.0, 0.0, 0.0};
  return like;
}

/// An identification of 8 s on devices that end after so many positions; the last opens no more.
IdentifyRun identified_until(const std::vector<int>& ends, ForcesOff how = ForcesOff::unplugged) {
  const HilSession like = late_and_free();
  DeviceIdentifyOptions options;
  options.duration_s = 8.0;
  std::size_t begun = 0;
  return run_identification_on(
      [&] { return std::make_shared<FailingHandle>(like, ends.at(begun++), how); }, {}, like,
      options);
}

TEST_CASE("What was measured before a device that never answers again is kept, the rest named") {
  const IdentifyRun run = identified_until({7000, 0});
  CHECK(run.begun_again == 1);
  CHECK(run.counts);
  REQUIRE(run.found.delay_mean_s);
  CHECK_THAT(*run.found.delay_mean_s, WithinAbs(4e-3, 0.5e-3));
  CHECK(run.measured_s > 6.0);
  CHECK(run.measured_s < 7.0);
  REQUIRE(run.found.not_identified.size() == 1);
  CHECK_THAT(run.found.not_identified.front().text,
             StartsWith("everything after 6.") && Contains(" s of 8 s: unplugged") &&
                 Contains("does not open again: inverse3: the service is silent"));
  CHECK(run.found.stalls == 0);  // nothing stands for the part that was not begun
  const Json file = device_file_json(run, "");
  CHECK_THAT(file.at("measurement").at("measured_s").get<double>(),
             WithinRel(run.measured_s, 1e-3));
  CHECK_THAT(file.at("measurement").at("ended_by").get<std::string>(),
             Contains("does not open again"));
  (void)parse_device_file(file, "device.json");
  // A whole measurement in two parts lacks nothing, also if little is left for the second.
  for (const int first : {5000, 7900}) {
    const IdentifyRun whole = identified_until({first, 100000});
    CHECK(whole.ended_by.empty());
    CHECK(whole.found.not_identified.empty());
    CHECK(whole.measured_s >= 7.99);
    CHECK(whole.measured_s < 9.01);
  }
  // Where nothing was measured yet there is nothing to keep.
  CHECK_THROWS_WITH(identified_until({0}), Contains("the service is silent"));
}

TEST_CASE(
    "A measurement that ends before 5 s has identified nothing, and the gate counts nothing") {
  for (const ForcesOff how : {ForcesOff::unplugged, ForcesOff::button, ForcesOff::velocity}) {
    const IdentifyRun run = identified_until({3000, 0}, how);
    CAPTURE(run.ended_by);
    CHECK_FALSE(run.counts);
    CHECK_FALSE(run.ended_by.empty());
    CHECK_FALSE(run.found.delay_mean_s);
    CHECK_FALSE(run.found.encoder_step_m);
    REQUIRE(run.found.not_identified.size() == 1);
    CHECK_THAT(run.found.not_identified.front().text,
               StartsWith("everything: ended after 2.") && Contains("of 8 s, and 5 s are needed"));
    const DeviceFile file = parse_device_file(device_file_json(run, ""), "device.json");
    CHECK_FALSE(file.measured_delay_s);
    CHECK_FALSE(file.measured_friction_N_s_per_m);
    CHECK_FALSE(file.measured);
  }
}

/// A free handle whose motors give no more than a limit, or that a hand with a grip that yields
/// holds. @param hand_kg 0: nobody
std::vector<IdentificationSample> odd_handle(double most_N, double hand_kg, bool says_so) {
  constexpr int kParts = 20, kLate = 40;  // 2 ms
  constexpr double kPart_s = 1e-3 / kParts, kMass_kg = 0.3, kViscous = 0.3;
  constexpr double kGrip_N_per_m = 100.0, kGrip_N_s_per_m = 3.0;
  IdentifyingForce force(1e-3, 1);
  std::vector<IdentificationSample> samples;
  std::deque<double> coming(kLate, 0.0);
  double x = 0.0, v = 0.0, hand_x = 0.0, hand_v = 0.0, sent_N = 0.0;
  for (int i = 0; i < 20000 * kParts; ++i) {
    if (i % kParts == 0) {
      IdentificationSample sample;
      sample.at_m = 1e-5 * std::round(x * 1e5);
      sample.force_N = force.next_N(sample.at_m);
      sent_N = std::clamp(sample.force_N, -most_N, most_N);
      sample.saturated = says_so && sent_N != sample.force_N;
      samples.push_back(sample);
    }
    coming.push_back(sent_N);
    const double acts_N = coming.front();
    coming.pop_front();
    const double grip_N =
        hand_kg > 0.0 ? kGrip_N_per_m * (hand_x - x) + kGrip_N_s_per_m * (hand_v - v) : 0.0;
    v += kPart_s * (acts_N - kViscous * v + grip_N) / kMass_kg;
    x += kPart_s * v;
    if (hand_kg > 0.0) {
      hand_v += kPart_s * (-grip_N - 6.5 * hand_v - 135.0 * hand_x) / hand_kg;
      hand_x += kPart_s * hand_v;
    }
  }
  return samples;
}

TEST_CASE("Motors at their limit are said, and void what follows from their forces") {
  const DeviceIdentification found = identify_device(odd_handle(0.05, 0.0, true), 1e-3);
  CHECK_FALSE(found.mass_kg);
  CHECK_FALSE(found.viscous_lower_95_N_s_per_m);
  CHECK_FALSE(found.delay_mean_s);
  REQUIRE_FALSE(found.not_identified.empty());
  CHECK(found.not_identified.back().code == "saturated");
  // Whoever does not say so is found out by the motion.
  CHECK_FALSE(identify_device(odd_handle(0.05, 0.0, false), 1e-3).mass_kg);
  CHECK(identify_device(odd_handle(1.0, 0.0, true), 1e-3).mass_certain);
  HilSession weak = late_and_free();
  weak.plant.motor_limit_N = 0.05;
  const IdentifyRun run = run_identification({}, weak, {});
  CHECK_FALSE(run.found.mass_kg);
  CHECK(run.found.not_identified.back().code == "saturated");
}

TEST_CASE("A hand whose grip yields gives no delay, and an interval that holds the device's mass") {
  const DeviceIdentification found = identify_device(odd_handle(1.0, 0.55, true), 1e-3);
  CHECK_FALSE(found.delay_mean_s);
  CHECK_FALSE(found.coulomb_low_N);
  CHECK(found.not_identified.front().code == "held");
  if (found.mass_kg) {
    CHECK(*found.mass_low_kg <= 0.3);
    CHECK(*found.mass_high_kg >= 0.3);
  }
}

TEST_CASE("Coulomb friction that the edges hardly overcome leaves nothing identified") {
  for (const double coulomb_N : {0.12, 0.15, 0.17}) {
    test::Handle rubs;
    rubs.coulomb_N = coulomb_N;
    rubs.viscous_N_s_per_m = 0.3;
    rubs.force_late_s = 2e-3;
    const DeviceIdentification found = identify_device(test::moved(rubs), rubs.period_s);
    CAPTURE(coulomb_N);
    CHECK_FALSE(found.delay_mean_s);
    CHECK_FALSE(found.mass_kg);
    CHECK_FALSE(found.coulomb_low_N);
    REQUIRE_FALSE(found.not_identified.empty());
    CHECK_THAT(found.not_identified.back().text, Contains("riction"));
  }
}

TEST_CASE("The simulated operator lets go, and a stated arm that reacts is found out") {
  HilSession like = test::parsed(test::short_session());
  like.plant.delay_periods = 3;
  const IdentifyRun let_go = run_identification({}, like, {});
  REQUIRE(let_go.found.delay_mean_s);
  CHECK_THAT(*let_go.found.delay_mean_s, WithinAbs(3e-3, 0.5e-3));
  like.plant.arm.mass_kg = 0.5;
  const IdentifyRun held = run_identification({}, like, {});
  CHECK_FALSE(held.found.delay_mean_s);
  // Hardware with such a file counts as not measured: 20 ms late, free of friction.
  Json written = device_file_json(held, "");
  written["device"] = "omega7";
  const DeviceLimits limits = limits_from(parse_device_file(written, "device.json"));
  const LoopModel loop = make_loop_model(like);
  const RenderingCheck check = check_rendering(like, *loop.model, loop, limits);
  CHECK_FALSE(check.delay_measured);
  CHECK(check.delay_s >= 0.020);
  CHECK(check.friction_N_s_per_m == 0.0);
}

TEST_CASE("Findings of a device are in its file, and void what follows from its forces") {
  const HilSession like = late_and_free();
  DeviceIdentifyOptions options;
  options.duration_s = 8.0;
  const IdentifyRun run = run_identification_on(
      [&] {
        return std::make_shared<FailingHandle>(
            like, 100000, ForcesOff::unplugged,
            std::vector<DeviceFinding>{
                {"force_differs", "the service reported 0.1 N where 0.2 N was commanded"}});
      },
      {}, like, options);
  REQUIRE(run.findings.size() == 1);
  CHECK(run.found.delay_mean_s);
  CHECK_FALSE(run.found.mass_kg);
  CHECK_FALSE(run.found.viscous_lower_95_N_s_per_m);
  CHECK_THAT(run.found.not_identified.back().text,
             StartsWith("friction, mass: the device noticed: the service reported 0.1 N"));
  const Json file = device_file_json(run, "");
  CHECK(file.at("measurement").at("device_findings") == remarks_json(run.findings));
  (void)parse_device_file(file, "device.json");
}

TEST_CASE("A finding is told once, although the measurement begins again on a new connection") {
  const HilSession like = late_and_free();
  std::vector<std::string> told;
  DeviceIdentifyOptions options;
  options.duration_s = 8.0;
  options.noticed = [&told](const DeviceFinding& finding) { told.push_back(finding.code); };
  int left = 5000;
  const IdentifyRun run = run_identification_on(
      [&] {
        const std::vector<DeviceFinding> findings{{"in_use", "another client may use the device"}};
        return std::make_shared<FailingHandle>(like, std::exchange(left, 100000),
                                               ForcesOff::unplugged, findings);
      },
      {}, like, options);
  CHECK(run.begun_again == 1);
  CHECK(told == std::vector<std::string>{"in_use"});
}

TEST_CASE("A start that cannot be is refused at once, with what would work") {
  const test::TempFolder folder;
  const auto refused = [&](const char* key, double value) {
    DeviceChoice choice;
    choice.kind = "omega7";
    choice.file = folder / "device.json";
    write_file(choice.file, to_text(Json{{"device", "omega7"}, {"limits", {{key, value}}}}));
    const HilSession like = late_and_free();
    return test::refusal_of([&] {
      (void)run_identification_on([&] { return std::make_shared<FailingHandle>(like, 100000); },
                                  choice, like, {});
    });
  };
  CHECK_THAT(refused("reach_m", 0.02),
             Contains("key /limits/reach_m: 0.02 m; expected at least 0.025 m"));
  CHECK_THAT(refused("force_N", 0.1),
             Contains("key /limits/force_N: 0.1 N; expected at least 0.2 N"));
  HilSession far = late_and_free();
  far.plant.origin_m.setZero();
  far.plant.arm_set_point_m = 0.09;
  CHECK_THAT(test::refusal_of([&] { (void)run_identification({}, far, {}); }),
             Contains("start of the simulated handle: 90 mm from the middle of the workspace; "
                      "expected at most 55 mm"));
  HilSession weak = late_and_free();
  weak.servo.force_limit_N = 0.1;
  CHECK_THAT(test::refusal_of([&] { (void)run_identification({}, weak, {}); }),
             Contains("key /limits/force: 0.1 N; expected at least 0.2 N"));
}

TEST_CASE("A wait that is given up says what was missing, and the watcher sees it from the start") {
  HilSession far = late_and_free();
  far.plant.origin_m = {0.0, 0.0, 0.07};
  far.plant.arm_set_point_m = 0.0;
  DeviceIdentifyOptions options;
  std::uint32_t first = 0;
  options.watcher = [&](const ServoRecord& row) {
    if (first == 0) first = row.flags;
  };
  const IdentifyRun run = run_identification_on(
      [&] { return std::make_shared<FailingHandle>(far, 1000000); }, {}, far, options);
  CHECK((first & kOutOfReach) != 0);
  CHECK_FALSE(run.counts);
  CHECK(run.ended_by ==
        "the handle was 70 mm from the middle of the workspace for 60 s; at most 55 mm");
  CHECK_THAT(
      test::refusal_of(
          [&] { (void)check_delay(std::make_shared<FailingHandle>(far, 1000000), {}, far, {}); }),
      Contains("ended early: the handle was 70 mm from") && Contains("expected a handle at rest"));
}

TEST_CASE(
    "The check before a session tells a stall and an interruption from a handle out of place") {
  const HilSession like = late_and_free();
  const auto said = [&](ForcesOff how, bool interrupted) {
    DeviceIdentifyOptions options;
    if (interrupted) options.interrupted = [] { return true; };
    return test::refusal_of([&] {
      (void)check_delay(std::make_shared<FailingHandle>(like, 600, how), {}, like, options);
    });
  };
  CHECK_THAT(said(ForcesOff::watchdog, false),
             Contains("ended early: watchdog of the device") && Contains("do not stall"));
  CHECK_THAT(said(ForcesOff::watchdog, true), Contains("was interrupted"));
  CHECK_THAT(said(ForcesOff::watchdog, true), !Contains("at rest"));
}

}  // namespace
}  // namespace tpm::haptics
