// A recording of stress and strain in which the stress was imposed is fitted as creep.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <utility>

#include "creep_recordings.hpp"
#include "fitted_parameter.hpp"
#include "placed_recordings.hpp"
#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::CreepTrial;
using test::PlacedTest;
using test::PressTrial;

namespace {

PreparedRecording prepared_creep(const CreepTrial& trial) {
  Recording r = test::creep_recording_of(trial);
  r.header.sha256 = std::string(64, 'c');
  return prepare_recording("creep.csv", std::move(r));
}

FitResult creep_fit(std::span<const PreparedRecording> recordings) {
  SetupOptions setup;
  setup.starts = 4;
  setup.profiles = false;
  FitResult fit = run_fit(recording_config(parse_law_name("linear-1", "test"), recordings, setup),
                          data_sets(recordings));
  state_adequacy(fit, recordings);
  return fit;
}

}  // namespace

TEST_CASE("the closed form of creep is the law's answer to the ramped stress", "[creep]") {
  CreepTrial trial;
  trial.noise = 0.0;
  const Recording r = with_imposed_load(test::creep_recording_of(trial));
  LawSpec spec = parse_law_name("linear-1", "test");
  spec.drive = Quantity::strain;
  spec.response = Quantity::stress;
  spec.reference = 0.05;
  const Eigen::VectorXd strain =
      LawModel(spec)
          .respond(imposed_history(r), r.time_s, std::vector{2000.0, 3000.0, 5.0, 0.0, 0.0},
                   Want::values)
          .value;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    CHECK_THAT(strain[static_cast<Eigen::Index>(i)], WithinAbs(r.response[i], 1e-10));
  }
}

TEST_CASE("a stress that was held is imposed, and the strain compared", "[creep]") {
  CreepTrial trial;
  trial.rest_s = 4.0;
  trial.strain_zero = 2e-3;
  const PreparedRecording recording = prepared_creep(trial);
  REQUIRE(recording.load_imposed);
  CHECK(recording.recording.drive_quantity == Quantity::stress);
  CHECK(recording.remarks.front().code == "load_imposed");
  const FitResult fit = creep_fit(std::span(&recording, 1));
  CHECK_THAT(estimate_of(fit, "k_inf"), WithinRel(2000.0, 0.02));
  CHECK_THAT(estimate_of(fit, "k1"), WithinRel(3000.0, 0.06));
  CHECK_THAT(estimate_of(fit, "tau1"), WithinRel(5.0, 0.06));
  CHECK_THAT(estimate_of(fit, "strain_zero"), WithinAbs(2e-3, 3e-4));
  const RecordingFit& r = fit.recordings.front();
  CHECK(r.response_quantity == Quantity::strain);
  CHECK_THAT(r.rms_residual, WithinRel(6e-4, 0.15));
  CHECK(fit.adequacy.value().is_adequate());
  CHECK(std::ranges::none_of(fit.parameters, &ParameterResult::only_if_described));
}

TEST_CASE("creep is fitted with its recovery, where a specimen has no contact to lose", "[creep]") {
  Recording r = test::with_recovery({.noise = 6e-5});
  const double end_s = r.time_s.back();
  const PreparedRecording prepared = prepare_recording("creep.csv", std::move(r));
  REQUIRE(prepared.load_imposed);
  CHECK(prepared.to_s == end_s);
  const FitResult fit = creep_fit({&prepared, 1});
  CHECK_THAT(estimate_of(fit, "k_inf"), WithinRel(2000.0, 3e-3));
  CHECK_THAT(estimate_of(fit, "k1"), WithinRel(3000.0, 1e-2));
  CHECK_THAT(estimate_of(fit, "tau1"), WithinRel(5.0, 1e-2));
}

