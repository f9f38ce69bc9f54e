// Zero, contact and drift of an indentation are measured where they can be told, and enter its fit
// as what was measured.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "fitted_parameter.hpp"
#include "one_law.hpp"
#include "placement_studies.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::PlacedTest;

namespace {

bool is_fitted(const FitResult& fit, const std::string& name) {
  return std::ranges::any_of(fit.parameters,
                             [&](const auto& p) { return p.parameter.name == name; });
}

Selection selected_law(const PreparedRecording& recording, const std::string& law,
                       SetupOptions setup = {}) {
  setup.starts = 8;
  return test::select_one(law, recording, setup);
}

/// The fit of one law, without profiles.
FitResult quick_fit(const PreparedRecording& recording, const std::string& law,
                    SetupOptions setup = {}) {
  setup.profiles = false;
  return selected_law(recording, law, setup).candidates.front().fit;
}

}  // namespace

TEST_CASE("the zero of a rest has the standard deviation of its correlated mean", "[placement]") {
  // sigma sqrt((1 + 2 sum (1 - k/n) phi^k) / n) against the scatter of 400 rests.
  for (const double phi : {0.0, 0.6}) {
    PlacedTest test;
    test.phi = phi;
    test.zero_N = 3e-3;
    test.start_m = -0.5e-3;
    const Recording clean = test::placed(test);
    double stated = 0.0, squares = 0.0;
    constexpr int kRests = 400;
    Random random(5);
    double n = 0.0;
    for (int i = 0; i < kRests; ++i) {
      const PreparedRecording r =
          prepare_recording("made.csv", test::measured(test, clean, random));
      const RestReadings rests = read_rests(r);
      REQUIRE(rests.zero);
      n = static_cast<double>(rests.before);
      stated += rests.zero->sd / kRests;
      squares += std::pow(rests.zero->value - test.zero_N, 2) / kRests;
    }
    double sum = 1.0;
    for (int k = 1; k < static_cast<int>(n); ++k) sum += 2.0 * (1.0 - k / n) * std::pow(phi, k);
    const double expected = test.noise_N * std::sqrt(sum / n);
    CHECK(n >= 95.0);
    CHECK_THAT(std::sqrt(squares), WithinRel(expected, 0.12));
    CHECK_THAT(stated, WithinRel(expected, 0.15));
  }
}

TEST_CASE("the onset is off by less than 0.2 % of the force", "[placement]") {
  struct Material {
    const char* law;
    std::vector<double> values;
    double exponent;
  };
  const std::vector<Material> materials{
      {"linear-1", {60.0, 45.0, 2.0}, 1.0},  {"linear-1", {60.0, 90.0, 0.5}, 1.0},
      {"linear-1", {60.0, 45.0, 20.0}, 1.0}, {"hertz-1", {60.0, 45.0, 2.0}, 1.5},
      {"hertz-1", {60.0, 90.0, 0.5}, 1.5},   {"power-1", {60.0, 45.0, 2.0, 2.0}, 2.0}};
  for (const Material& material : materials) {
    PlacedTest test;
    test.law = material.law;
    test.material = material.values;
    test.step_s = 0.01;
    test.hold_s = 5.0;
    test.zero_N = 5e-3;
    test.start_m = -0.5e-3;
    const Recording clean = test::placed(test);
    const double peak = *std::ranges::max_element(clean.response);
    test.noise_N = 1e-3 * peak;
    // The force that an error of the contact makes: the slope of the ramp where it ends.
    const double slope = material.exponent * peak / test.depth_m;
    double mean = 0.0, squares = 0.0;
    constexpr int kRamps = 60;
    Random random(11);
    for (int i = 0; i < kRamps; ++i) {
      const PreparedRecording r =
          prepare_recording("made.csv", test::measured(test, clean, random));
      const Onset onset = find_onset(r, read_rests(r), material.exponent);
      REQUIRE(onset.samples > 0);
      mean += onset.drive.value / kRamps;
      squares += std::pow(onset.drive.value / onset.drive.sd, 2) / kRamps;
    }
    INFO(material.law << ", tau " << material.values[2]);
    CHECK(std::abs(mean) * slope < 0.002 * peak);
    CHECK(squares < 2.0);
  }
}

