// What a fit says of its own adequacy, and who repeats it: JSON, law files, predictions, exports.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "adequacy_studies.hpp"
#include "one_law.hpp"
#include "placed_recordings.hpp"
#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_export.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/unloading_test.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::EndsWith;
using Catch::StartsWith;
using test::AdequacyTrial;
using test::Defect;

namespace {

Selection selected_law(const char* law, const PreparedRecording& recording, bool profiles = false) {
  return test::select_one(law, recording, test::setup_of(4, profiles));
}

Selection selected_linear_1(const PreparedRecording& recording) {
  return selected_law("linear-1", recording);
}

const FitResult& best_of(const Selection& s) {
  return s.candidates[s.recommended].fit;
}

PreparedRecording prepared_trial(const AdequacyTrial& trial) {
  Recording r = test::simulated(trial);
  r.header.sha256 = std::string(64, 'a');
  return prepare_recording("simulated", std::move(r));
}

}  // namespace

TEST_CASE("a law that does not describe its recording says so first and everywhere",
          "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 60;
  trial.defect = Defect::ringing;
  trial.defect_N = 0.1;
  const PreparedRecording recording = prepared_trial(trial);
  const Selection s = selected_linear_1(recording);
  CHECK_THAT(s.summary.front(), StartsWith("no law tried describes this recording: residual "));
  CHECK_THAT(s.summary.front(), Contains("times the noise"));
  CHECK_FALSE(s.candidates[s.recommended].identified);
  const Json json = to_json(s);
  CHECK(json.at("adequacy").at("verdict") == "not_described");
  CHECK(json.at("adequacy").at("residual_over_noise") > 3.0);
  for (const Json& p : json.at("fit").at("parameters")) {
    CHECK(p.at("only_if_described") == true);
    CHECK_THAT(p.at("verdict").get<std::string>(), Contains("only if the law described the data"));
    CHECK_THAT(p.at("summary").get<std::string>(), Contains("which it does not"));
  }
  const test::TempFolder folder;
  write_law(folder.path() / "law.json", fitted_law(best_of(s)));
  const LawFile law = read_law(folder.path() / "law.json");
  REQUIRE(law.adequacy);
  CHECK(law.adequacy->is_rejected());
  CHECK(law.adequacy->summary == s.summary.front());
  const Remark in_doubt{"law_in_doubt", s.summary.front()};
  CHECK(predict_recording(law, recording, {}).remarks.front() == in_doubt);
  CHECK(export_remarks(law, {}).front() == in_doubt);
}

TEST_CASE("where no law tried describes a recording, the laws that were not tried are named",
          "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 60;
  trial.defect = Defect::ringing;
  trial.defect_N = 0.1;
  const PreparedRecording recording = prepared_trial(trial);
  SelectionOptions options = test::only({"linear-1", "linear"});
  options.held_out = false;
  options.setup.profiles = false;
  const Selection classical = select_law(std::span(&recording, 1), options);
  CHECK_THAT(classical.summary.front(), StartsWith("no law tried describes this recording: ") &&
                                            EndsWith("not tried: --family fractional"));
  options.laws.push_back(parse_law_name("linear-fspringpot", "test"));
  const Selection all = select_law(std::span(&recording, 1), options);
  CHECK_THAT(all.summary.front(), StartsWith("no law tried describes this recording: ") &&
                                      !Contains("--family fractional"));
}

TEST_CASE("a law that describes its recording says how near it comes", "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 60;
  const Selection s = selected_linear_1(prepared_trial(trial));
  const LawAdequacy& adequacy = best_of(s).adequacy.value();
  CHECK(adequacy.is_adequate());
  CHECK(adequacy.residual_over_noise.value() == Approx(1.0).margin(0.25));
  CHECK_THAT(s.summary.front(), !Contains("no law tried"));
  CHECK_FALSE(best_of(s).parameters.front().only_if_described);
}

TEST_CASE("times of the noise are written as people write them", "[adequacy]") {
  CHECK(times_text(1.0432) == "1");
  CHECK(times_text(2.43) == "2.4");
  CHECK(times_text(93.2) == "93");
  CHECK(times_text(1204.4) == "1204");
}

