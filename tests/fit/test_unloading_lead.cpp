// Which law leads where no law describes the unloading: the one that describes the loading, not a
// worse one that is excused by its own residual or by its memory.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <utility>

#include "fitted_parameter.hpp"
#include "one_law.hpp"
#include "placed_recordings.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;

namespace {

Selection selected(const PreparedRecording& recording, std::initializer_list<const char*> laws) {
  SelectionOptions options = test::only(laws);
  options.setup = test::setup_of(4, true);
  options.held_out = false;
  return select_law(std::span(&recording, 1), options);
}

std::string lead_of(const Selection& s) {
  return law_name(s.candidates[s.recommended].law);
}

const FitResult& best_of(const Selection& s) {
  return s.candidates[s.recommended].fit;
}

/// Elastic, 100 N/m up to the first peak and 60 N/m ever after: softened by the first loading.
PreparedRecording softened(std::uint64_t seed) {
  constexpr double kRest_s = 3.0, kRamp_s = 2.0, kDepth_m = 4e-3, kStep_s = 0.02;
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  Random random(seed);
  for (int i = 0; i * kStep_s <= kRest_s + 4.0 * kRamp_s + 2.0; ++i) {
    const double t = i * kStep_s - kRest_s;
    const double cycle = std::fmod(std::max(t, 0.0), 2.0 * kRamp_s) / kRamp_s;
    const bool at_rest = t <= 0.0 || t >= 4.0 * kRamp_s;
    const double depth = at_rest ? 0.0 : kDepth_m * (cycle <= 1.0 ? cycle : 2.0 - cycle);
    r.time_s.push_back(t + kRest_s);
    r.drive.push_back(depth);
    r.response.push_back((t <= kRamp_s ? 100.0 : 60.0) * depth + 3e-4 * random.normal());
  }
  return prepare_recording("softened.csv", std::move(r));
}

/// An elastic sphere that comes through the air and sticks as it withdraws.
PreparedRecording sticking(std::uint64_t seed) {
  constexpr double kFrom_m = -300e-9, kTo_m = 500e-9, kHalf_s = 0.5, kStep_s = 0.002;
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  Random random(seed);
  for (int i = 0; i * kStep_s <= 2.0 * kHalf_s; ++i) {
    const double t = i * kStep_s;
    const bool back = t > kHalf_s;
    const double share = back ? 2.0 - t / kHalf_s : t / kHalf_s;
    const double depth = kFrom_m + (kTo_m - kFrom_m) * share;
    const double pushed = 0.02 * std::pow(std::max(depth, 0.0), 1.5) / std::sqrt(kTo_m);
    r.time_s.push_back(t);
    r.drive.push_back(depth);
    r.response.push_back(pushed - (back && depth > -60e-9 ? 1.5e-9 : 0.0) +
                         3e-11 * random.normal());
  }
  return prepare_recording("sticking.csv", std::move(r));
}

}  // namespace

TEST_CASE("a law that describes the loading leads where none describes the unloading",
          "[adequacy][unloading]") {
  const Selection s = selected(softened(16), {"linear", "power", "linear-1", "hertz-1", "hertz"});
  CHECK(lead_of(s) == "linear");
  CHECK_FALSE(s.preferred);
  const LawAdequacy& adequacy = best_of(s).adequacy.value();
  CHECK(adequacy.is_rejected());
  CHECK_THAT(adequacy.summary, Contains("linear describes the loading of this recording") &&
                                   Contains("but the unloading is off by ") &&
                                   Contains("no law tried describes both"));
  REQUIRE_FALSE(adequacy.causes.empty());
  CHECK(adequacy.causes.front().code == "unloading_differs");
  const ParameterResult& k = test::find(best_of(s), "k_inf");
  CHECK((k.lower.value() < 100.0 && 100.0 < k.upper.value()));
  CHECK(k.only_if_described);
  // A bad law is not excused by the residual that it leaves itself.
  for (const Candidate& c : s.candidates) {
    CAPTURE(law_name(c.law));
    if (c.law.branches == 0) CHECK(c.contradicted);
  }
  // Everyone says the same.
  CHECK(to_json(s)["recommended"] == "linear");
  CHECK(to_json(s)["adequacy"]["verdict"] == "not_described");
  CHECK(short_answer(s).conclusion.front() == adequacy.summary);
  CHECK(fitted_law(best_of(s)).adequacy.value().summary == adequacy.summary);
}