TEST_CASE("an onset that noise hides is not late, and its uncertainty says how far it may be",
          "[placement]") {
  // F ~ x^2 with noise of 1 % of the peak: three standard deviations are passed 37 % late.
  PlacedTest test;
  test.law = "power-1";
  test.material = {60.0, 45.0, 2.0, 2.0};
  test.step_s = 0.01;
  test.hold_s = 5.0;
  test.zero_N = 5e-3;
  test.start_m = -0.5e-3;
  const Recording clean = test::placed(test);
  test.noise_N = 1e-2 * *std::ranges::max_element(clean.response);
  const test::OnsetErrors e = test::onset_errors(test, 2.0, 40, 7);
  INFO(e.mean << " +- " << e.scatter << ", stated " << e.stated << ", part " << e.part);
  CHECK(std::abs(e.mean) < 0.02);
  CHECK(e.scatter < 1.3 * e.stated);
  CHECK(e.threshold > 0.3);
}

TEST_CASE("a drift that the rest tells is in the fit, and k_inf knows it", "[placement]") {
  PlacedTest test;
  test.rest_s = 10.0;
  test.hold_s = 48.0;
  test.drift_N_per_s = 1e-3;
  const Selection s = selected_law(test::prepared(test, 3), "linear-1");
  const FitResult& fit = s.candidates.front().fit;
  CHECK_THAT(find(fit, "drift").estimate, WithinRel(1e-3, 0.01));
  CHECK_THAT(find(fit, "k_inf").estimate, WithinRel(60.0, 0.003));
  CHECK_THAT(find(fit, "k1").estimate, WithinRel(45.0, 0.005));
  CHECK_THAT(find(fit, "tau1").estimate, WithinRel(2.0, 0.01));
  CHECK_FALSE(s.drift);
  CHECK(verdict_text(find(fit, "k_inf")) == "identified");
  CHECK_THAT(to_terminal_text(fit), Contains("mN/s"));
  // Without the term the interval of k_inf is narrower than it may be.
  SetupOptions without;
  without.measured = false;
  test.drift_N_per_s = 0.0;
  const FitResult still = quick_fit(test::prepared(test, 3), "linear-1", without);
  CHECK_FALSE(is_fitted(still, "drift"));
}

TEST_CASE("a drift after withdrawal is read there, too", "[placement]") {
  PlacedTest test;
  test.rest_s = 1.0;
  test.after_s = 10.0;
  test.drift_N_per_s = -5e-4;
  const RestReadings rests = read_rests(test::prepared(test, 9));
  CHECK(rests.before >= 20);
  CHECK(rests.after > 150);
  REQUIRE(rests.drift);
  CHECK_THAT(rests.drift->value, WithinAbs(-5e-4, 4.0 * rests.drift->sd));
  CHECK(rests.drift->sd < 5e-6);
}

TEST_CASE("a bonded specimen that recovers after withdrawal tells no drift there", "[placement]") {
  PlacedTest test;
  test.rest_s = 15.0;
  test.hold_s = 23.0;
  test.after_s = 18.0;
  test.drift_N_per_s = 3e-4;
  Random random(17);
  Recording r = test::measured(test, test::placed(test), random);
  const double withdrawn_s = test.rest_s + 2.0 * test.ramp_s + test.hold_s;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double since = r.time_s[i] - withdrawn_s;
    if (since >= 0.0) r.response[i] -= 0.04 * std::exp(-since / 2.0);
  }
  const RestReadings rests = read_rests(prepare_recording("bonded.csv", r));
  CHECK(rests.before >= 290);
  CHECK(rests.after == 0);
  REQUIRE(rests.drift);
  CHECK_THAT(rests.drift->value, WithinAbs(3e-4, 4.0 * rests.drift->sd));
  CHECK(rests.drift->sd < 1e-5);
}

