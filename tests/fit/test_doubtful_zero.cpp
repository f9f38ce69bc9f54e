// Recordings that do not show their rest, their load or their motion from the beginning.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "placed_recordings.hpp"
#include "support/fitted_parameter.hpp"
#include "support/one_law.hpp"
#include "support/remarks.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/verdict.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::StartsWith;

namespace {

FitResult fitted_with(const char* law, const PreparedRecording& recording) {
  const Selection s = test::select_one(law, recording, test::setup_of(4, true));
  return s.candidates[s.recommended].fit;
}

/// 10 s at rest: times, and readings of unit noise.
std::pair<std::vector<double>, std::vector<double>> rest_of(Random& random) {
  std::pair<std::vector<double>, std::vector<double>> rest;
  for (int i = 0; i < 100; ++i) {
    rest.first.push_back(0.1 * i - 10.0);
    rest.second.push_back(random.normal());
  }
  return rest;
}

bool is_identified(const ParameterResult& p) {
  return p.verdict == Verdict::identified && !p.not_separable && p.conditional_on.empty();
}

/// A linear solid of 60 and 45 N/m, 2 s, whose readings are changed by `shown`.
template <typename Shown>
PreparedRecording shown_by(const test::PlacedTest& placed, Shown shown) {
  Random random(11);
  Recording r = test::measured(placed, test::placed(placed), random);
  for (std::size_t i = 0; i < r.response.size(); ++i) r.response[i] = shown(i, r.response[i]);
  return prepare_recording("made.csv", std::move(r));
}

}  // namespace

TEST_CASE("a rest that the amplifier cuts off tells neither zero nor contact", "[zero]") {
  test::PlacedTest placed;
  placed.zero_N = -0.02;
  const FitResult cut = fitted_with(
      "linear-1", shown_by(placed, [](std::size_t, double f) { return std::max(f, 0.0); }));
  for (const char* name : {"k_inf", "k1", "contact", "offset"}) {
    const ParameterResult& p = find(cut, name);
    INFO(p.summary);
    CHECK_FALSE(is_identified(p));
  }
  CHECK_THAT(verdict_text(find(cut, "k1")), StartsWith("not identified: the zero of the force"));
  REQUIRE(test::has_remark(cut.remarks, "rest_cut_off"));
  // The same with the noise of the rest in it.
  const FitResult whole =
      fitted_with("linear-1", shown_by(placed, [](std::size_t, double f) { return f; }));
  CHECK(is_identified(find(whole, "k1")));
  CHECK_FALSE(test::has_remark(whole.remarks, "rest_cut_off"));
}

TEST_CASE("readings at rest that are equal for another reason leave the zero known", "[zero]") {
  test::PlacedTest placed;
  placed.noise_N = 0.0;
  Random random(5);
  // A noise of 1 % of the reading, and steps of 2 mN.
  const FitResult of_reading =
      fitted_with("linear-1", shown_by(placed, [&random](std::size_t, double f) {
                    return f * (1.0 + 0.01 * random.normal());
                  }));
  CHECK_FALSE(test::has_remark(of_reading.remarks, "rest_cut_off"));
  const FitResult coarse =
      fitted_with("linear-1", shown_by(placed, [&random](std::size_t, double f) {
                    return 2e-3 * std::round((f + 3e-4 * random.normal()) / 2e-3);
                  }));
  CHECK_FALSE(test::has_remark(coarse.remarks, "rest_cut_off"));
}

TEST_CASE("readings without a sign leave the coefficients identified, but not the zero", "[zero]") {
  test::PlacedTest placed;
  placed.rest_s = 20.0;
  const FitResult fit =
      fitted_with("linear-1", shown_by(placed, [](std::size_t, double f) { return std::abs(f); }));
  CHECK(find(fit, "offset").not_separable);
  CHECK(find(fit, "contact").not_separable);
  CHECK_FALSE(find(fit, "k1").not_separable);
  REQUIRE(test::has_remark(fit.remarks, "rest_cut_off"));
  test::PlacedTest above = placed;  // by three times its noise: a zero of its own
  above.zero_N = 6e-4;
  const FitResult healthy =
      fitted_with("linear-1", shown_by(above, [](std::size_t, double f) { return f; }));
  CHECK_FALSE(test::has_remark(healthy.remarks, "rest_cut_off"));
}

