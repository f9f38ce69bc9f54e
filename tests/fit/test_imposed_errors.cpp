// Noise of the drive, which the law answers as if it were motion; and a contact that a kernel which
// only happens to fit leads back to.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "fitted_parameter.hpp"
#include "one_law.hpp"
#include "placed_recordings.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::data;
using namespace tpm::fit;
using Catch::Contains;
using Catch::StartsWith;

namespace {

Selection selected_of(const PreparedRecording& recording, const std::string& law, bool profiles) {
  return test::select_one(law, recording, test::setup_of(4, profiles));
}

/// Kelvin-Voigt, 400 N/m and 6 N s/m, moved by a hand and read at 1 kHz; the depth scatters by 1
/// um.
Recording moved_by_hand(std::uint64_t seed) {
  Random random(seed);
  Recording r;
  r.header.id = "made";
  const double turn = 2.0 * std::acos(-1.0);
  std::vector<double> depth_m;
  for (int i = 0; i < 1800; ++i) {
    const double t = 1e-3 * i;
    const double grown = std::max(t - 0.5, 0.0) / 7.5;
    r.time_s.push_back(t);
    depth_m.push_back(4e-3 * grown *
                      (1.5 + std::sin(0.8 * turn * t) + 0.4 * std::sin(2.3 * turn * t + 1.0)));
  }
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, depth_m.size() - 1);
    const double speed = (depth_m[b] - depth_m[a]) / (r.time_s[b] - r.time_s[a]);
    r.drive.push_back(depth_m[i] + 1e-6 * random.normal());
    r.response.push_back(400.0 * depth_m[i] + 6.0 * speed + 0.01 * random.normal());
  }
  return r;
}

}  // namespace

TEST_CASE("noise of the drive does not move the plateau out of its interval", "[imposed_noise]") {
  // Of the seeds 1 to 25 those whose interval holds 400 N/m only as it allows for the bias. Without
  // that it ended at 399.3, 398.2, 398.1 and 398.2 N/m. (Seeds 9 and 25 stay outside; of 1 to 40 no
  // other.)
  for (const std::uint64_t seed : {4, 5, 7, 16}) {
    const PreparedRecording recording = prepare_recording("made.csv", moved_by_hand(seed));
    const Selection s = selected_of(recording, "linear-1", true);
    const ParameterResult& p = find(s.candidates[s.recommended].fit, "k_inf");
    INFO("seed " << seed);
    CHECK(p.lower.value() < 400.0);
    CHECK(p.upper.value() > 400.0);
  }
}

TEST_CASE("an interval that allows for noise of the drive is no wider than its bias",
          "[imposed_noise]") {
  // Without that noise tau1 would lie at its bound, where a dashpot answers noise far more steeply:
  // the interval of k_inf had no lower end.
  const PreparedRecording recording = prepare_recording("made.csv", moved_by_hand(1));
  const Selection s = selected_of(recording, "linear-1", true);
  const ParameterResult& p = find(s.candidates[s.recommended].fit, "k_inf");
  REQUIRE((p.lower && p.upper));
  CHECK(*p.lower < 400.0);
  CHECK(*p.upper > 400.0);
  CHECK(*p.upper - *p.lower < 70.0);
}

TEST_CASE("a depth recorded in coarse steps leaves the law described, its intervals near and right",
          "[rounded_drive][adequacy]") {
  constexpr double kStep_m = 1e-4;
  int closed = 0, missing = 0;
  for (const double step_s : {0.02}) {
    for (const double depth_m : {3.7e-3, 4e-3}) {
      test::PlacedTest placed;
      placed.step_s = step_s;
      placed.depth_m = depth_m;
      Random random(11);
      Recording r = test::measured(placed, test::placed(placed), random);
      for (double& depth : r.drive) depth = std::round(depth / kStep_m) * kStep_m;
      const PreparedRecording recording = prepare_recording("made.csv", std::move(r));
      const Selection s = selected_of(recording, "linear-1", true);
      const FitResult& fit = s.candidates[s.recommended].fit;
      CAPTURE(step_s, depth_m);
      CHECK(fit.adequacy.value().is_adequate());
      // Their sawtooth alternates: it is no noise that lasts for the whole hold.
      CHECK((!fit.noise || fit.noise->phi < 0.9));
      for (const auto& [name, truth] : {std::pair("k1", 45.0), {"tau1", 2.0}}) {
        CAPTURE(name);
        const ParameterResult& p = find(fit, name);
        if (!p.lower || !p.upper) continue;
        ++closed;
        missing += truth < *p.lower || truth > *p.upper;
        CHECK(*p.upper - *p.lower < 0.1 * truth);
      }
    }
  }
  CHECK(closed == 4);
  CHECK(missing <= 1);  // of four intervals of 95 %
}