TEST_CASE("a placement that is remembered is the one that is measured", "[placement]") {
  PlacedTest test;
  const PreparedRecording recording = test::prepared(test, 12);
  std::vector<PreparedRecording> two(2, recording);
  two.back().to_s = 0.5 * recording.to_s;
  PlacementMemory memory;
  for (const char* name : {"linear-1", "linear-3", "hertz-1", "power-1"}) {
    const LawSpec law = parse_law_name(name, "test");
    for (const PreparedRecording& r : two) {
      const MeasuredPlacement measured = measure_placement(r, law, {});
      const MeasuredPlacement& remembered = memory.of(r, law, {});
      CHECK(remembered.onset.drive.value == measured.onset.drive.value);
      CHECK(remembered.onset.drive.sd == measured.onset.drive.sd);
      CHECK(remembered.drift == measured.drift);
      CHECK(&memory.of(r, law, {}) == &remembered);
    }
  }
  CHECK(memory.of(recording, parse_law_name("power-1", "test"), 2.0).onset.drive.value ==
        measure_placement(recording, parse_law_name("power-1", "test"), 2.0).onset.drive.value);
}

TEST_CASE("without a rest a drift and a slow branch are not separable", "[placement]") {
  PlacedTest test;
  test.rest_s = 0.0;
  const Selection s = selected_law(test::prepared(test, 4), "linear-1");
  const FitResult& fit = s.candidates.front().fit;
  CHECK_FALSE(is_fitted(fit, "drift"));
  REQUIRE(s.drift);
  REQUIRE(s.drift->drifting);
  CHECK_THAT(s.drift->k_inf, WithinRel(60.0, 0.01));
  const ParameterResult& k_inf = find(fit, "k_inf");
  CHECK(verdict_text(k_inf) == "not identified: drift or a slow branch: not separable");
  CHECK_THAT(to_terminal_text(fit), Contains("drift or a slow branch: not separable") &&
                                        Contains("without a drift of the zero"));
  const Json json = to_json(s);
  CHECK(json.at("drift_or_slow_branch").at("separable") == false);
  for (const Json& p : json.at("fit").at("parameters")) {
    if (p.at("name") == "k_inf") CHECK(p.at("not_separable").at("code") == kDriftOrBranch);
  }
  // What a drift would move has an interval that holds both answers.
  for (const char* name : {"k1", "tau1"}) {
    const ParameterResult& p = find(fit, name);
    if (p.not_separable) continue;
    REQUIRE(p.with_drift);
    CHECK(*p.lower <= *p.with_drift->lower);
    CHECK(*p.upper >= *p.with_drift->upper);
    CHECK(*p.lower < p.estimate);
    CHECK_THAT(p.summary, Contains("with a drift of the zero or without"));
  }
  // The written configuration says the same when it is run.
  const FitResult again = run_fit(parse_fit_config(config_json(fit.config), "test"),
                                  {test::prepared(test, 4).recording});
  CHECK(verdict_text(find(again, "k_inf")) == verdict_text(k_inf));
}