TEST_CASE("an adhesive withdrawal does not put a worse law of the loading first",
          "[adequacy][unloading]") {
  const Selection s = selected(sticking(17), {"linear", "hertz", "linear-elastic", "hertz-1"});
  CHECK(lead_of(s) == "hertz");
  CHECK_FALSE(s.preferred);
  const LawAdequacy& adequacy = best_of(s).adequacy.value();
  CHECK(adequacy.is_rejected());
  CHECK_THAT(adequacy.summary, Contains("hertz describes the loading") && Contains("adhesion"));
  const ParameterResult& k = test::find(best_of(s), "k_inf");
  const double made = 0.02 * std::sqrt(best_of(s).config.law.value().reference / 500e-9);
  CHECK((k.lower.value() < made && made < k.upper.value()));
}

TEST_CASE("a configuration repeats that its law does not describe the unloading",
          "[adequacy][unloading]") {
  const PreparedRecording recording = softened(5);
  const Selection s = selected(recording, {"linear", "linear-1"});
  REQUIRE(lead_of(s) == "linear");
  const FitResult again = fit_and_judge({best_of(s).config, data_sets(std::span(&recording, 1))});
  CHECK(again.adequacy.value().is_rejected());
  CHECK(again.adequacy.value().summary == best_of(s).adequacy.value().summary);
  for (const ParameterResult& p : again.parameters) CHECK(p.only_if_described);
}

TEST_CASE("a folder is led by the law of the loading, too", "[adequacy][unloading]") {
  std::vector<PreparedRecording> recordings;
  for (std::uint64_t seed : {1, 2, 3}) {
    recordings.push_back(softened(seed));
    recordings.back().name = fmt::format("softened_{}.csv", seed);
    recordings.back().specimen = recordings.back().name;
  }
  SelectionOptions options = test::only({"linear", "linear-1", "hertz-1"});
  options.setup = test::setup_of(4, true);
  const SpecimenStudy study = study_specimens(recordings, {}, options);
  CHECK(law_name(study.law) == "linear");
  for (const SpecimenRow& row : study.rows) {
    REQUIRE(row.fit);
    CHECK(row.fit->adequacy.value().is_rejected());
    CHECK_THAT(row.fit->adequacy->summary, Contains("unloading"));
  }
}

TEST_CASE("a law with memory that predicts the unloading goes before one without",
          "[adequacy][unloading]") {
  // The loading alone is a power of the depth within its noise, with or without relaxation.
  test::PlacedTest placed;
  placed.law = "power-1";
  placed.material = {60.0, 45.0, 2.0, 1.5};
  placed.reference_m = placed.depth_m = 3e-3;
  placed.rest_s = 3.0;
  placed.ramp_s = 1.5;
  placed.hold_s = 0.0;
  placed.after_s = 1.0;
  placed.step_s = 0.02;
  placed.noise_N = 3e-3;
  int without = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Selection s = selected(test::prepared(placed, seed), {"power", "power-1", "linear"});
    CAPTURE(seed, to_terminal_text(s));
    const auto elastic = std::ranges::find_if(
        s.candidates, [](const Candidate& c) { return law_name(c.law) == "power"; });
    without += elastic->delta_bic == 0.0 ? 1 : 0;
    CHECK(elastic->contradicted);
    // Of a loading that tells less than a sampling of the branch, too, no word against it.
    const bool named =
        best_of(s).adequacy.value().summary.find("power-1 describes both") != std::string::npos;
    CHECK((lead_of(s) == "power-1" || named));
    CHECK_THAT(best_of(s).adequacy.value().summary, !Contains("no law tried describes both"));
  }
  CHECK(without > 0);
}

TEST_CASE("the short answer names the law that the data prefer, with its values", "[unloading]") {
  // Of a strip that is slack below a stretch that its own law does not tell: see test_select.
  test::PlacedTest placed;
  placed.law = "linear-2";
  placed.material = {100.0, 300.0, 80.0, 0.15, 6.0};
  placed.step_s = 0.1;
  placed.noise_N = 1e-4;
  const Selection s = selected(test::prepared(placed, 1), {"linear-1", "linear-2"});
  REQUIRE(s.preferred);
  const ShortAnswer answer = short_answer(s);
  const auto line = std::ranges::find_if(answer.conclusion, [](const std::string& words) {
    return words.starts_with("linear-2, which the data prefer: ");
  });
  REQUIRE(line != answer.conclusion.end());
  CHECK_THAT(*line, Contains("k_inf = ") && Contains("tau2 = ") && Contains(" s ("));
}
