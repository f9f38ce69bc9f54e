// Recordings that are conditioned by cycles before the ramp that is held.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>

#include "one_law.hpp"
#include "support/fitted_parameter.hpp"
#include "support/remarks.hpp"
#include "support/temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/validate/comparison.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;

namespace {

/// Two cycles to 4 mm, a rest from 5 to 10 s, and a ramp that is held: linear-1 of 100 N/m, 40 N/m
/// and tau1. The force never pulls.
Recording conditioned(bool held, double tau_s = 0.7) {
  Recording r;
  const auto cycle = [](double t) { return std::max(0.0, 4e-3 * (1.0 - std::abs(t - 1.0))); };
  for (int i = 0; 0.05 * i < (held ? 30.0 : 9.0); ++i) {
    const double t = 0.05 * i;
    r.time_s.push_back(t);
    r.drive.push_back(cycle(t - 1.0) + cycle(t - 3.0) + std::clamp(4e-3 * (t - 10.0), 0.0, 4e-3));
  }
  const LawModel model(parse_law_name("linear-1", "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f =
      model
          .respond(history, r.time_s, std::vector<double>{100.0, 40.0, tau_s, 0.0, 0.0},
                   Want::values)
          .value;
  Random random(7);
  for (const double force : f) r.response.push_back(std::max(0.0, force) + 3e-4 * random.normal());
  return r;
}

struct CycledTrial {
  bool glued = false;   ///< the force pulls on withdrawal; else contact is lost
  double rest_s = 5.0;  ///< between the cycles and the ramp that is held
};

/// The same cycles: 100 N/m, 40 N/m, 0.7 s.
Recording cycled(const CycledTrial& trial) {
  constexpr double kStep_s = 0.05, kTau_s = 0.7;
  const auto cycle = [](double t) { return std::max(0.0, 4e-3 * (1.0 - std::abs(t - 1.0))); };
  Recording r;
  Random random(7);
  double branch = 0.0, before = 0.0;
  for (int i = 0; kStep_s * i < 25.0 + trial.rest_s; ++i) {
    const double t = kStep_s * i, ramp = 4e-3 * (t - 5.0 - trial.rest_s);
    const double depth = cycle(t - 1.0) + cycle(t - 3.0) + std::clamp(ramp, 0.0, 4e-3);
    const double left = std::exp(-kStep_s / kTau_s);
    branch = branch * left + 40.0 * (depth - before) * kTau_s / kStep_s * (1.0 - left);
    before = depth;
    const double force = 100.0 * depth + branch;
    r.time_s.push_back(t);
    r.drive.push_back(depth);
    r.response.push_back((trial.glued ? force : std::max(0.0, force)) + 3e-4 * random.normal());
  }
  return r;
}

Selection selected(const PreparedRecording& recording, std::optional<double> contact) {
  SetupOptions setup;
  setup.contact = contact;
  return test::select_one("linear-1", recording, setup);
}

Selection fitted(const Recording& recording, std::optional<double> contact) {
  return selected(prepare_recording("cycles.csv", recording), contact);
}

void write_csv(const std::string& file, const Recording& recording) {
  std::ofstream table(file);
  table.precision(17);
  table << "Time (s),Depth (m),Force (N)\n";
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    table << recording.time_s[i] << ',' << recording.drive[i] << ',' << recording.response[i]
          << '\n';
  }
}

/// A file of which the reading keeps the samples from 8 s on, in the rest.
PreparedRecording kept_from_rest(const std::string& file) {
  ImportOptions import;
  import.from_s = 8.0;
  PreparedRecording r = prepare_recording(file, read_recording_file(file, import).recording);
  r.import = import;
  return r;
}

Selection fitted_from_rest(const std::string& file, const Recording& recording) {
  write_csv(file, recording);
  return selected(kept_from_rest(file), 0.0);
}

}  // namespace

TEST_CASE("A hold after conditioning cycles is said to be left out, and how it is fitted") {
  const Recording recording = conditioned(true);
  const Selection whole = fitted(recording, std::nullopt);
  CHECK_FALSE(test::has_remark(whole.remarks, "no_hold"));
  const std::string said(test::remark_text(whole.remarks, "hold_not_fitted"));
  CHECK_THAT(said, Contains("cycles.csv: a hold of 19") && Contains("(11 to 29.95 s)") &&
                       Contains("2 ramps after the first unloading (from 2 s) are not fitted"));

  // What it says to type, at the times and depths that it names.
  const auto number_after = [&said](const std::string& option) {
    const std::size_t at = said.find(option + " \"");
    REQUIRE(at != std::string::npos);
    return std::stod(said.substr(at + option.size() + 2));
  };
  const double from_s = number_after("--from-time");
  const double contact = 1e-3 * number_after("--contact");
  CHECK((from_s > 5.0 && from_s < 10.0));  // in the rest
  CHECK(std::abs(contact) < 0.1e-3);
  Recording last = recording;
  const auto kept = std::ranges::lower_bound(recording.time_s, from_s) - recording.time_s.begin();
  for (std::vector<double>* values : {&last.time_s, &last.drive, &last.response}) {
    values->erase(values->begin(), values->begin() + kept);
  }
  const Selection ramp = fitted(last, contact);
  CHECK_FALSE(test::has_remark(ramp.remarks, "hold_not_fitted"));
  const auto& parameters = ramp.candidates.front().fit.parameters;
  const auto k_inf = std::ranges::find(parameters, "k_inf",
                                       [](const ParameterResult& p) { return p.parameter.name; });
  REQUIRE(k_inf != parameters.end());
  CHECK((*k_inf->lower < 100.0 && 100.0 < *k_inf->upper));
}

TEST_CASE(
    "Loads that the window of a reading leaves out leave nothing identified until forgotten") {
  const test::TempFolder folder;
  const std::string code = "history_before_window";
  // The cycles end 5 s before the ramp: 7 relaxation times.
  const Selection after = fitted_from_rest(folder / "short.csv", conditioned(true, 0.7));
  const FitResult& forgotten = after.candidates.front().fit;
  CHECK_FALSE(test::has_remark(forgotten.remarks, code));
  CHECK_FALSE(find(forgotten, "k1").unconfirmed);

  // A third of one: the interval of k1 excludes the truth.
  const Selection within = fitted_from_rest(folder / "long.csv", conditioned(true, 12.0));
  const Candidate& chosen = within.candidates.front();
  const ParameterResult& k1 = find(chosen.fit, "k1");
  REQUIRE(k1.unconfirmed);
  CHECK(k1.unconfirmed->code == code);
  CHECK_THAT(k1.summary, Contains("not identified: history before the window is not in the fit"));
  CHECK_FALSE(find(chosen.fit, "offset").unconfirmed);
  CHECK_FALSE(chosen.identified);
  CHECK_THAT(std::string(test::remark_text(chosen.fit.remarks, code)),
             Contains("a load ended at 4.9") && Contains("tau1"));
  CHECK(test::has_remark(fit_and_judge({chosen.fit.config, {}}).remarks, code));  // config.json

  // "from" of a configuration leaves out the same samples and keeps their history.
  FitConfig config = chosen.fit.config;
  config.choice.reset();
  config.data.front().import.from_s.reset();
  const FitResult whole = fit_and_judge({config, {}});
  CHECK_FALSE(test::has_remark(whole.remarks, code));
  const ParameterResult& right = find(whole, "k1");
  CHECK_FALSE(right.unconfirmed);
  REQUIRE((right.lower && right.upper));
  CHECK((*right.lower < 40.0 && 40.0 < *right.upper));
}

TEST_CASE("Predictions and comparisons name a load that the window of a reading leaves out") {
  const test::TempFolder folder;
  const std::string code = "history_before_window";
  const std::string file = folder / "cycles.csv";
  for (const double tau_s : {0.7, 12.0}) {
    CAPTURE(tau_s);
    const bool remembered = tau_s > 5.0;
    write_csv(file, conditioned(true, tau_s));
    const PreparedRecording cut = kept_from_rest(file);
    // A law that was fitted to another recording.
    const LawFile law =
        fitted_law(fitted(conditioned(true, tau_s), std::nullopt).candidates.front().fit);
    CHECK(test::has_remark(predict_recording(law, cut, {}).remarks, code) == remembered);
    const RecordingComparison compared = compare_with_recording(law, cut, {});
    CHECK((compared.verdict == ModelVerdict::undetermined) >= remembered);
    for (const QuantityComparison& q : compared.quantities) {
      CAPTURE(q.name);
      CHECK((q.remark && q.remark->code == code) == remembered);
      if (remembered) CHECK(q.unknown);
    }
    CHECK(test::has_remark(contact_budget(law, cut, {}).remarks, code) == remembered);
    IdentifyOptions options;
    options.laws = {law.spec};
    CHECK(test::has_remark(identify(cut, options).remarks, code) == remembered);
    const PreparedRecording whole =
        prepare_recording(file, read_recording_file(file, {}).recording);
    CHECK_FALSE(test::has_remark(predict_recording(law, whole, {}).remarks, code));
  }
}

TEST_CASE("A specimen that pulls in the history before the fitted part leaves nothing identified") {
  for (const bool glued : {false, true}) {
    for (const double rest_s : {1.5, 12.0}) {
      const PreparedRecording recording =
          prepare_recording("cycles.csv", cycled({.glued = glued, .rest_s = rest_s}));
      FitConfig config = recording_config(parse_law_name("linear-1", "test"),
                                          std::span(&recording, 1), SetupOptions{});
      config.data.front().from_s = 5.0 + rest_s - 0.5;  // in the rest behind the cycles
      config.data.front().to_s = recording.recording.time_s.back();
      const FitResult fit = fit_and_judge({config, {recording.recording}});
      CAPTURE(glued, rest_s);
      // What pulled 5 relaxation times before is forgotten.
      const bool doubted = glued && rest_s < 2.0;
      CHECK(test::has_remark(fit.remarks, "pulled_history") == doubted);
      for (const char* name : {"k1", "tau1"}) {
        CAPTURE(name);
        const ParameterResult& p = find(fit, name);
        CHECK(p.unconfirmed.has_value() == doubted);
        if (doubted) CHECK_THAT(verdict_text(p), Contains("the specimen pulls"));
      }
    }
  }
}

TEST_CASE("Cycles without a hold are told as such") {
  const Selection s = fitted(conditioned(false), std::nullopt);
  CHECK(test::has_remark(s.remarks, "no_hold"));
  CHECK_FALSE(test::has_remark(s.remarks, "hold_not_fitted"));
}

TEST_CASE("The first line names an unloading that the law of the hold does not describe") {
  constexpr double kUnload_s = 15.0, kLost = 0.8;  // of the force, where the probe goes back
  for (const bool lost : {false, true}) {
    CAPTURE(lost);
    Recording r;
    for (int i = 0; 0.05 * i < 19.0; ++i) {
      const double t = 0.05 * i;
      r.time_s.push_back(t);
      r.drive.push_back(std::clamp(4e-3 * (t - 3.0), 0.0, 4e-3) -
                        std::clamp(1e-3 * (t - kUnload_s), 0.0, 3e-3));
    }
    const Eigen::VectorXd f =
        LawModel(parse_law_name("linear-1", "test"))
            .respond(measured_history(Drive::displacement, r.time_s, r.drive), r.time_s,
                     std::vector<double>{100.0, 40.0, 0.7, 0.0, 0.0}, Want::values)
            .value;
    Random random(7);
    for (std::size_t i = 0; i < r.time_s.size(); ++i) {
      const double share = lost && r.time_s[i] > kUnload_s ? kLost : 1.0;
      r.response.push_back(share * f[static_cast<Eigen::Index>(i)] + 3e-4 * random.normal());
    }
    const Selection s = fitted(r, std::nullopt);
    const std::optional<LawAdequacy>& adequacy = s.candidates[s.recommended].fit.adequacy;
    REQUIRE(adequacy);
    CAPTURE(adequacy->summary);
    CHECK(adequacy->is_adequate());  // of what was fitted
    CHECK_THAT(adequacy->summary, Contains("the law describes this recording"));
    CHECK((adequacy->summary.find("; not the unloading and what follows: off by ") !=
           std::string::npos) == lost);
  }
}