TEST_CASE("pools, law files and written configurations hold both answers of a drift",
          "[placement]") {
  PlacedTest test;
  test.rest_s = 0.0;
  test.drift_N_per_s = 5e-4;
  const PreparedRecording recording = test::prepared(test, 4);
  const LawSpec law = parse_law_name("linear-1", "test");
  SetupOptions setup;
  setup.starts = 8;
  const std::span<const PreparedRecording> span(&recording, 1);
  FitResult fit = run_fit(recording_config(law, span, setup), data_sets(span));
  const LawFile narrow = fitted_law(fit);
  const FitResult alone = fit;
  const auto both = give_both_drift_answers(fit, span);
  REQUIRE(both);
  REQUIRE(both->drifting);
  CHECK_THAT(*both->drifting, WithinRel(60.0, 0.02));
  // 0.5 mN/s over the recording moves k_inf by more than its standard error.
  const double before = find(alone, "k_inf").standard_error.value();
  const double after = find(fit, "k_inf").standard_error.value();
  CHECK(std::abs(both->k_inf - *both->drifting) > before);
  CHECK(1.96 * after > std::abs(both->k_inf - *both->drifting));
  const LawFile wide = fitted_law(fit);
  const Eigen::Index k = 0;  // k_inf, linear
  CHECK_THAT(std::sqrt(wide.uncertainty.value().covariance(k, k) /
                       narrow.uncertainty.value().covariance(k, k)),
             WithinRel(after / before, 1e-9));
  const Eigen::VectorXd eigenvalues =
      wide.uncertainty->covariance.selfadjointView<Eigen::Lower>().eigenvalues();
  CHECK(eigenvalues.minCoeff() >= -1e-12 * eigenvalues.maxCoeff());
  CHECK(wide.uncertainty->not_separable.front() == "k_inf");
  // The configuration that was written.
  const FitConfig written = parse_fit_config(config_json(alone.config), "test");
  FitResult again = run_fit(written, data_sets(span));
  give_both_drift_answers(again, data_sets(span));
  for (const char* name : {"k_inf", "k1", "tau1"}) {
    CAPTURE(name);
    CHECK_THAT(find(again, name).standard_error.value(),
               WithinRel(find(fit, name).standard_error.value(), 1e-3));
    CHECK(find(again, name).with_drift.has_value() == find(fit, name).with_drift.has_value());
  }
  CHECK(again.remarks.back().code == "drift_not_separable");
}

TEST_CASE("a drift that no rest tells does not move k1 and tau1 out of their intervals",
          "[placement]") {
  for (const double drift_N_per_s : {-1e-3, 5e-4, 2e-3}) {
    CAPTURE(drift_N_per_s);
    PlacedTest test;
    test.rest_s = 0.0;
    test.drift_N_per_s = drift_N_per_s;
    const Selection s = selected_law(test::prepared(test, 4), "linear-1");
    const FitResult& fit = s.candidates.front().fit;
    for (const auto& [name, truth] : {std::pair<const char*, double>{"k1", 45.0}, {"tau1", 2.0}}) {
      const ParameterResult& p = find(fit, name);
      CAPTURE(name, p.summary);
      if (p.verdict != Verdict::identified || p.not_separable) continue;
      CHECK(*p.lower < truth);
      CHECK(*p.upper > truth);
    }
  }
}

TEST_CASE("a rest too short for the hold does not separate a drift", "[placement]") {
  PlacedTest test;
  test.rest_s = 0.5;
  test.noise_N = 2e-3;
  const PreparedRecording r = test::prepared(test, 4);
  const RestReadings rests = read_rests(r);
  REQUIRE(rests.drift);
  CHECK(rests.drift->sd * test.hold_s > 0.02 * 0.24);
  CHECK(drift_finding(r, rests) == DriftFinding::not_separable);
}