TEST_CASE("a law of creep says what it was fitted to, and predicts it as it was fitted",
          "[creep]") {
  for (const std::size_t count : {1, 2}) {
    std::vector<PreparedRecording> recordings;
    for (std::size_t i = 0; i < count; ++i) {
      CreepTrial trial;
      trial.stress_Pa = 100.0 * static_cast<double>(i + 1);
      trial.strain_zero = 1e-3;
      trial.seed = 40 + i;
      recordings.push_back(prepared_creep(trial));
      recordings.back().name += std::to_string(i);
      recordings.back().recording.header.sha256 = std::string(64, static_cast<char>('a' + i));
    }
    const FitResult fit = creep_fit(recordings);
    const LawFile law = fitted_law(fit);
    CHECK(law.fitted_to.value() < 0.11);  // a strain, not a stress
    CHECK(law.uncertainty.value().noise.kind == "unknown");
    for (std::size_t i = 0; i < count; ++i) {
      const LawPrediction p = predict_recording(law, recordings[i], {});
      CHECK(p.placement == Placement::fitted);
      CHECK_THAT(p.recording.value().fitted.rms, WithinRel(fit.recordings[i].rms_residual, 1e-6));
      CHECK(p.reading_lower.empty());
      CHECK(to_json(p).contains("stress_Pa"));
    }
  }
}

TEST_CASE("creep of an indentation is predicted as it was fitted", "[creep]") {
  for (const double power : {1.5, 2.0}) {
    for (const std::size_t count : {1, 2}) {
      CAPTURE(power, count);
      std::vector<PreparedRecording> recordings;
      for (std::size_t i = 0; i < count; ++i) {
        test::PressTrial trial;
        trial.power = power;
        trial.creep.seed = 60 + i;
        trial.contact_m = 1e-3 * static_cast<double>(i + 1);
        Recording r = test::press_recording_of(trial);
        r.header.sha256 = std::string(64, static_cast<char>('a' + i));
        recordings.push_back(prepare_recording(fmt::format("press{}.csv", i), std::move(r)));
        REQUIRE(recordings.back().load_imposed);
      }
      SetupOptions setup;
      setup.starts = 4;
      setup.profiles = false;
      setup.reference = 4e-3;
      setup.exponent = power;
      const FitResult fit =
          run_fit(recording_config(parse_law_name("power-1", "test"), recordings, setup),
                  data_sets(recordings));
      const LawFile law = fitted_law(fit);
      for (std::size_t i = 0; i < count; ++i) {
        const LawPrediction p = predict_recording(law, recordings[i], {});
        CHECK(p.placement == Placement::fitted);
        CHECK_THAT(p.recording.value().fitted.rms, WithinRel(fit.recordings[i].rms_residual, 1e-6));
      }
    }
  }
}

TEST_CASE("the written configuration of a creep fit is read as it was", "[creep]") {
  const test::TempFolder folder;
  const Recording r = test::creep_recording_of({});
  std::string text = "time [s],strain [-],stress [Pa]\n";
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    text += fmt::format("{:.1f},{:.17g},{:.17g}\n", r.time_s[i], r.drive[i], r.response[i]);
  }
  write_file(folder / "creep.csv", text);
  const PreparedRecording one = prepare_recording((folder / "creep.csv"), r);
  SetupOptions setup;
  setup.starts = 4;
  setup.profiles = false;
  const std::span<const PreparedRecording> span(&one, 1);
  const FitConfig config = recording_config(parse_law_name("linear-1", "test"), span, setup);
  const Json written = config_json(config);
  CHECK(written.at("data").front().at("imposed") == "response");
  write_file(folder / "config.json", to_text(written));
  const FitResult again = fit_and_judge(read_fit_problem(folder / "config.json"));
  REQUIRE(one.remarks.size() == 1);
  CHECK(one.remarks.front().code == "load_imposed");
  CHECK(again.remarks.front() == one.remarks.front());
  CHECK_THAT(estimate_of(again, "k1"),
             WithinRel(estimate_of(run_fit(config, data_sets(span)), "k1"), 1e-4));
}

TEST_CASE("what takes an imposed strain only refuses creep", "[creep]") {
  CHECK_THROWS_WITH(identify(prepared_creep({}), {}),
                    Contains("the stress was imposed") && Contains("identification"));
}

TEST_CASE("a strain that was held is imposed however noisy it is", "[creep]") {
  // Relaxation: the strain stands and the stress falls.
  Recording r;
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  Random random(5);
  for (int i = 0; i <= 300; ++i) {
    const double t = 0.1 * i;
    r.time_s.push_back(t);
    r.drive.push_back(0.01 * std::min(t, 1.0) + 1e-4 * random.normal());
    r.response.push_back(20.0 * std::min(t, 1.0) +
                         (t > 1.0 ? 30.0 * std::exp((1.0 - t) / 5.0) : 30.0 * t));
  }
  const PreparedRecording recording = prepare_recording("relaxation", r);
  CHECK_FALSE(recording.load_imposed);
  CHECK(recording.recording.drive_quantity == Quantity::strain);
}