TEST_CASE("a power from a contact that nothing tells holds neither stiffness nor zero", "[zero]") {
  // A ball is 5 mm deep, and relaxes, where the recording begins, and goes on to 7 mm.
  test::PlacedTest placed;
  placed.law = "hertz-1";
  placed.reference_m = 3e-3;
  placed.rest_s = 0.0;
  Recording r;
  const Protocol path(Drive::displacement,
                      {{0.0, 0.0}, {2.0, 5e-3}, {32.0, 5e-3}, {33.0, 7e-3}, {63.0, 7e-3}});
  std::vector<double> time_s;
  for (int i = 0; i < 1260; ++i) time_s.push_back(0.05 * i);
  const Eigen::VectorXd force =
      LawModel(test::spec_of(placed))
          .respond(path, time_s, std::vector{60.0, 45.0, 2.0, 0.0, 0.0}, Want::values)
          .value;
  Random random(7);
  r.header.id = "made";
  for (std::size_t i = 61; i < time_s.size(); ++i) {
    r.time_s.push_back(time_s[i] - time_s[61]);
    r.drive.push_back(value_at(path, time_s[i]));
    r.response.push_back(force[static_cast<Eigen::Index>(i)] + 2e-4 * random.normal());
  }
  const FitResult fit = fitted_with("power-1", prepare_recording("made.csv", std::move(r)));
  const double truth_k1 = 45.0 * std::sqrt(2.0 / 3.0);  // at 2 mm
  for (const auto& [name, truth] :
       {std::pair("exponent", 1.5), std::pair("k1", truth_k1), std::pair("offset", 0.0)}) {
    const ParameterResult& p = find(fit, name);
    INFO(p.summary);
    const bool holds = p.lower && p.upper && *p.lower <= truth && truth <= *p.upper;
    CHECK((holds || p.verdict != Verdict::identified || p.not_separable));
  }
}

TEST_CASE("the fit ends before a gap in which the drive moved", "[zero][rise]") {
  test::PlacedTest placed;
  const auto without = [&placed](const std::vector<Knot>& knots, double begin_s, double end_s) {
    Recording r;
    r.header.id = "made";
    const Protocol path(Drive::displacement, knots);
    std::vector<double> time_s;
    for (int i = 0; i < 1200; ++i) time_s.push_back(0.05 * i);
    const Eigen::VectorXd force =
        LawModel(test::spec_of(placed))
            .respond(path, time_s, std::vector{60.0, 45.0, 2.0, 0.0, 0.0}, Want::values)
            .value;
    Random random(3);
    for (std::size_t i = 0; i < time_s.size(); ++i) {
      const double noise = 2e-4 * random.normal();
      if (time_s[i] > begin_s && time_s[i] < end_s) continue;
      r.time_s.push_back(time_s[i]);
      r.drive.push_back(value_at(path, time_s[i]));
      r.response.push_back(force[static_cast<Eigen::Index>(i)] + noise);
    }
    return prepare_recording("made.csv", std::move(r));
  };
  const std::vector<Knot> two{{0.0, 0.0},   {2.0, 0.0},   {3.0, 2e-3},
                              {25.0, 2e-3}, {27.0, 4e-3}, {60.0, 4e-3}};
  const PreparedRecording unseen = without(two, 20.01, 28.99);
  CHECK(unseen.to_s == Approx(20.0));
  REQUIRE(test::has_remark(unseen.remarks, "motion_in_gap"));
  const FitResult fit = fitted_with("linear-1", unseen);
  CHECK(find(fit, "k1").lower.value() < 45.0);
  CHECK(find(fit, "k1").upper.value() > 45.0);
  // Nothing moves in the first of these gaps, and in the second the ramp goes on as before.
  CHECK(without(two, 10.01, 18.99).to_s > 50.0);
  const std::vector<Knot> slow{{0.0, 0.0}, {2.0, 0.0}, {22.0, 4e-3}, {60.0, 4e-3}};
  CHECK(without(slow, 10.01, 12.99).to_s > 50.0);
  // Nor is a step between two samples a gap.
  const std::vector<Knot> step{{0.0, 0.0},    {2.0, 0.0},    {2.02, 2e-3},
                               {25.01, 2e-3}, {25.03, 4e-3}, {60.0, 4e-3}};
  CHECK(without(step, 0.0, 0.0).to_s > 50.0);
}

TEST_CASE("a recording that begins under its load is not called counted the other way", "[zero]") {
  Recording r;
  r.header.id = "made";
  Random random(2);
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    const double depth = std::max(4e-3 - 1e-3 * std::max(t - 5.0, 0.0), -0.5e-3);
    r.time_s.push_back(t);
    r.drive.push_back(depth);
    r.response.push_back(60.0 * std::max(depth, 0.0) + 2e-4 * random.normal());
  }
  const auto said_of = [](const Recording& recording) -> std::string {
    try {
      const PreparedRecording one = prepare_recording("made.csv", recording);
      static_cast<void>(reference_drive(std::span(&one, 1)));
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  };
  CHECK_THAT(said_of(r), Contains("it begins under a load") &&
                             Contains("the recording from before the load on"));
  // Counted the other way it begins without one.
  for (std::size_t i = 0; i < r.drive.size(); ++i) {
    r.response[i] -= 0.24;
  }
  CHECK_THAT(said_of(r), Contains("the drive falls, and so does the response"));
}

