// From a recording to the simplest law, its configuration and its figures' data.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

#include "one_law.hpp"
#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/select/file_remarks.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

/// Ramp and hold of a law with 0.5 % noise, a few samples before contact.
Recording simulated_press(const std::string& law, const std::vector<double>& values,
                          std::uint64_t seed) {
  Recording r;
  for (int i = 0; i < 240; ++i) {
    const double t = 0.1 * i;
    r.time_s.push_back(t);
    r.drive.push_back(std::min(5e-3, std::max(0.0, 2e-3 * (t - 1.0))));
  }
  const LawModel model(parse_law_name(law, "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f = model.respond(history, r.time_s, values, Want::values).value;
  Random random(seed);
  for (const double force : f) r.response.push_back(force + 0.005 * f.maxCoeff() * random.normal());
  return r;
}

SelectionOptions few_laws() {
  return test::only({"linear", "linear-1", "linear-2", "power", "power-1", "power-2"});
}

}  // namespace

TEST_CASE("select returns the law behind a recording and says what the protocol hides",
          "[select]") {
  const std::vector<PreparedRecording> one{prepare_recording(
      "one.csv", simulated_press("linear-2", {100.0, 120.0, 80.0, 0.4, 6.0, 0.0, 0.0}, 4))};
  const Selection s = select_law(one, few_laws());
  const Candidate& chosen = s.candidates[s.recommended];
  CHECK(law_name(chosen.law) == "linear-2");
  CHECK(chosen.identified);
  CHECK(chosen.rms_over_peak < 0.006);
  for (const ParameterResult& p : chosen.fit.parameters) {
    if (p.parameter.name == "k_inf") CHECK((*p.lower < 100.0 && 100.0 < *p.upper));
    if (p.parameter.name == "tau2") CHECK((*p.lower < 6.0 && 6.0 < *p.upper));
  }
  CHECK(test::has_remark(s.remarks, "shorter_than_ramp"));  // 0.4 s under a ramp of 2.5 s
}

TEST_CASE("one point of a profile tells whether the interval holds a value", "[select]") {
  const std::vector<PreparedRecording> one{
      prepare_recording("one.csv", simulated_press("linear-1", {100.0, 120.0, 3.0, 0.0, 0.0}, 5))};
  ExperimentResiduals function(recording_config(parse_law_name("linear-1", "test"), one, {}),
                               data_sets(one));
  const FitResult fit = fit_experiments(function);
  function.set_prior_weight(std::sqrt(fit.inflation * fit.variance_factor));
  std::vector<FitParameter> parameters;
  for (const ParameterResult& p : fit.parameters) parameters.push_back(p.parameter);
  Threshold threshold;
  threshold.scale_known = false;
  threshold.data_count = fit.value_count + prior_count(fit.config);
  threshold.parameter_count = static_cast<int>(parameters.size());
  threshold.inflation = fit.inflation;
  const double rise = threshold.rise(fit.best.deviance);
  const std::vector<std::vector<double>> starts{fit.best.natural};
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    if (p.parameter.name == "offset" || p.parameter.name == "contact") continue;
    INFO(p.parameter.name);
    for (const double limit : {p.lower.value(), p.upper.value()}) {
      const double risen =
          profile_deviance(function, parameters, starts, i, limit) - fit.best.deviance;
      CHECK_THAT(risen, WithinRel(rise, 2e-3));  // the weight of priors is settled to 1e-3
    }
  }
}

TEST_CASE("the printed configuration gives the same fit again", "[select]") {
  const test::TempFolder folder;
  Recording r = simulated_press("linear-1", {100.0, 120.0, 3.0, 0.0, 0.0}, 7);
  std::string csv = "time [s],depth [mm],force [N]\n";
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    csv += fmt::format("{},{},{}\n", r.time_s[i], 1e3 * r.drive[i], r.response[i]);
  }
  const std::string path = (folder.path() / "r.csv").string();
  write_file(path, csv);
  const std::vector<PreparedRecording> one{prepare_recording(path, r)};
  const FitConfig config = recording_config(parse_law_name("linear-1", "test"), one, {});
  const FitResult direct = run_fit(config, data_sets(one));
  const FitResult again = run_fit(parse_fit_config(config_json(config), "config"));
  REQUIRE(again.best.natural.size() == direct.best.natural.size());
  for (std::size_t i = 0; i < direct.best.natural.size(); ++i) {
    CHECK(std::abs(again.best.natural[i] - direct.best.natural[i]) <=
          1e-5 * std::abs(direct.best.natural[i]) + 1e-9);
  }
}