TEST_CASE("priors and drift are kept by the written configuration", "[placement]") {
  PlacedTest test;
  test.drift_N_per_s = 2e-4;
  const PreparedRecording r = test::prepared(test, 6);
  const FitResult fit = quick_fit(r, "linear-1");
  const FitConfig read = parse_fit_config(config_json(fit.config), "test");
  const FitResult again = run_fit(read, {r.recording});
  for (const ParameterResult& p : fit.parameters) {
    const ParameterResult& q = find(again, p.parameter.name);
    CHECK_THAT(q.estimate, WithinAbs(p.estimate, 1e-3 * p.standard_error.value()));
    CHECK_THAT(q.standard_error.value(), WithinRel(p.standard_error.value(), 1e-4));
  }
  Json broken = config_json(fit.config);
  broken["parameters"]["drift"]["drift"]["of"] = "other.csv";
  CHECK_THROWS_WITH(parse_fit_config(broken, "test"), Contains("'other.csv' is no recording"));
  broken = config_json(fit.config);
  broken["parameters"]["drift"]["start"] = "1 mN";
  CHECK_THROWS_WITH(parse_fit_config(broken, "test"), Contains("'1 mN' is no drift"));
  broken = config_json(fit.config);
  broken["parameters"]["offset"]["prior"]["sd"] = "0 N";
  CHECK_THROWS_WITH(parse_fit_config(broken, "test"), Contains("/prior/sd: not above 0"));
}

TEST_CASE("a prior is a limit where its key says so, whatever its source is called",
          "[placement]") {
  PlacedTest test;
  test.drift_N_per_s = 2e-4;
  const PreparedRecording r = test::prepared(test, 6);
  Json config = config_json(quick_fit(r, "linear-1").config);
  Json& prior = config["parameters"]["offset"]["prior"];
  prior["from"] = "stated by the maker of the cell";
  const auto of_priors = [&] {
    const FitResult fit = run_fit(parse_fit_config(config, "test"), {r.recording});
    const Json written = config_json(fit.config).at("parameters").at("offset").at("prior");
    CHECK(written.value("measured", true) == prior.value("measured", true));
    return std::ranges::count(fit.remarks, "moved_from_prior", &Remark::code);
  };
  const auto measured = of_priors();
  prior["measured"] = false;
  CHECK(of_priors() == measured + 1);
}

TEST_CASE("contact and zero that are stated are held", "[placement]") {
  PlacedTest test;
  test.law = "hertz-1";
  test.zero_N = 4e-3;
  const PreparedRecording r = test::prepared(test, 7);
  SetupOptions held;
  held.contact = 0.1e-3;
  held.zero = 5e-3;
  const FitResult fit = quick_fit(r, "hertz-1", held);
  CHECK_FALSE(is_fitted(fit, "contact"));
  CHECK_FALSE(is_fitted(fit, "offset"));
  const LawModel model(*fit.config.law);
  CHECK(fit.config.fixed[model.index("contact")] == 0.1e-3);
  CHECK(fit.config.fixed[model.index("offset")] == 5e-3);
}

TEST_CASE("contact and zero that are stated are held in a prediction", "[placement]") {
  PlacedTest test;
  test.zero_N = 5e-3;
  const LawFile law = fitted_law(quick_fit(test::prepared(test, 7), "linear-1"));
  const PreparedRecording other = test::prepared(test, 8);
  for (const bool both : {true, false}) {
    PredictionOptions options;
    options.zero = 5e-3;
    if (both) options.contact = 0.1e-3;
    const LawPrediction p = predict_recording(law, other, options);
    CHECK(p.placement == Placement::own);
    CHECK(p.offset == 5e-3);
    if (both) CHECK(p.contact == 0.1e-3);
    if (!both) CHECK_THAT(p.contact, Catch::Matchers::WithinAbs(0.0, 0.05e-3));
  }
  PredictionOptions contrary;
  contrary.zero = 5e-3;
  contrary.placement = Placement::surface;
  CHECK_THROWS_WITH(predict_recording(law, other, contrary), Catch::Contains("--placement own"));
  CHECK_THROWS_WITH(require_contact_within(5e-3, std::span(&other, 1), "--contact"),
                    Catch::Contains("5 mm is not below the largest depth"));
}