TEST_CASE("the plateau lies in its interval though the depth was recorded in coarse steps",
          "[rounded_drive]") {
  // The depth of the hold is off by up to 40 um of 3 mm, k_inf by 1.3 %.
  constexpr double kStep_m = 1e-4;
  int holds = 0;
  for (const double shift_m : {-4e-5, -2e-5, 2e-5, 4e-5}) {
    test::PlacedTest placed;
    placed.step_s = 0.01;
    placed.rest_s = 1.0;
    placed.ramp_s = 1.1;
    placed.hold_s = 10.0;
    placed.start_m = -2.6e-4;
    placed.depth_m = 3e-3 + shift_m;
    placed.noise_N = 9e-4;
    Random random(11);
    Recording r = test::measured(placed, test::placed(placed), random);
    for (double& depth : r.drive) depth = std::round(depth / kStep_m) * kStep_m;
    const PreparedRecording recording = prepare_recording("made.csv", std::move(r));
    const Selection s = selected_of(recording, "linear-1", true);
    const ParameterResult& p = find(s.candidates[s.recommended].fit, "k_inf");
    CAPTURE(shift_m);
    REQUIRE((p.lower && p.upper));
    holds += *p.lower < 60.0 && *p.upper > 60.0;
    CHECK(*p.upper - *p.lower < 0.06 * 60.0);
  }
  CHECK(holds == 4);
}

TEST_CASE("a contact that only a power with an exponent of no probe tells is not identified",
          "[doubtful_contact]") {
  // A ball of 3 mm on a layer of 2 mm stiffens more than a power does (Dimitriadis 2002).
  const auto recording_of = [](bool layer) {
    test::PlacedTest placed;
    placed.law = "power-1";
    placed.material = {40.0, 20.0, 5.0, 1.5};
    placed.reference_m = 1e-3;
    placed.depth_m = 1e-3;
    placed.ramp_s = 1.0;
    placed.rest_s = 3.0;
    Recording clean = test::placed(placed);
    if (layer) {
      // The force is linear in the kernel: along u^1.5 (1 + ...) instead of u^1.5.
      std::vector<double> bent;
      for (const double depth : clean.drive) {
        const double chi = std::sqrt(3e-3 * std::max(depth, 0.0)) / 2e-3;
        const double more = 1.0 + 1.133 * chi + 1.283 * chi * chi + 0.769 * std::pow(chi, 3);
        bent.push_back(depth * std::pow(more, 1.0 / 1.5));
      }
      LawSpec spec = test::spec_of(placed);
      std::vector<double> values = placed.material;
      values.resize(law_parameters(spec).size(), 0.0);
      Protocol history = measured_history(Drive::displacement, clean.time_s, bent);
      history.set_equilibrium_at_start(true);
      const Eigen::VectorXd force =
          LawModel(spec).respond(history, clean.time_s, values, Want::values).value;
      clean.response.assign(force.begin(), force.end());
    }
    placed.noise_N = 1e-4;
    Random random(3);
    return prepare_recording("made.csv", test::measured(placed, std::move(clean), random));
  };
  const Selection bent = selected_of(recording_of(true), "power-1", true);
  const FitResult& layer = bent.candidates[bent.recommended].fit;
  CHECK(find(layer, "exponent").lower.value() > 2.0);
  const ParameterResult& far = find(layer, "contact");
  REQUIRE(far.upper);
  CHECK(*far.upper < -4e-5);  // it was at 0
  CHECK_THAT(verdict_text(far), StartsWith("not identified: contact or a loading"));
  CHECK_THAT(far.summary, Contains("interval without such a loading"));
  // The stiffnesses and the exponent are those of a power from that contact; the time is not.
  for (const char* name : {"k_inf", "k1", "exponent"}) {
    const ParameterResult& p = find(layer, name);
    CHECK(p.verdict == Verdict::identified);
    CHECK_THAT(verdict_text(p), StartsWith("not identified: contact or a loading"));
    CHECK_THAT(p.summary, Contains("is not identified") && Contains("without such a loading"));
  }
  CHECK_FALSE(find(layer, "tau1").not_separable);
  const Selection straight = selected_of(recording_of(false), "power-1", true);
  const ParameterResult& near = find(straight.candidates[straight.recommended].fit, "contact");
  for (const ParameterResult& p : straight.candidates[straight.recommended].fit.parameters) {
    CHECK_FALSE(p.not_separable);
  }
  CHECK(near.lower.value() < 0.0);
  CHECK(near.upper.value() > 0.0);
}