TEST_CASE("a written configuration warns of what the direct fit warns of", "[select]") {
  // A branch that relaxes within the ramp, one that outlasts the hold, an unloading that no law
  // describes; and a row without a force, or a force cell of known gain.
  Recording r = simulated_press("linear-2", {100.0, 120.0, 80.0, 0.4, 9.0, 0.0, 0.0}, 4);
  for (int i = 0; i < 20; ++i) {
    r.time_s.push_back(r.time_s.back() + 0.1);
    r.drive.push_back(r.drive.back() - 2.5e-4);
    r.response.push_back(0.9 * r.response.back());
  }
  const bool described = GENERATE(true, false);
  const test::TempFolder folder;
  std::string csv = "time [s],depth [mm],force [N]\n";
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    csv += i == 100 && !described
               ? fmt::format("{},{},\n", r.time_s[i], 1e3 * r.drive[i])
               : fmt::format("{},{},{}\n", r.time_s[i], 1e3 * r.drive[i], r.response[i]);
  }
  const std::string path = (folder.path() / "r.csv").string();
  write_file(path, csv);
  if (described) {
    write_file(folder / "r.json", R"j({"id": "r", "title": "made", "kind": "recording",
      "observable": "contact_force", "provenance": "assumed", "columns": {
        "time [s]": {"quantity": "time", "unit": "s"},
        "depth [mm]": {"quantity": "indentation_depth", "unit": "mm"},
        "force [N]": {"quantity": "contact_force", "unit": "N"}},
      "instrument": {"id": "cell", "force": "1 % of reading (standard)"}})j");
  }
  RecordingFile file = read_recording_file(path, {});
  PreparedRecording one = prepare_recording(path, std::move(file.recording));
  warn_of_rows_left_out(one, file.findings);
  take_instrument(one, path);
  const Selection s = test::select_one("linear-2", one);
  const FitResult& direct = s.candidates[s.recommended].fit;
  write_file(folder / "config.json", to_text(config_json(direct.config)));
  const FitResult again = fit_and_judge(read_fit_problem(folder / "config.json"));
  CAPTURE(remark_texts(s.remarks), remark_texts(again.remarks));
  for (const char* code : {"shorter_than_ramp", "long_for_hold", "not_described_after_fit",
                           described ? "gain_not_in_intervals" : "rows_left_out"}) {
    CAPTURE(code);
    CHECK(test::has_remark(s.remarks, code));
  }
  REQUIRE(again.remarks.size() >= s.remarks.size());
  for (std::size_t i = 0; i < s.remarks.size(); ++i) CHECK(again.remarks[i] == s.remarks[i]);
}

TEST_CASE("a written configuration keeps the force at which contact was said to begin",
          "[select]") {
  const Recording r = simulated_press("linear-1", {100.0, 120.0, 0.4, 0.0, 0.0}, 4);
  PhaseOptions phases;
  phases.contact_response = 0.2 * *std::ranges::max_element(r.response);
  const PreparedRecording one = prepare_recording("r.csv", r, phases);
  REQUIRE(one.contact_held);
  const Selection s = test::select_one("linear-1", one);
  const FitConfig read =
      parse_fit_config(config_json(s.candidates[s.recommended].fit.config), "test");
  CHECK_THAT(read.data.front().contact_response.value(),
             WithinRel(phases.contact_response.value(), 1e-12));
  const FitResult again = fit_and_judge({read, {r}});
  // The ramp begins at that force in both.
  REQUIRE(test::has_remark(s.remarks, "shorter_than_ramp"));
  const auto ramp = [](const std::vector<Remark>& remarks) {
    return *std::ranges::find(remarks, std::string("shorter_than_ramp"), &Remark::code);
  };
  CHECK(ramp(again.remarks) == ramp(s.remarks));
}