TEST_CASE("a ramp that is left out nearly whole is named beside a transient", "[zero][adequacy]") {
  Random random(9);
  const auto [rest_time, rest] = rest_of(random);
  std::vector<double> time, reading, residual;
  for (int i = 0; i < 600; ++i) {
    time.push_back(0.1 * i);
    reading.push_back(1000.0 * std::min(i / 61.0, 1.0) + random.normal());
    residual.push_back(random.normal() + (i < 58 ? 8.0 * std::sin(0.1 * i) : 0.0));
  }
  // The ramp ends with sample 61; what is tried is to leave out 60.
  const AdequacyData data{rest_time, rest, time, reading, residual, 4, 0.0, 6.1};
  const Adequacy a = judge_adequacy(data);
  REQUIRE(a.described == Described::not_described);
  REQUIRE_FALSE(a.causes.empty());
  CHECK(a.causes.front().code == "ramp_or_transient");
}

TEST_CASE("a response that ends while the drive goes on is no fluid's", "[zero][adequacy]") {
  Random random(9);
  const auto [rest_time, rest] = rest_of(random);
  std::vector<double> time, reading, residual;
  for (int i = 0; i < 400; ++i) {
    const bool broken = i >= 150;
    const double law = 10.0 * std::min(i, 200);
    time.push_back(0.1 * i);
    reading.push_back((broken ? 0.0 : law) + random.normal());
    residual.push_back(reading.back() - law);
  }
  AdequacyData data{rest_time, rest, time, reading, residual, 4, 0.0, 20.0};
  const auto cause = [&data] { return judge_adequacy(data).causes.front().text; };
  CHECK_THAT(cause(), Contains("a specimen that broke or slipped out"));
  data.ramp_to_s = 14.0;  // the drive stood still
  CHECK_THAT(cause(), Contains("a fluid whose response ends with the motion"));
}

TEST_CASE("a jump of the readings while the drive rests is named", "[zero][adequacy]") {
  Random random(9);
  const auto [rest_time, rest] = rest_of(random);
  std::vector<double> time, reading, residual;
  for (int i = 0; i < 400; ++i) {
    const double jump = i < 150 ? 0.0 : -250.0;
    time.push_back(0.1 * i);
    residual.push_back(100.0 + jump + random.normal());
    reading.push_back(1000.0 * std::min(i / 30.0, 1.0) + residual.back());
  }
  AdequacyData data{rest_time, rest, time, reading, residual, 4, 0.0, 3.0};
  const Adequacy tared = judge_adequacy(data);
  REQUIRE(tared.causes.size() == 1);
  CHECK(tared.causes.front().code == "jump");
  CHECK_THAT(tared.causes.front().text, Contains("at 15 s readings change by"));
  // A single reading that is off, a change that takes a while, and one within the ramp are none.
  const auto is_jump = [&data] {
    const auto causes = judge_adequacy(data).causes;
    return std::ranges::any_of(causes, [](const Remark& r) { return r.code == "jump"; });
  };
  data.ramp_to_s = 20.0;
  CHECK_FALSE(is_jump());
  data.ramp_to_s = 3.0;
  std::vector<double> spike = residual, slow = residual;
  for (int i = 0; i < 400; ++i) {
    const double off = residual[i] - (i < 150 ? 0.0 : -250.0);
    spike[i] = off + (i == 150 ? 250.0 : 0.0);
    slow[i] = off - 250.0 * std::clamp((i - 150) / 10.0, 0.0, 1.0);
  }
  data.residual = spike;
  CHECK_FALSE(is_jump());
  data.residual = slow;
  CHECK_FALSE(is_jump());
}

TEST_CASE("A law that misses the few samples of the loading does not tell contact", "[zero]") {
  // A poroelastic half-space (Hu et al. 2010), pressed to 1.5 mm within three samples.
  Random random(18);
  Recording r;
  r.header.id = "made";
  for (int i = 0; i <= 1500; ++i) {
    const double t = 0.2 * i, x = std::max(t - 5.25, 0.0) / 60.0;
    const double load = std::clamp((t - 5.0) / 0.5, 0.0, 1.0);
    const double fluid = 0.491 * std::exp(-0.908 * std::sqrt(x)) + 0.509 * std::exp(-1.679 * x);
    r.time_s.push_back(t);
    r.drive.push_back(1.5e-3 * load);
    r.response.push_back(load * (0.30 + 0.22 * fluid) + 2e-4 * random.normal());
  }
  const FitResult fit = fitted_with("linear-3", prepare_recording("made.csv", std::move(r)));
  REQUIRE(test::has_remark(fit.remarks, "loading_not_described"));
  for (const char* name : {"contact", "k_inf", "k1"}) CHECK(find(fit, name).unconfirmed);
  CHECK_FALSE(find(fit, "tau1").unconfirmed);
  test::PlacedTest placed;
  placed.rest_s = 20.0;
  const FitResult healthy =
      fitted_with("linear-1", shown_by(placed, [](std::size_t, double f) { return f; }));
  CHECK_FALSE(test::has_remark(healthy.remarks, "loading_not_described"));
}