TEST_CASE("a force that was held on an indentation is imposed, and the depth compared", "[creep]") {
  for (const double power : {1.5, 2.0}) {
    for (const double rest_s : {0.0, 4.0}) {
      CAPTURE(power, rest_s);
      test::PressTrial trial;
      trial.power = power;
      trial.creep.rest_s = rest_s;
      if (rest_s == 0.0) trial.zero_N = 0.0;
      const PreparedRecording recording =
          prepare_recording("press.csv", test::press_recording_of(trial));
      REQUIRE(recording.load_imposed);
      CHECK(recording.recording.drive_quantity == Quantity::contact_force);
      CHECK(recording.remarks.front().code == "load_imposed");
      SetupOptions setup;
      setup.starts = 4;
      setup.reference = trial.reference_m;
      setup.exponent = power;
      const std::span<const PreparedRecording> span(&recording, 1);
      const FitResult fit = run_fit(
          recording_config(parse_law_name("power-1", "test"), span, setup), data_sets(span));
      for (const auto& [name, truth] : {std::pair<std::string, double>{"k_inf", 2000.0},
                                        {"k1", 3000.0},
                                        {"tau1", 5.0},
                                        {"contact", 1e-3}}) {
        CAPTURE(name);
        const auto p = std::ranges::find_if(
            fit.parameters,
            [&, &key = name](const ParameterResult& q) { return q.parameter.name == key; });
        REQUIRE(p != fit.parameters.end());
        REQUIRE(p->standard_error);
        CHECK_THAT(p->estimate, WithinAbs(truth, 3.0 * *p->standard_error));
        CHECK(*p->standard_error < 0.1 * truth);
      }
      CHECK_THAT(fit.recordings.front().rms_residual, WithinRel(4e-5, 0.15));
    }
  }
}

TEST_CASE("creep under a force that is as noisy as the depth is said to be creep", "[creep]") {
  test::PressTrial trial;
  trial.noise_N = 0.08;  // 1 % of the force, as of the depth
  const PreparedRecording noisy = prepare_recording("press.csv", test::press_recording_of(trial));
  CHECK_FALSE(noisy.load_imposed);
  CHECK_THAT(std::string(test::remark_text(noisy.remarks, "both_channels_noisy")),
             Contains("the force is too noisy to be taken as imposed (it was held while the depth "
                      "went on: creep)") &&
                 Contains("The fit takes the depth as exact: the noise of the depth makes fast "
                          "branches look weaker"));
}

TEST_CASE(
    "nothing widens the bounds of a contact under a dead weight, and on one it is undetermined",
    "[creep][bounds]") {
  // A weight is put down between two samples: how deep it went at once is elastic, or was not yet
  // contact. The force is straight in the depth.
  constexpr double kContact_m = 1e-3, kNoise_m = 2e-6;
  const auto dead_weight = [&](int samples_at_rest) {
    Recording r;
    r.header.id = "weight";
    r.drive_quantity = Quantity::indentation_depth;
    r.response_quantity = Quantity::contact_force;
    Random random(29);
    for (int i = -samples_at_rest; i <= 300; ++i) {
      // A force of 2 N on 2 kN/m beside 3 kN/m that relax in 5 s: retarded in 12.5 s.
      const double t = 0.1 * i;
      const double creep = t < 0.0 ? 0.0 : 1e-3 - 6e-4 * std::exp(-t / 12.5);
      r.time_s.push_back(0.1 * (i + samples_at_rest));
      r.drive.push_back(kContact_m + creep + kNoise_m * random.normal());
      r.response.push_back(t < 0.0 ? 0.0 : 2.0);
    }
    return prepare_recording("weight.csv", r);
  };
  const PreparedRecording one = dead_weight(20);
  REQUIRE(one.load_imposed);
  REQUIRE(samples_before_load(one.recording) >= 19);
  const std::span<const PreparedRecording> span(&one, 1);
  SetupOptions setup;
  setup.starts = 4;
  for (const char* law : {"linear-1", "hertz-1"}) {
    CAPTURE(law);
    const FitResult fit =
        run_fit(recording_config(parse_law_name(law, "test"), span, setup), data_sets(span));
    const ParameterResult& contact = test::find(fit, "contact");
    CHECK_FALSE(contact.first_bounds);
    // The probe rested at the contact, and under the weight it was 0.4 mm deeper.
    CHECK_THAT(contact.parameter.lower, WithinAbs(kContact_m, 10.0 * kNoise_m));
    CHECK_THAT(contact.parameter.upper, WithinAbs(kContact_m + 4e-4, 1e-5));
    if (std::string(law) == "linear-1") continue;
    // A straight force wants the contact of a Hertz kernel far before the specimen.
    REQUIRE(contact.at_lower_bound);
    CHECK_THAT(std::string(test::remark_text(fit.remarks, "contact_undetermined")),
               Contains("contact is undetermined by this recording") &&
                   Contains("not identified: k_inf, k1, tau1"));
    for (const char* name : {"k1", "tau1"}) {
      CHECK_THAT(test::find(fit, name).unconfirmed.value().text,
                 Contains("contact is undetermined"));
      CHECK_THAT(verdict_text(test::find(fit, name)), StartsWith("not identified: "));
      CHECK_THAT(test::find(fit, name).summary, !Contains("is identified"));
    }
  }
}