TEST_CASE("one specimen's recording is told from the spread between specimens", "[select]") {
  std::vector<PreparedRecording> specimens;
  for (const double stiffness : {80.0, 100.0, 125.0, 110.0}) {
    specimens.push_back(
        prepare_recording(fmt::format("{}.csv", stiffness),
                          simulated_press("linear-1", {stiffness, 1.2 * stiffness, 3.0, 0.0, 0.0},
                                          static_cast<std::uint64_t>(stiffness))));
  }
  SetupOptions setup;
  setup.profiles = false;
  SelectionOptions options;
  options.setup = setup;
  const SpecimenStudy study =
      study_specimens(specimens, parse_law_name("linear-1", "test"), options);
  REQUIRE(study.pooled.size() == 3);
  const RandomEffects& k_inf = study.pooled[0].effects;
  CHECK(k_inf.specimens == 4);
  CHECK_THAT(std::exp(k_inf.mean), WithinRel(102.4, 0.03));   // geometric mean
  CHECK(std::sqrt(*k_inf.tau_squared) > 0.1);                 // they do differ
  CHECK(study.pooled[2].effects.tau_squared.value() < 0.01);  // the time is one
}

TEST_CASE("branches are pooled by their times, however a fit numbers them", "[select]") {
  std::vector<PreparedRecording> specimens;
  for (int i = 0; i < 4; ++i) {
    specimens.push_back(
        prepare_recording(fmt::format("{}.csv", i),
                          simulated_press("linear-2", {100.0, 120.0, 80.0, 0.4, 6.0, 0.0, 0.0},
                                          static_cast<std::uint64_t>(40 + i))));
  }
  SelectionOptions options;
  options.setup.profiles = false;
  const SpecimenStudy study =
      study_specimens(specimens, parse_law_name("linear-2", "test"), options);
  const std::size_t tau1 = 3;
  for (const SpecimenRow& row : study.rows) {
    REQUIRE(row.fit);
    REQUIRE(row.parameter(tau1).parameter.name.starts_with("tau"));
    CHECK(row.parameter(tau1).estimate < row.parameter(tau1 + 1).estimate);
    CHECK(row.parameter(1).parameter.name.back() == row.parameter(tau1).parameter.name.back());
  }
  for (const PooledParameter& p : study.pooled) {
    const double typical = p.parameter.natural(p.effects.mean);
    if (p.parameter.name == "tau1") CHECK_THAT(typical, WithinRel(0.4, 0.1));
    if (p.parameter.name == "tau2") CHECK_THAT(typical, WithinRel(6.0, 0.05));
    if (p.parameter.name == "k1") CHECK_THAT(typical, WithinRel(120.0, 0.1));
  }
  // A figure for three parameters each; every recording stands in every panel.
  const std::vector<Figure> figures = specimen_figures(study);
  REQUIRE(figures.size() == 2);
  CHECK(figures[0].panels.size() == 3);
  CHECK(figures[1].panels.size() == 2);
  for (const Panel& panel : figures[1].panels) {
    REQUIRE(panel.series.back().label == "estimate of a recording");
    CHECK(panel.series.back().x == std::vector<double>{1, 2, 3, 4});
  }
  CHECK_NOTHROW(to_json(figures));
}

TEST_CASE("a depth of metres is taken for a slip of the unit", "[select]") {
  Recording r = simulated_press("linear-1", {100.0, 120.0, 3.0, 0.0, 0.0}, 6);
  for (double& depth : r.drive) depth *= 1000.0;
  const Selection s =
      test::select_one("linear-1", prepare_recording("slip.csv", r), test::setup_of(40, false));
  REQUIRE_FALSE(s.remarks.empty());
  CHECK(s.remarks.front().code == "unit_doubtful");
}