TEST_CASE("a drift that the rests do not show is lack of fit", "[adequacy][wired]") {
  // A branch of 12 s that linear-1 does not have, most of which a drift takes up.
  AdequacyTrial trial;
  trial.at_rest = 30;
  trial.defect = Defect::slow_branch;
  trial.defect_N = test::amplitude_for(trial, 3.0);
  int found = 0;
  constexpr int kRecordings = 20;
  for (int i = 0; i < kRecordings; ++i) {
    trial.seed = 300 + static_cast<std::uint64_t>(i);
    const LawAdequacy adequacy = test::fitted(trial).adequacy;
    if (!adequacy.is_rejected()) continue;
    ++found;
    if (adequacy.summary.find("it takes a drift of ") == std::string::npos) continue;
    CHECK_THAT(adequacy.summary, Contains("but the readings at rest show") &&
                                     Contains("a slow branch that the law does not have"));
  }
  CHECK(found >= 14);  // 8 of 40 by the residual alone
}

TEST_CASE("a drift that the rests show is none", "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 60;
  trial.defect = Defect::drift;
  trial.defect_N = 50.0 * test::kNoise_N;
  int rejected = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    trial.seed = seed;
    const test::AdequacyOutcome outcome = test::fitted(trial);
    CHECK(outcome.drift_fitted);
    rejected += outcome.adequacy.is_rejected();
  }
  CHECK(rejected <= 1);
}

TEST_CASE("a law that another beats decisively holds nothing for identified", "[adequacy][wired]") {
  // A branch of 60 s in a hold of 7 s: linear-1 takes half of it for its plateau.
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  base::Random random(5);
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i - 1.0;
    const double ramp = std::clamp(t, 0.0, 2.0);
    const double since = std::max(t, 0.0);
    const auto branch = [&](double k, double tau) {
      return k * tau * (1.0 - std::exp(-ramp / tau)) * std::exp(-(since - ramp) / tau);
    };
    r.time_s.push_back(t + 1.0);
    r.drive.push_back(2e-3 * ramp);
    r.response.push_back(2e-3 * (60.0 * ramp + branch(45.0, 2.0) + branch(40.0, 60.0)) +
                         2e-4 * random.normal());
  }
  const PreparedRecording recording = prepare_recording("slow.csv", r);
  SelectionOptions options = test::only({"linear-1", "linear-2"});
  options.setup.starts = 10;
  const Selection s = select_law(std::span(&recording, 1), options);
  REQUIRE(s.preferred);
  const FitResult& fit = best_of(s);
  CHECK(law_name(s.candidates[s.recommended].law) == "linear-1");
  CHECK(fit.adequacy.value().is_rejected());
  CHECK_THAT(s.summary.front(), StartsWith("linear-1 does not describe "));
  for (const ParameterResult& p : fit.parameters) CHECK(p.only_if_described);
  CHECK(fitted_law(fit).adequacy.value().is_rejected());
  // The written configuration says the same when it is run, unless something else is fitted.
  Json written = config_json(fit.config);
  const auto rerun = [&] {
    return fit_and_judge({parse_fit_config(written, "test"), {recording.recording}});
  };
  const FitResult again = rerun();
  CHECK(again.adequacy.value().summary == fit.adequacy.value().summary);
  CHECK(again.adequacy.value().is_rejected());
  for (const ParameterResult& p : again.parameters) CHECK(p.only_if_described);
  CHECK(std::ranges::any_of(again.remarks, [](const Remark& remark) {
    return remark.code == "condition_of_choice" &&
           remark.text.find("the data prefer ") != std::string::npos;
  }));
  // A recording that was edited keeps its number of samples: the SHA-256 of its readings tells.
  CHECK_FALSE(test::has_remark(again.remarks, "another_choice"));
  Recording edited = recording.recording;
  edited.response.back() *= 1.0 + 1e-6;
  const FitResult stale = fit_and_judge({parse_fit_config(written, "test"), {edited}});
  CHECK(stale.value_count == fit.value_count);
  CHECK_THAT(std::string(test::remark_text(stale.remarks, "another_choice")),
             Contains("the recording differs from the one that chose the law"));
  CHECK_FALSE(test::has_remark(stale.remarks, "condition_of_choice"));
  Json without = written;
  without.at("choice").erase("samples_sha256");
  const FitResult unknown =
      fit_and_judge({parse_fit_config(without, "test"), {recording.recording}});
  CHECK_THAT(std::string(test::remark_text(unknown.remarks, "another_choice")),
             Contains("does not hold the SHA-256"));
  CHECK_FALSE(test::has_remark(unknown.remarks, "condition_of_choice"));
  written.at("choice").at("samples") = fit.value_count + 1;
  const FitResult other = rerun();
  CHECK(test::has_remark(other.remarks, "another_choice"));
  CHECK_FALSE(test::has_remark(other.remarks, "condition_of_choice"));
}