TEST_CASE("a law that does not describe a recording leaves its contact where it was measured",
          "[placement]") {
  // A power of 2.5 fitted by a straight kernel: contact used to go where the residual is least.
  PlacedTest test;
  test.law = "power-1";
  test.material = {60.0, 45.0, 2.0, 2.5};
  test.noise_N = 1e-4;
  const PreparedRecording r = test::prepared(test, 8);
  const Onset onset = find_onset(r, read_rests(r), 1.0);
  const FitResult fit = quick_fit(r, "linear-1");
  const ParameterResult& contact = find(fit, "contact");
  CHECK_FALSE(contact.first_bounds);
  CHECK(std::abs(contact.estimate - onset.drive.value) < 4.0 * onset.drive.sd);
}

TEST_CASE("recordings of one material at unequal depths, preloads and zeros pool to it",
          "[placement]") {
  std::vector<PreparedRecording> recordings;
  for (int i = 0; i < 10; ++i) {
    PlacedTest test;
    test.law = "power-1";
    test.material = {60.0, 45.0, 2.0, 1.5};
    test.depth_m = 1e-3 * (4.0 + 0.6 * i);
    test.ramp_s = 0.5e3 * test.depth_m;
    test.start_m = 1e-4 * (i % 5);  // some begin at a preload
    test.zero_N = 2e-3 * (i % 3 - 1);
    test.step_s = 0.1;
    test.noise_N = 5e-4;
    Random random(static_cast<std::uint64_t>(20 + i));
    recordings.push_back(prepare_recording(fmt::format("{}.csv", i),
                                           test::measured(test, test::placed(test), random)));
  }
  SelectionOptions options;
  options.setup.starts = 6;
  options.setup.profiles = false;
  options.setup.reference = 4e-3;
  for (const char* law : {"hertz-1", "power-1"}) {
    const SpecimenStudy study = study_specimens(recordings, parse_law_name(law, "test"), options);
    for (const char* name : {"k_inf", "k1"}) {
      double low = HUGE_VAL, high = 0.0;
      for (const SpecimenRow& row : study.rows) {
        REQUIRE(row.fit);
        const double value = find(*row.fit, name).estimate;
        low = std::min(low, value);
        high = std::max(high, value);
      }
      INFO(law << " " << name << ": " << low << " to " << high);
      CHECK(high < 1.3 * low);
    }
  }
}

TEST_CASE("a stiffness that is not told from a drift is not pooled as if it were identified",
          "[placement]") {
  const auto study_of = [](std::vector<double> rests_s) {
    std::vector<PreparedRecording> recordings;
    for (std::size_t i = 0; i < rests_s.size(); ++i) {
      PlacedTest test;
      test.rest_s = rests_s[i];
      test.noise_N = 5e-4;
      recordings.push_back(test::prepared(test, 60 + i));
      recordings.back().name = fmt::format("{}.csv", i);
    }
    SelectionOptions options;
    options.setup.starts = 4;
    options.setup.profiles = false;
    return study_specimens(recordings, parse_law_name("linear-1", "test"), options);
  };
  const auto k_inf_of = [](const SpecimenStudy& study) {
    return *std::ranges::find(study.pooled, "k_inf",
                              [](const PooledParameter& p) { return p.parameter.name; });
  };
  const SpecimenStudy some = study_of({20.0, 20.0, 20.0, 0.5, 0.5});
  const PooledParameter pooled = k_inf_of(some);
  CHECK(pooled.effects.specimens == 3);
  CHECK(pooled.not_separable == 2);
  CHECK_FALSE(pooled.only_without);
  CHECK_THAT(pooled.effects.summary, Catch::Contains("2 more left out"));
  const SpecimenStudy none = study_of({0.5, 0.5, 0.5});
  CHECK(k_inf_of(none).only_without.value().code == kDriftOrBranch);
  CHECK_THAT(to_terminal_text(none), Catch::Contains("not identified: drift or a slow branch"));
  const Json written = to_json(none);
  for (const Json& entry : written.at("pooled")) {
    CHECK(entry.at("identified").get<bool>() == (entry.at("name") != "k_inf"));
  }
}