namespace {

/// The law's answer with fine steps, sampled as often as asked.
Recording sampled(const std::string& law, const std::vector<double>& values, double step_s,
                  double end_s, double noise) {
  Recording r;
  for (int i = 0; i * step_s <= end_s; ++i) {
    r.time_s.push_back(i * step_s);
    r.drive.push_back(std::min(5e-3, std::max(0.0, 5e-3 * (r.time_s.back() - 1.0))));
  }
  const LawModel model(parse_law_name(law, "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f = model.respond(history, r.time_s, values, Want::values).value;
  Random random(17);
  for (const double force : f) r.response.push_back(force + noise * f.maxCoeff() * random.normal());
  return r;
}

Selection selected_among(const Recording& r, std::initializer_list<const char*> laws) {
  SelectionOptions options = test::only(laws);
  options.setup.profiles = false;
  const std::vector<PreparedRecording> one{prepare_recording("r.csv", r)};
  return select_law(one, options);
}

const Candidate& candidate(const Selection& s, const std::string& law) {
  for (const Candidate& c : s.candidates) {
    if (law_name(c.law) == law) return c;
  }
  throw std::runtime_error(law);
}

}  // namespace

TEST_CASE("a law with a relaxation time that the sampling cannot support is not recommended",
          "[select]") {
  // 0.15 s between samples that are 0.1 s apart.
  const Selection s = selected_among(
      sampled("linear-2", {100.0, 300.0, 80.0, 0.15, 6.0, 0.0, 0.0}, 0.1, 30.0, 1e-4),
      {"linear-1", "linear-2"});
  const Candidate& two = candidate(s, "linear-2");
  REQUIRE(two.delta_bic == 0.0);
  CHECK_FALSE(two.identified);
  CHECK(two.reason == "tau1 is sampled by fewer than 3 points");
  // Identified laws compete among themselves, however much better another one is.
  CHECK(candidate(s, "linear-1").delta_bic > 10.0);
  CHECK(law_name(s.candidates[s.recommended].law) == "linear-1");
  CHECK_THAT(fmt::format("{}", fmt::join(s.summary, "\n")),
             Catch::Contains("the data prefer linear-2, by ") &&
                 Catch::Contains(" in BIC, but do not identify its parameters (tau1 is sampled by "
                                 "fewer than 3 points); the simplest law that the protocol "
                                 "does not contradict is linear-1"));
  CHECK_THAT(s.candidates[s.recommended].fit.adequacy.value().summary,
             Catch::Contains("linear-1 does not describe these data: linear-2 does better, by "));
  REQUIRE(s.preferred);
  CHECK(law_name(s.candidates[*s.preferred].law) == "linear-2");
  CHECK(to_json(s)["preferred"]["law"] == "linear-2");
  CHECK_THAT(to_terminal_text(s), Catch::Contains("of the law that the data prefer, linear-2"));
}

TEST_CASE("a stiffness whose interval ends above 0 is identified, whatever its standard error",
          "[select]") {
  Candidate c;
  c.law = parse_law_name("linear-1", "test");
  c.fit.config.law = c.law;
  ParameterResult k1;
  k1.parameter.name = "k1";
  k1.parameter.scale = Scale::linear;
  k1.parameter.lower = 0.0;
  k1.estimate = 0.25;
  k1.standard_error = 0.16;
  k1.verdict = Verdict::not_profiled;
  c.fit.parameters = {k1};
  const ProtocolSpans spans{.hold_s = 10.0};
  CHECK(not_identified(c, spans) == "k1 is less than 2 standard errors above 0");
  c.fit.parameters[0].standard_error.reset();
  CHECK(not_identified(c, spans) == "k1 has no standard error");
  c.fit.parameters[0].lower = 0.05;
  c.fit.parameters[0].upper = 0.76;
  for (const Verdict verdict : {Verdict::identified, Verdict::lower_only}) {
    c.fit.parameters[0].verdict = verdict;
    c.fit.parameters[0].standard_error.reset();
    CHECK(not_identified(c, spans).empty());
    c.fit.parameters[0].standard_error = 0.16;
    CHECK(not_identified(c, spans).empty());
  }
  c.fit.parameters[0].verdict = Verdict::upper_only;
  CHECK_FALSE(not_identified(c, spans).empty());
}

namespace {

/// A weak branch in noise, whose stiffness an interval tells from 0 and a standard error does not.
Recording weak_branch(std::uint32_t seed) {
  auto next = [state = seed]() mutable {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) {
      state = 1664525U * state + 1013904223U;
      sum += state / 4294967296.0;
    }
    return sum;
  };
  Recording r;
  for (int i = 0; i <= 250; ++i) {
    const double t = 0.08 * i, ramp = std::min(t, 2.0);
    r.time_s.push_back(t);
    r.drive.push_back(2e-3 * ramp);
    r.response.push_back(0.12 * ramp + 1.8e-3 * (std::exp((ramp - t) / 2.0) - std::exp(-t / 2.0)) +
                         1e-3 * next());
  }
  return r;
}

}  // namespace

TEST_CASE("the table of laws does not contradict the table of parameters", "[select]") {
  for (const std::uint32_t seed : {2U, 6U}) {
    CAPTURE(seed);
    const Selection s = test::select_one("power-1", prepare_recording("r.csv", weak_branch(seed)));
    const Candidate& c = s.candidates.front();
    const auto k1 = std::find_if(c.fit.parameters.begin(), c.fit.parameters.end(),
                                 [](const auto& p) { return p.parameter.name == "k1"; });
    REQUIRE(k1 != c.fit.parameters.end());
    REQUIRE(k1->verdict == Verdict::identified);
    CHECK_THAT(c.reason, !Catch::Contains("k1"));
  }
}

TEST_CASE("a hold of three relaxation times is needed to say that nothing remains", "[select]") {
  const std::vector<double> fluid{300.0, 6.0, 0.0, 0.0};
  const Selection brief = selected_among(sampled("linear-1-fluid", fluid, 0.1, 11.0, 2e-3),
                                         {"linear-1-fluid", "linear-1"});
  CHECK_FALSE(candidate(brief, "linear-1-fluid").identified);
  CHECK(candidate(brief, "linear-1-fluid").reason ==
        "a hold of 9 s does not tell that nothing remains in the end");
  CHECK(law_name(brief.candidates[brief.recommended].law) == "linear-1");
  const Selection late = selected_among(sampled("linear-1-fluid", fluid, 0.1, 40.0, 2e-3),
                                        {"linear-1-fluid", "linear-1"});
  CHECK(candidate(late, "linear-1-fluid").identified);
  CHECK(law_name(late.candidates[late.recommended].law) == "linear-1-fluid");
}

TEST_CASE("few samples are no prediction", "[select]") {
  // Ramp of 1 s, and a hold of four samples.
  const Selection s = selected_among(
      sampled("linear-1", {100.0, 120.0, 1.0, 0.0, 0.0}, 0.1, 2.4, 1e-3), {"linear-1"});
  CHECK(s.candidates.front().held_out.empty());
  CHECK(s.remarks.front().code == "nothing_held_out");
  CHECK(to_json(s).at("laws").at(0).at("held_out").empty());

  // One sample after the fitted part, at which the surface is lost and the prediction 0.
  Recording r = sampled("linear-1", {100.0, 120.0, 1.0, 0.0, 0.0}, 0.1, 12.0, 1e-3);
  r.time_s.push_back(r.time_s.back() + 0.1);
  r.drive.push_back(0.0);
  r.response.push_back(0.3);
  const std::vector<PreparedRecording> one{prepare_recording("r.csv", r)};
  REQUIRE(one.front().to_s < r.time_s.back());
  SetupOptions setup;
  setup.profiles = false;
  const FitResult fit =
      run_fit(recording_config(parse_law_name("linear-1", "test"), one, setup), data_sets(one));
  const std::vector<Remark> remarks = outside_remarks(fit);
  REQUIRE(remarks.size() == 1);
  CHECK(remarks.front().code == "few_samples_after_fit");
  CHECK_THAT(remarks.front().text, Catch::Contains("1 sample after the fitted part") &&
                                       Catch::Contains("too few to say") && !Catch::Contains("%"));
}

TEST_CASE("a stretched strip is offered no Hertz contact", "[select]") {
  Recording r = sampled("linear-1", {100.0, 120.0, 3.0, 0.0, 0.0}, 0.1, 12.0, 1e-3);
  r.drive_quantity = Quantity::relative_length;
  r.response_quantity = Quantity::stress;
  for (double& drive : r.drive) drive = 1.0 + 40.0 * drive;
  const std::vector<PreparedRecording> one{prepare_recording("strip.csv", r)};
  SelectionOptions options;
  options.held_out = false;
  options.setup.profiles = false;
  const Selection s = select_law(one, options);
  for (const Candidate& c : s.candidates) CHECK(c.law.kernel != Kernel::hertz);
  options.laws = {parse_law_name("hertz-1", "test")};
  options.only_listed = true;
  CHECK_THROWS_WITH(select_law(one, options),
                    Catch::Contains("a Hertz kernel over a relative length; expected a linear or "
                                    "power kernel"));
}