TEST_CASE("without a rest adequacy cannot be judged", "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 4;
  trial.defect = Defect::slow_branch;
  trial.defect_N = 0.1;
  const Selection s = selected_linear_1(prepared_trial(trial));
  const LawAdequacy& adequacy = best_of(s).adequacy.value();
  CHECK(adequacy.verdict == "not_judged");
  CHECK_FALSE(adequacy.residual_over_noise);
  CHECK_THAT(adequacy.summary, StartsWith("adequacy cannot be judged"));
}

TEST_CASE("where neither a rest nor the residuals tell the noise nothing is identified",
          "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 4;
  trial.defect = Defect::slow_branch;
  trial.defect_N = 0.1;
  const PreparedRecording wrong = prepared_trial(trial);
  const Selection s = selected_law("linear-1", wrong, true);
  const FitResult& fit = best_of(s);
  REQUIRE(fit.noise);
  REQUIRE(fit.value_count / fit.noise->inflation < static_cast<double>(fit.parameters.size()));
  CHECK_FALSE(s.candidates[s.recommended].identified);
  for (const ParameterResult& p : fit.parameters) {
    CAPTURE(p.parameter.name);
    CHECK_THAT(verdict_text(p), !StartsWith("identified"));
  }
  // The written configuration says the same when it is run.
  const FitResult again =
      fit_and_judge({parse_fit_config(config_json(fit.config), "test"), {wrong.recording}});
  for (const ParameterResult& p : again.parameters) CHECK_THAT(verdict_text(p), !StartsWith("id"));
  // A law that is right leaves noise that tells itself.
  trial.defect = Defect::none;
  for (const double rho : {0.0, 0.9}) {
    trial.rho = rho;
    const Selection right = selected_law("linear-1", prepared_trial(trial), true);
    CAPTURE(rho);
    CHECK(best_of(right).adequacy.value().verdict == "not_judged");
    CHECK(std::ranges::none_of(best_of(right).parameters,
                               [](const ParameterResult& p) { return p.unconfirmed.has_value(); }));
  }
}

TEST_CASE("readings at the limit of a force cell are named and censored", "[adequacy][clipping]") {
  AdequacyTrial trial;
  trial.at_rest = 40;
  trial.clip = 0.75;
  const PreparedRecording recording = prepared_trial(trial);
  REQUIRE(recording.clipped_above);
  CHECK_THAT(recording.phases.summary.front(), StartsWith("clipping: "));
  const Selection s = selected_linear_1(recording);
  const FitResult& fit = best_of(s);
  CHECK(fit.adequacy.value().is_adequate());
  for (const ParameterResult& p : fit.parameters) {
    const double truth = p.parameter.name == "k_inf"  ? 60.0
                         : p.parameter.name == "k1"   ? 45.0
                         : p.parameter.name == "tau1" ? 2.0
                                                      : 0.0;
    if (truth > 0.0) CHECK(std::abs(p.estimate - truth) < 4.0 * p.standard_error.value());
  }
  CHECK(test::has_remark(fit.remarks, "clipping"));
  const Json data = config_json(fit.config).at("data").front();
  CHECK(data.contains("clipped_above"));
  const LawFile law = fitted_law(fit);
  CHECK(law.uncertainty.value().data.front().clipped_above == recording.clipped_above);
  const LawPrediction p = predict_recording(law, recording, {});
  CHECK(p.recording.value().fitted.rms ==
        Approx(fit.recordings.front().rms_residual).epsilon(1e-6));
}

TEST_CASE("what looks like a limit of the force cell and is none", "[adequacy][clipping]") {
  AdequacyTrial exact;
  exact.noisy = false;
  CHECK_FALSE(prepared_trial(exact).clipped_above);
  Recording elastic;
  Recording creep;  // 4 N kept from 1 s on, and the depth goes on
  for (Recording* r : {&elastic, &creep}) {
    r->drive_quantity = Quantity::indentation_depth;
    r->response_quantity = Quantity::contact_force;
  }
  for (int i = 0; i < 200; ++i) {
    const double t = 0.1 * i;
    const double ramp = std::min(t, 1.0);
    elastic.time_s.push_back(t);
    elastic.drive.push_back(4e-3 * ramp);
    elastic.response.push_back(0.24 * ramp);
    creep.time_s.push_back(t);
    creep.drive.push_back(2e-3 * ramp + (t > 1.0 ? 2e-3 * (1.0 - std::exp((1.0 - t) / 3.0)) : 0.0));
    creep.response.push_back(4.0 * ramp);
  }
  CHECK_FALSE(prepare_recording("elastic", elastic).clipped_above);
  CHECK_FALSE(prepare_recording("creep", creep).clipped_above);
}