TEST_CASE("laws that take longer than all others together are left out of the family, and said",
          "[creep]") {
  const PreparedRecording one = prepare_recording("press.csv", test::press_recording_of({}));
  REQUIRE(one.recording.time_s.size() > 100);
  SelectionOptions options;
  options.held_out = false;
  options.setup.starts = 1;
  options.setup.profiles = false;
  const Selection s = select_law(std::span(&one, 1), options);
  const auto said = std::ranges::find(s.remarks, "laws_not_tried", &Remark::code);
  REQUIRE(said != s.remarks.end());
  for (const LawSpec& law : classical_family()) {
    const bool tried = std::ranges::any_of(
        s.candidates, [&](const Candidate& c) { return law_name(c.law) == law_name(law); });
    CAPTURE(law_name(law));
    CHECK(tried == (law.tension == Tension::none || law.branches == 0));
    if (!tried) CHECK_THAT(said->text, Contains(law_name(law)));
  }
}

TEST_CASE("an indentation whose depth was held is no creep, however noisy it is", "[creep]") {
  test::PressTrial trial;
  Recording r = test::press_recording_of(trial);
  Random random(6);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double since = std::max(r.time_s[i] - 4.0, 0.0);
    r.drive[i] = 2e-3 * std::min(since, 2.0) + 4e-5 * random.normal();
    r.response[i] = std::min(since, 2.0) + std::min(since, 2.0) * std::exp(-since / 5.0);
  }
  CHECK_FALSE(prepare_recording("press.csv", r).load_imposed);
}

TEST_CASE("where no rest tells a drift of a strain or a stress, k_inf is not identified",
          "[creep]") {
  SetupOptions setup;
  setup.starts = 4;
  const LawSpec law = parse_law_name("linear-1", "test");
  {
    // Creep whose strain drifts by 1e-4/s: 6 % of what it reaches.
    Recording r = test::creep_recording_of({.noise = 6e-5});
    for (std::size_t i = 0; i < r.time_s.size(); ++i) r.drive[i] += 1e-4 * r.time_s[i];
    const PreparedRecording one = prepare_recording("creep.csv", r);
    REQUIRE(one.load_imposed);
    const std::span<const PreparedRecording> span(&one, 1);
    FitResult fit = run_fit(recording_config(law, span, setup), data_sets(span));
    CHECK(std::abs(estimate_of(fit, "k_inf") - 2000.0) > 50.0);  // the drift is in the plateau
    for (const ParameterResult& p : fit.parameters) {
      CHECK(p.not_separable.has_value() == (p.parameter.name == "k_inf"));
      if (p.not_separable) CHECK(p.not_separable->code == kDriftOrBranch);
    }
    const auto both = give_both_drift_answers(fit, span);
    REQUIRE(both);
    // The second answer is that of the search anywhere, not where the first one stood.
    CHECK_THAT(both->drifting.value(), WithinRel(2000.0, 0.1));
    CHECK_THAT(both->drift_per_s.front(), WithinRel(1e-4, 0.2));
    for (const char* name : {"k1", "tau1"}) {
      const ParameterResult& p = find(fit, name);
      if (p.not_separable) continue;
      REQUIRE(p.with_drift);
      const double truth = p.parameter.name == "k1" ? 3000.0 : 5.0;
      CHECK(p.lower.value_or(0.0) < truth);
      CHECK(p.upper.value_or(HUGE_VAL) > truth);
    }
  }
  for (const double rest_s : {0.0, 10.0}) {
    CAPTURE(rest_s);
    // Relaxation under a held strain, stress drifting by 0.5 Pa/s.
    Recording r;
    r.drive_quantity = Quantity::strain;
    r.response_quantity = Quantity::stress;
    Random random(9);
    for (int i = 0; 0.1 * i <= rest_s + 30.0; ++i) {
      const double t = 0.1 * i - rest_s;
      const double ramp = std::clamp(t, 0.0, 2.0);
      const double since = std::max(t, 0.0);
      r.time_s.push_back(0.1 * i);
      r.drive.push_back(0.02 * ramp);
      r.response.push_back(0.02 * (2000.0 * ramp + 3000.0 * 2.0 * (1.0 - std::exp(-ramp / 2.0)) *
                                                       std::exp(-(since - ramp) / 2.0)) +
                           0.5 * r.time_s.back() + 0.1 * random.normal());
    }
    const PreparedRecording one = prepare_recording("strain.csv", r);
    const std::span<const PreparedRecording> span(&one, 1);
    FitResult fit = run_fit(recording_config(law, span, setup), data_sets(span));
    const auto both = give_both_drift_answers(fit, span);
    REQUIRE(both);
    CHECK_THAT(both->drifting.value(), WithinRel(2000.0, 0.05));
    CHECK_THAT(both->drift_per_s.front(), WithinRel(0.5, 0.2));
    CHECK_THAT(drift_words(*both, fit), Contains("mPa/s") || Contains(" Pa/s"));
  }
}

