// tpm validate of presses by a hand: slow, late, with pauses, tremor, overshoot or a slip. The
// whole press is compared, or it is said which part is.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

constexpr double kAskedHold_s = 5.0, kHandEnd_s = 25.0, kDepth_m = 4e-3;

/// From 0 to 1 with no jerk at the ends (Flash and Hogan 1985).
double reach(double t, double begin_s, double length_s) {
  const double x = std::clamp((t - begin_s) / length_s, 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

struct HandMotion {
  const char* name;
  double (*part)(double t);  ///< of the depth that was asked for
};

/// What hands do that are asked to reach 4 mm at 5 s and to hold them to 25 s.
const HandMotion kWhole[] = {
    {"smooth", [](double t) { return reach(t, 1.0, 4.2); }},
    {"pauses at the surface",
     [](double t) { return 0.03 * reach(t, 1.0, 0.1) + 0.97 * reach(t, 1.25, 4.0); }},
    {"pauses half-way",
     [](double t) { return 0.5 * reach(t, 1.0, 0.8) + 0.5 * reach(t, 3.8, 0.8); }},
    {"trembles",
     [](double t) {
       return reach(t, 1.0, 4.0) * (1.0 + 0.01 * std::sin(2.0 * std::numbers::pi * 8.0 * t) +
                                    0.008 * std::sin(2.0 * std::numbers::pi * 0.7 * t));
     }},
    {"starts slowly", [](double t) { return 0.1 * reach(t, 1.0, 3.0) + 0.9 * reach(t, 3.5, 1.6); }},
    {"arrives late", [](double t) { return reach(t, 2.0, 4.6); }},
    {"overshoots", [](double t) { return reach(t, 1.0, 3.5) * 1.12 - 0.12 * reach(t, 4.6, 1.0); }},
    {"creeps towards its depth",
     [](double t) {
       return 0.95 * reach(t, 1.0, 4.0) + 0.05 * (1.0 - std::exp(-std::max(t - 3.0, 0.0) / 1.5));
     }},
};

/// The force of 60 + 45 exp(-t / 2 s) N/m and 0.1 mN of noise, every 20 ms.
PreparedRecording hand_press(double (*part)(double), double stiffer = 1.0) {
  Recording r;
  r.header.id = "press";
  for (int i = 0; i <= 1200; ++i) {
    const double t = 1.0 + 0.02 * i;
    r.time_s.push_back(t);
    r.drive.push_back(std::max(kDepth_m * part(t), 0.0));
  }
  Protocol motion = measured_history(Drive::displacement, r.time_s, r.drive);
  motion.set_equilibrium_at_start(true);
  const std::vector<double> values{60.0, 45.0, 2.0, 0.0, 0.0};
  const Response force =
      LawModel(test::study_law()).respond(motion, r.time_s, values, Want::values);
  Random random(7);
  for (const double f : force.value) r.response.push_back(stiffer * f + 1e-4 * random.normal());
  PreparedRecording press;
  press.name = "press";
  press.phases = find_phases(r);
  press.from_s = r.time_s.front();
  press.to_s = r.time_s.back();
  press.recording = std::move(r);
  return press;
}

const LawFile& hand_law() {
  static const LawFile law = [] {
    Random random(3);
    test::StudyNoise noise;
    noise.sigma_N = 2e-4;
    return test::study_calibration(1, noise, random);
  }();
  return law;
}

Validation compared(std::vector<PreparedRecording> recordings, bool asked = true) {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = hand_law();
  request.recordings = std::move(recordings);
  if (asked) request.presses.assign(request.recordings.size(), SessionMotion{{}, kAskedHold_s});
  request.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  request.requirement = parse_requirement("10%", "test");
  return validate(request);
}

}  // namespace

TEST_CASE("all of a hand's press is compared, however the hand moved", "[validate][hand]") {
  for (const HandMotion& hand : kWhole) {
    CAPTURE(hand.name);
    const PreparedRecording press = hand_press(hand.part);
    const double largest = *std::ranges::max_element(press.recording.response);
    const Validation v = compared({press});
    INFO(to_terminal_text(v));
    const RecordingComparison& r = v.recordings.front();
    CHECK(r.part.whole());
    CHECK_THAT(r.part.depth, WithinAbs(r.part.depth_of_all, 1e-4));
    CHECK(r.part.to_s == press.recording.time_s.back());
    CHECK(r.curve.samples > 1100);
    const QuantityComparison& peak = test::study_quantity(r, QuantityKind::peak);
    CHECK_THAT(peak.measured, WithinRel(largest, 0.06));
    CHECK_THAT(peak.simulated, WithinRel(peak.measured, 0.01));
    const QuantityComparison& end = test::study_quantity(r, QuantityKind::end_of_hold);
    CHECK_THAT(end.measured, WithinRel(60.0 * kDepth_m, 0.02));
    // What the tremor does to the force is no scatter of it.
    CHECK_THAT(r.scatter.sigma, WithinRel(1e-4, 0.25));
    CHECK(v.verdict == ModelVerdict::adequate);
    CHECK(compared({hand_press(hand.part, 1.25)}).verdict == ModelVerdict::not_adequate);
    CHECK_THAT(to_terminal_text(v), Contains("the whole press"));
    CHECK(to_json(v)["recordings"][0]["compared"]["whole"] == true);
  }
}

TEST_CASE("a hand that leaves is compared as long as it held, which is said", "[validate][hand]") {
  const PreparedRecording press =
      hand_press([](double t) { return reach(t, 1.0, 4.0) - 0.6 * reach(t, 19.0, 1.0); });
  const Validation v = compared({press});
  const RecordingComparison& r = v.recordings.front();
  CHECK_FALSE(r.part.whole());
  CHECK_THAT(r.part.to_s, WithinAbs(19.4, 0.2));
  CHECK_THAT(to_terminal_text(v), Contains("only a part") && Contains("of the 20 s"));
  CHECK(to_json(v)["recordings"][0]["compared"]["whole"] == false);
  CHECK(v.verdict == ModelVerdict::adequate);
}

TEST_CASE("a hand that was never there is refused", "[validate][hand]") {
  CHECK_THROWS_WITH(compared({hand_press([](double) { return 0.0; })}), Contains("never rises"));
}

TEST_CASE("presses of one session are named without its file, whatever that is called",
          "[validate][hand]") {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = hand_law();
  request.quantities = {{QuantityKind::peak}};
  for (const char* name : {"slow: 1", "slow: 2"}) {
    PreparedRecording press = hand_press(kWhole[0].part);
    press.name = fmt::format("Monday: a.tpmrec: {}", name);
    request.recordings.push_back(std::move(press));
    request.presses.push_back({{}, kAskedHold_s, "Monday: a.tpmrec", name});
  }
  const Validation v = validate(request);
  CHECK_THAT(to_terminal_text(v), Contains("with Monday: a.tpmrec: slow: 1, slow: 2,"));
  CHECK(to_json(v)["recordings"][1]["recording"] == "Monday: a.tpmrec: slow: 2");
}

TEST_CASE("several presses are compared as wholes, each", "[validate][hand]") {
  std::vector<PreparedRecording> presses;
  for (const HandMotion& hand : kWhole) {
    presses.push_back(hand_press(hand.part));
    presses.back().name = hand.name;
  }
  const Validation v = compared(std::move(presses));
  for (const RecordingComparison& r : v.recordings) {
    CAPTURE(r.name);
    CHECK(r.part.whole());
  }
  CHECK(v.verdict == ModelVerdict::adequate);
}

TEST_CASE("a recording by hand pauses on its way, and a machine's steps are steps",
          "[validate][hand]") {
  for (const HandMotion& hand : kWhole) {
    CAPTURE(hand.name);
    const std::string name = hand.name;
    const Validation v = compared({hand_press(hand.part)}, false);
    INFO(to_terminal_text(v));
    if (name == "pauses half-way" || name == "overshoots") {
      // 2.2 s between motions of 0.8 s are two steps, and to fall by 12 % is to unload.
      CHECK_FALSE(v.recordings.front().part.whole());
      CHECK_THAT(to_terminal_text(v), Contains("only a part"));
      continue;
    }
    CHECK(v.recordings.front().part.whole());
    CHECK(v.recordings.front().part.depth > 0.9 * kDepth_m);
    CHECK(v.recordings.front().curve.samples > 1100);
  }
}

}  // namespace tpm::fit