TEST_CASE("a stated size of the noise is what residuals are compared with", "[adequacy][wired]") {
  AdequacyTrial trial;
  trial.at_rest = 4;
  const PreparedRecording one = prepared_trial(trial);
  const std::span<const PreparedRecording> recordings(&one, 1);
  SetupOptions setup;
  setup.starts = 4;
  setup.profiles = false;
  FitConfig config = recording_config(parse_law_name("linear-1", "test"), recordings, setup);
  const auto verdict = [&](double sd_N) {
    config.data.front().noise.absolute = sd_N;
    config.data.front().noise.scale_known = true;
    FitResult fit = run_fit(config, data_sets(recordings));
    state_adequacy(fit, data_sets(recordings));
    return fit.adequacy.value();
  };
  CHECK(verdict(test::kNoise_N).is_adequate());
  const LawAdequacy wrong = verdict(test::kNoise_N / 3.0);
  CHECK(wrong.is_rejected());
  CHECK_THAT(wrong.summary,
             Contains("times the noise that is stated, p = ") && Contains(" is below 1 %"));
  CHECK(wrong.residual_over_noise.value() == Approx(3.0).epsilon(0.15));
}

TEST_CASE(
    "the verdict on readings is that of the p printed beside chi-square, missed bands included",
    "[adequacy]") {
  for (const auto& [file, adequate] :
       {std::pair{"liver_relaxation.json", true}, {"liver_all.json", false}}) {
    CAPTURE(file);
    FitProblem problem = read_fit_problem(std::string(TPM_TEST_SOURCE_DIR "/configs/") + file);
    problem.config.starts = 5;
    const FitResult fit = fit_and_judge(problem);
    const double p = fit.chi_square_p.value();
    CHECK((p >= 0.01) == adequate);
    CHECK(fit.adequacy.value().is_adequate() == adequate);
    CHECK_THAT(fit.adequacy->summary, Contains(", p = " + base::significant(p, 2) + " is "));
    CHECK(fit.parameters.front().only_if_described == !adequate);
  }
}

TEST_CASE("what is pooled over a recording that the law does not describe is not called identified",
          "[adequacy][specimens]") {
  const auto study_of = [](Defect third) {
    std::vector<PreparedRecording> recordings;
    for (std::uint64_t i = 1; i <= 3; ++i) {
      AdequacyTrial trial;
      trial.at_rest = 60;
      trial.seed = i;
      if (i == 3) trial.defect = third;
      trial.defect_N = 0.1;
      recordings.push_back(prepare_recording(fmt::format("{}.csv", i), test::simulated(trial)));
    }
    SelectionOptions options;
    options.setup.starts = 4;
    options.setup.profiles = false;
    return study_specimens(recordings, parse_law_name("linear-1", "test"), options);
  };
  constexpr const char* kCondition = "only if the law described the data";
  ContactGeometry punch;
  punch.punch_radius_m = 2e-3;
  const SpecimenStudy spoilt = study_of(Defect::ringing);
  REQUIRE(is_not_described(*spoilt.rows[2].fit));
  REQUIRE_FALSE(spoilt.pooled.empty());
  for (const PooledParameter& p : spoilt.pooled) {
    CAPTURE(p.parameter.name);
    CHECK_FALSE(p.identified());
    CHECK(p.not_described == 1);
    CHECK_THAT(p.effects.summary, Contains("1 of 3 it does not"));
  }
  const Json spoilt_json = to_json(spoilt);
  for (const Json& p : spoilt_json.at("pooled")) {
    CHECK(p.at("identified") == false);
    CHECK(p.at("only_if_described") == true);
  }
  for (const YoungModulus& m : pooled_moduli(spoilt, punch, false).moduli) {
    CAPTURE(m.name);
    CHECK_THAT(m.verdict, Contains(kCondition));
  }
  const YoungModuli own = young_moduli(*spoilt.rows[2].fit, punch, false);
  CHECK(own.moduli.back().name == "E_instantaneous");
  CHECK_THAT(own.moduli.back().verdict, Contains(kCondition));

  const SpecimenStudy healthy = study_of(Defect::none);
  const Json healthy_json = to_json(healthy);
  for (const Json& p : healthy_json.at("pooled")) CHECK_FALSE(p.contains("only_if_described"));
  for (const YoungModulus& m : pooled_moduli(healthy, punch, false).moduli) {
    CHECK_THAT(m.verdict, !Contains(kCondition));
  }
}