TEST_CASE("noise of the imposed channel counts in adequacy, of creep and of relaxation",
          "[creep]") {
  const std::uint64_t seed = GENERATE(23, 24, 25, 26);
  CreepTrial trial;
  trial.rest_s = 8.0;
  trial.stress_noise_Pa = 1.0;  // 1 % of its range, as of the strain
  trial.seed = seed;
  const PreparedRecording creep = prepared_creep(trial);
  CHECK(creep.load_imposed);
  const FitResult fit = creep_fit(std::span(&creep, 1));
  INFO(fit.adequacy.value().summary);
  CHECK(fit.adequacy.value().is_adequate());

  PlacedTest pressed;
  pressed.noise_N = 2e-3;
  Random random(seed);
  Recording r = test::measured(pressed, test::placed(pressed), random);
  for (double& depth : r.drive) depth += 4e-5 * random.normal();
  const PreparedRecording relaxing = prepare_recording("made.csv", std::move(r));
  CHECK_FALSE(relaxing.load_imposed);
  const FitResult relaxed = creep_fit(std::span(&relaxing, 1));
  INFO(relaxed.adequacy.value().summary);
  CHECK(relaxed.adequacy.value().is_adequate());
}

TEST_CASE("a law that is wrong by more than the noise of both channels is still told", "[creep]") {
  PlacedTest pressed;
  pressed.material = {60.0, 90.0, 0.5};
  pressed.noise_N = 1e-3;
  Random random(7);
  Recording r = test::measured(pressed, test::placed(pressed), random);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    r.drive[i] += 1e-5 * random.normal();
    if (r.time_s[i] > 7.0) r.response[i] += 0.03 * std::exp(-(r.time_s[i] - 7.0) / 12.0);
  }
  const PreparedRecording recording = prepare_recording("made.csv", std::move(r));
  CHECK(creep_fit(std::span(&recording, 1)).adequacy.value().is_rejected());
}

TEST_CASE("a depth that relaxes under a held force is a force: the titles are swapped", "[creep]") {
  PlacedTest pressed;
  Random random(5);
  Recording r = test::measured(pressed, test::placed(pressed), random);
  std::swap(r.drive, r.response);
  CHECK_THROWS_WITH(prepare_recording("swapped.csv", r),
                    Contains("recording 'swapped.csv': the depth recedes by") &&
                        Contains("titles of force and depth"));
  // Creep whose depth drifts back, straight, or that is unloaded, is none.
  PressTrial creeping;
  Recording drifting = test::press_recording_of(creeping);
  for (std::size_t i = 0; i < drifting.time_s.size(); ++i) {
    drifting.drive[i] -= 1e-4 * drifting.time_s[i];
  }
  CHECK_NOTHROW(prepare_recording("drifting.csv", std::move(drifting)));
}