TEST_CASE("a plateau that the hold does not reach is not identified", "[adequacy]") {
  const auto verdict = [](double tau_s) {
    test::PlacedTest placed;
    placed.material = {50.0, 30.0, tau_s};
    placed.rest_s = 20.0;
    placed.hold_s = 20.0;
    placed.noise_N = 1e-4;
    const Selection s = selected_law("linear-1", test::prepared(placed, 3), true);
    for (const ParameterResult& p : best_of(s).parameters) {
      if (p.parameter.name == "k_inf") return verdict_text(p);
    }
    return std::string();
  };
  CHECK(verdict(9.0) == "not identified: the plateau or a slower branch: not separable");
  CHECK(verdict(2.0) == "identified");
}

TEST_CASE("an unloading with hysteresis contradicts a law without memory", "[adequacy]") {
  // The loading alone is a power of the depth within its noise, with or without relaxation.
  const auto selected = [](const char* made, std::vector<double> material) {
    test::PlacedTest placed;
    placed.law = made;
    placed.material = std::move(material);
    placed.reference_m = placed.depth_m = 3e-3;
    placed.rest_s = 3.0;
    placed.ramp_s = 1.5;
    placed.hold_s = 0.0;
    placed.after_s = 1.0;
    placed.step_s = 0.02;
    placed.noise_N = 4e-4;
    return selected_law("power", test::prepared(placed, 5));
  };
  const Selection relaxing = selected("power-1", {60.0, 45.0, 2.0, 1.5});
  CHECK_THAT(hysteresis_of(best_of(relaxing)), StartsWith("the unloading is off by "));
  CHECK(best_of(relaxing).adequacy.value().is_rejected());
  CHECK_FALSE(relaxing.candidates.front().identified);
  CHECK(relaxing.candidates.front().contradicted);
  for (const ParameterResult& p : best_of(relaxing).parameters) CHECK(p.only_if_described);
  const Selection elastic = selected("power", {60.0, 1.5});
  CHECK(hysteresis_of(best_of(elastic)).empty());
  CHECK_FALSE(best_of(elastic).adequacy.value().is_rejected());
}

TEST_CASE("an unloading that a law with memory does not predict contradicts it", "[adequacy]") {
  const auto triangle = [](std::uint64_t seed, double phi, bool softened) {
    test::PlacedTest placed;
    placed.material = {60.0, 45.0, 0.6};
    placed.rest_s = 2.0;
    placed.hold_s = 0.0;
    placed.after_s = 1.0;
    placed.step_s = 0.02;
    placed.noise_N = 1e-3;
    placed.phi = phi;
    Recording clean = test::placed(placed);
    if (softened) {
      // Elastic, and softer behind the largest depth: nothing relaxes (Mullins).
      double deepest = 0.0;
      for (std::size_t i = 0; i < clean.drive.size(); ++i) {
        deepest = std::max(deepest, clean.drive[i]);
        const double back = (deepest - clean.drive[i]) / 1e-3;
        clean.response[i] =
            80e-3 * std::pow(clean.drive[i] / 1e-3, 1.3) * (1.0 - 0.35 * std::tanh(back));
      }
    }
    Random random(seed);
    return prepare_recording("made.csv", test::measured(placed, std::move(clean), random));
  };
  SECTION("softening is no relaxation") {
    const Selection s = selected_law("hertz-1", triangle(65, 0.0, true));
    const LawAdequacy& adequacy = best_of(s).adequacy.value();
    CHECK(adequacy.is_rejected());
    REQUIRE_FALSE(adequacy.causes.empty());
    CHECK(adequacy.causes.back().code == "unloading_differs");
    CHECK_THAT(adequacy.summary, Contains("the unloading is not what this law predicts: off by "));
    CHECK_FALSE(s.candidates.front().identified);
    for (const ParameterResult& p : best_of(s).parameters) CHECK(p.only_if_described);
  }
  SECTION("the uncertainty of the parameters belongs to the prediction") {
    constexpr int kRecordings = 20, kMost = 2;  // 3 or more of 20 at 1 %: 1 in 1000
    for (const double phi : {0.0, 0.9}) {
      int rejected = 0, tested = 0;
      for (int i = 0; i < kRecordings; ++i) {
        const PreparedRecording recording =
            triangle(700 + static_cast<std::uint64_t>(i), phi, false);
        const Selection s = selected_linear_1(recording);
        const auto tests = test_unloading(best_of(s), data_sets(std::span(&recording, 1)));
        tested += static_cast<int>(tests.size());
        if (!tests.empty() && tests.front().p_value < 0.01) ++rejected;
      }
      CHECK(tested == kRecordings);
      CHECK(rejected <= kMost);
    }
  }
}
