// Designs of experiments: Fisher information against hand calculation and against the covariance of
// an actual fit, rankings that are known analytically, limits, correlated noise, bad input.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/fit/design/design.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/show/design_figures.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Kind = PlannedExperiment::Kind;

/// A spring alone: F = k u, with an offset of each recording.
Json spring_design() {
  return parse_json(R"({
    "title": "spring", "law": {"name": "linear", "reference": "1 mm"},
    "parameters": {
      "k_inf": {"start": "100 N/m", "lower": "1 N/m", "upper": "10000 N/m"},
      "offset": {"start": "0 N", "lower": "-1 N", "upper": "1 N", "scale": "linear"}},
    "nuisance": ["offset"],
    "noise": {"force": {"absolute": "0.01 N"}},
    "candidates": [{"kind": "ramp_hold", "rate": ["1 mm/s"], "depth": ["4 mm"], "hold": ["0 s"],
                    "interval": ["1 s"]}]})",
                    "spring");
}

/// Amplitude and relaxation time, both unknown, everything relaxes: F = k1 u exp(-t / tau1).
Json decay_design() {
  return parse_json(R"({
    "title": "decay", "law": {"name": "linear-1-fluid", "reference": "1 mm"},
    "parameters": {
      "k1": {"start": "100 N/m", "lower": "1 N/m", "upper": "10000 N/m"},
      "tau1": {"start": "10 s", "lower": "0.1 s", "upper": "1000 s"}},
    "noise": {"force": {"absolute": "0.01 N"}},
    "candidates": [{"kind": "ramp_hold", "rate": ["1 m/s"], "depth": ["4 mm"], "hold": ["40 s"],
                    "interval": ["1 s"]}]})",
                    "decay");
}

DesignProblem parsed(const Json& document) {
  return parse_design(document, "design.json");
}

/// The first candidate's only recording.
Eigen::MatrixXd fisher(const Json& document) {
  const DesignProblem problem = parsed(document);
  return recording_information(problem, problem.candidates.front()).fisher;
}

std::string message(const Json& document) {
  try {
    static_cast<void>(fit::plan(parsed(document)));
  } catch (const Error& error) {
    CHECK(error.code() == ExitCode::bad_input);
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("a straight line through unknown zero has the standard error of the textbook") {
  // Depths 0, 1, 2, 3, 4 mm: sum (u - mean)^2 = 10 mm^2, se(k) = sigma / sqrt(10 mm^2).
  const DesignResult result = fit::plan(parsed(spring_design()));
  const DesignCandidate& best = result.ranked.front();
  CHECK(best.one.samples == 5.0);
  const double expected = 0.01 / std::sqrt(10e-6) / 100.0;
  const ExpectedParameter& k = best.expected.parameters.front();
  CHECK_THAT(k.relative_error, WithinRel(expected, 1e-9));
  CHECK_THAT(*k.upper, WithinRel(100.0 * std::exp(1.959963984540054 * expected), 1e-9));
  CHECK_THAT(*k.lower, WithinRel(100.0 * std::exp(-1.959963984540054 * expected), 1e-9));
  CHECK(k.identified);
  SECTION("without the offset the line goes through 0: sum u^2 = 30 mm^2") {
    Json document = spring_design();
    document["parameters"].erase("offset");
    document.erase("nuisance");
    CHECK_THAT(fisher(document)(0, 0), WithinRel(30e-6 * 1e4 / 1e-4, 1e-9));
  }
  SECTION("relative noise adds to sigma") {
    Json document = spring_design();
    document["parameters"].erase("offset");
    document.erase("nuisance");
    document["noise"]["force"]["relative"] = 0.1;
    double sum = 0.0;
    for (int i = 1; i <= 4; ++i) sum += std::pow(0.1 * i / (0.01 + 0.01 * i), 2);
    CHECK_THAT(fisher(document)(0, 0), WithinRel(sum, 1e-9));
  }
  SECTION("an estimated scale takes Student's t with the degrees of freedom that are left") {
    Json document = spring_design();
    document["noise"]["scale"] = "estimated";
    const DesignResult wider = fit::plan(parsed(document));
    const double t3 = 3.182446305284263;  // 97.5 %, 5 - 2 degrees of freedom
    CHECK_THAT(*wider.ranked.front().expected.parameters.front().upper,
               WithinRel(100.0 * std::exp(t3 * expected), 1e-9));
  }
}

TEST_CASE("n repeats shrink the standard error by sqrt(n); previous ones count alike") {
  Json document = decay_design();
  const auto error_of = [](const Json& j) {
    return fit::plan(parsed(j)).ranked.front().expected.parameters[1].relative_error;
  };
  const double once = error_of(document);
  document["previous"] = document["candidates"];
  CHECK_THAT(error_of(document), WithinRel(once / std::sqrt(2.0), 1e-9));
  document.erase("previous");
  document["candidates"][0]["repeats"] = {9};
  CHECK_THAT(error_of(document), WithinRel(once / 3.0, 1e-9));
}

TEST_CASE("what is known beforehand adds to the information") {
  Json document = spring_design();
  document["known"] = {{"k_inf", 0.02}};
  const double alone = 0.01 / std::sqrt(10e-6) / 100.0;
  const double both = 1.0 / std::sqrt(1.0 / (alone * alone) + 1.0 / (0.02 * 0.02));
  CHECK_THAT(fit::plan(parsed(document)).ranked.front().expected.parameters[0].relative_error,
             WithinRel(both, 1e-9));
}

TEST_CASE("a decay of unknown size and rate: D-optimal are readings at 0 and tau") {
  // Two readings, at 0 and at the hold h: det = (h/tau)^2 exp(-2 h/tau) (k u)^4, largest at h =
  // tau.
  Json document = decay_design();
  document["criterion"] = "all";
  document["candidates"] = Json::array();
  for (const char* hold : {"1 s", "3 s", "8 s", "10 s", "12 s", "30 s", "90 s"}) {
    document["candidates"].push_back({{"kind", "ramp_hold"},
                                      {"rate", {"1000 m/s"}},
                                      {"depth", {"4 mm"}},
                                      {"hold", {hold}},
                                      {"interval", {hold}}});
  }
  // A ramp of 4 us: the reading at the beginning of the ramp is 0 and says nothing, so the samples
  // are taken at 0 and at h; a third recording at a short interval gives the amplitude.
  document["previous"] = Json::array({{{"kind", "ramp_hold"},
                                       {"rate", {"1000 m/s"}},
                                       {"depth", {"4 mm"}},
                                       {"hold", {"0 s"}},
                                       {"interval", {"4e-6 s"}}}});
  const DesignResult result = fit::plan(parsed(document));
  CHECK(result.ranked.front().experiment.hold_s == 10.0);
  const double det = std::pow(result.ranked.front().expected.score, -4.0);
  const double signal = std::pow(100.0 * 4e-3 / 0.01, 4);
  CHECK_THAT(det, WithinRel(std::exp(-2.0) * signal, 1e-3));
  CHECK(result.ranked.back().experiment.hold_s == 90.0);
}

TEST_CASE("a hold long compared with tau goes before one that is too short") {
  Json document = decay_design();
  document["candidates"][0]["hold"] = {"1 s", "40 s"};
  for (const char* criterion : {"all", "worst", "tau1"}) {
    document["criterion"] = criterion;
    const DesignResult result = fit::plan(parsed(document));
    CHECK(result.ranked.front().experiment.hold_s == 40.0);
    CHECK_THAT(result.summary[1],
               Contains("with a hold of 1 s") && Contains("ends before a relaxation of 10 s"));
  }
}

TEST_CASE("a slow ramp hides a short relaxation, and the words say so") {
  Json document = decay_design();
  document["parameters"]["k_inf"] = document["parameters"]["k1"];
  document["law"]["name"] = "linear-1";
  document["parameters"]["tau1"]["start"] = "0.3 s";
  document["candidates"][0]["interval"] = {"0.1 s"};
  document["candidates"][0]["rate"] = {"1 mm/s", "10 mm/s"};
  const DesignResult result = fit::plan(parsed(document));
  CHECK(result.ranked.front().experiment.rate_m_per_s == 0.01);
  bool said = false;
  for (const std::string& words : result.summary) {
    said = said || words.find("the ramp of 4 s hides a relaxation of 0.3 s") != std::string::npos;
  }
  CHECK(said);
}

TEST_CASE("the expected standard errors are those of a fit to such data") {
  // Data without noise: the fit ends at the true values, and its covariance must be the predicted
  // one.
  for (const char* law : {"linear-1", "power-1", "linear-1-series"}) {
    Json document = decay_design();
    document["law"]["name"] = law;
    const Json like_k = document["parameters"]["k1"];
    const Json like_tau = document["parameters"]["tau1"];
    document["parameters"] = {
        {"offset", {{"start", "0 N"}, {"lower", "-1 N"}, {"upper", "1 N"}, {"scale", "linear"}}}};
    const bool series = std::string(law) == "linear-1-series";
    document["parameters"][series ? "k0" : "k_inf"] = like_k;
    document["parameters"][series ? "kc1" : "k1"] = like_k;
    document["parameters"][series ? "kc1" : "k1"]["start"] = "150 N/m";
    document["parameters"][series ? "T1" : "tau1"] = like_tau;
    if (std::string(law) == "power-1") {
      document["parameters"]["exponent"] = {{"start", "1.5"}, {"lower", "1"}, {"upper", "4"}};
    }
    document["nuisance"] = {"offset"};
    document["candidates"][0]["rate"] = {"2 mm/s"};
    document["candidates"][0]["repeats"] = {2};
    const DesignProblem problem = parsed(document);
    const DesignResult result = fit::plan(problem);
    const PlannedFit planned = planned_fit(problem, std::vector{problem.candidates.front()});
    const FitResult fit = run_fit(planned.config, planned.data);
    for (std::size_t i = 0; i < problem.config.parameters.size(); ++i) {
      INFO(law << ", " << problem.parameter(i).name);
      const ExpectedParameter& expected = result.ranked.front().expected.parameters[i];
      REQUIRE(fit.parameters[i].standard_error);
      CHECK_THAT(*fit.parameters[i].standard_error / expected.value,
                 WithinRel(expected.relative_error, 1e-5));
    }
  }
}

TEST_CASE("the paper's element and creep are planned through the same interface") {
  Json document = decay_design();
  document.erase("law");
  document["parameters"] = {
      {"E1", {{"start", "12 kPa"}, {"lower", "1 kPa"}, {"upper", "100 kPa"}}},
      {"E2", {{"start", "12 kPa"}, {"lower", "1 kPa"}, {"upper", "100 kPa"}}},
      {"eta1", {{"start", "1e5 Pa s"}, {"lower", "1e3 Pa s"}, {"upper", "1e7 Pa s"}}}};
  document["noise"]["depth"] = {{"absolute", "0.05 mm"}};
  document["candidates"] = Json::array(
      {{{"kind", "creep"}, {"load", {"0.2 N", "5 N"}}, {"hold", {"60 s"}}, {"interval", {"1 s"}}}});
  const DesignResult result = fit::plan(parsed(document));
  REQUIRE(result.ranked.size() == 1);
  CHECK(result.ranked.front().experiment.load_N == 0.2);
  CHECK(result.ranked.front().expected.all_identified());
  REQUIRE(result.left_out.size() == 1);
  CHECK(result.left_out.front().code == "depth_under_load");
  CHECK_THAT(result.left_out.front().text, Contains("1 of 2: the load presses deeper than 12 mm"));
}

TEST_CASE("correlated noise thins the samples") {
  CHECK(inflation(0.1, 0.0, 100.0) == 1.0);
  CHECK_THAT(inflation(1.0, 0.1, 100.0), WithinRel(1.0, 1e-3));
  CHECK_THAT(inflation(0.01, 1.0, 1e6), WithinRel(200.0, 1e-4));
  CHECK(inflation(0.01, 1.0, 50.0) == 50.0);
  // Ten times as many samples of correlated noise promise hardly more.
  Json document = decay_design();
  document["noise"]["correlation_time"] = "1 s";
  document["candidates"][0]["interval"] = {"0.1 s", "0.01 s"};
  const DesignResult result = fit::plan(parsed(document));
  CHECK_THAT(result.ranked[1].expected.score, WithinRel(result.ranked[0].expected.score, 0.02));
}

TEST_CASE("parameters that nothing tells apart stay unknown, the others do not suffer") {
  Eigen::Matrix3d information;
  information << 4.0, 4.0, 0.0, 4.0, 4.0, 0.0, 0.0, 0.0, 25.0;
  const ThetaCovariance covariance = theta_covariance(information);
  CHECK(std::isinf(covariance.standard_error[0]));
  CHECK(std::isinf(covariance.standard_error[1]));
  CHECK_THAT(covariance.standard_error[2], WithinRel(0.2, 1e-12));
  CHECK(covariance.log_determinant == -std::numeric_limits<double>::infinity());
  const Eigen::Matrix2d regular = (Eigen::Matrix2d() << 2.0, 1.0, 1.0, 3.0).finished();
  CHECK_THAT(theta_covariance(regular).log_determinant, WithinAbs(std::log(5.0), 1e-12));
  CHECK_THAT(theta_covariance(regular).standard_error[0], WithinRel(std::sqrt(0.6), 1e-12));
}

TEST_CASE("the limits of the machine leave candidates out and say why") {
  Json document = decay_design();
  document["limits"] = {{"rate", "20 mm/s"}, {"total_time", "100 s"}};
  document["candidates"][0]["rate"] = {"10 mm/s", "30 mm/s"};
  document["candidates"][0]["depth"] = {"4 mm", "13 mm"};
  document["candidates"][0]["repeats"] = {1, 3};
  const DesignResult result = fit::plan(parsed(document));
  REQUIRE(result.ranked.size() == 1);
  CHECK(result.left_out.size() == 3);
  CHECK_THAT(message([&] {
               document["limits"]["rate"] = "1 mm/s";
               return document;
             }()),
             Contains("no candidate is within the limits"));
}

TEST_CASE("the best pair is no worse than the best done twice") {
  Json document = decay_design();
  document["candidates"][0]["hold"] = {"2 s", "20 s", "80 s"};
  const DesignResult result = fit::plan(parsed(document));
  CHECK(result.pair.expected.score <=
        result.ranked.front().expected.score / std::sqrt(2.0) * (1.0 + 1e-12));
}

TEST_CASE("the figures hold a curve per rate, the best candidate and a panel per parameter") {
  Json document = decay_design();
  document["candidates"][0]["rate"] = {"1 mm/s", "10 mm/s", "100 mm/s"};
  document["candidates"][0]["hold"] = {"5 s", "40 s"};
  const DesignResult result = fit::plan(parsed(document));
  const std::vector<Figure> figures = design_figures(result);
  REQUIRE(figures.size() == 2);
  REQUIRE(figures[0].panels.size() == 2);
  REQUIRE(figures[0].panels[0].series.size() == 4);
  CHECK(figures[1].panels[0].series.size() == 3);
  const Series& best = figures[0].panels[0].series.back();
  CHECK(best.label == "best candidate");
  CHECK(best.x == std::vector{result.ranked.front().experiment.hold_s});
  CHECK(figures[0].panels[0].series[0].provenance == "model");
  CHECK_NOTHROW(to_json(figures));
}

TEST_CASE("the answer of a shipped design has 25 lines at most and leaves out no verdict") {
  for (const char* name : {"design_liver.json", "design_meat.json"}) {
    const DesignResult result =
        fit::plan(read_design(std::string(TPM_TEST_SOURCE_DIR "/configs/") + name));
    const DesignCheck check = check_design(result.problem, result.ranked.front().experiment, 10, 0);
    ShortAnswer answer = short_answer(result, &check, 10);
    end_answer(answer, "out", {"design.svg"}, "tpm fit RECORDING.csv");
    const std::string text = to_text(answer);
    INFO(text);
    CHECK(std::count(text.begin(), text.end(), '\n') <= 25);
    CHECK_THAT(text, Contains(experiment_words(result.ranked.front().experiment)));
    for (const std::string& words : result.summary) CHECK_THAT(text, Contains(words));
    for (const Remark& remark : check.remarks) CHECK_THAT(text, Contains(remark.text));
    const std::string whole = to_terminal_text(result, &check, 10);
    CHECK(std::count(whole.begin(), whole.end(), '\n') > 25);
  }
}

TEST_CASE("bad designs are named") {
  const auto changed = [](const char* pointer, const Json& value) {
    Json document = spring_design();
    document[Json::json_pointer(pointer)] = value;
    return message(document);
  };
  CHECK_THAT(
      changed("/criterion", "stiffness"),
      Contains("/criterion: no parameter is called 'stiffness'; expected all, worst, k_inf"));
  CHECK_THAT(changed("/candidates/0/rate", Json::array({"0 mm/s"})),
             Contains("/candidates/0/rate/0: 0 m/s; expected above 0 m/s"));
  CHECK_THAT(changed("/candidates/0/load", Json::array({"1 N"})),
             Contains("/candidates/0/load: is no key of the kind 'ramp_hold'"));
  CHECK_THAT(changed("/candidates/0/kind", "creep"),
             Contains("/candidates/0/rate: is no key of the kind 'creep'"));
  CHECK_THAT(changed("/noise/force/absolute", "1 mm"), Contains("/noise/force/absolute"));
  CHECK_THAT(changed("/nuisance", Json::array({"k_inf", "offset"})),
             Contains("every parameter is a nuisance"));
  CHECK_THAT(changed("/nuisance", Json::array()), Contains("/parameters/offset/start"));
  CHECK_THAT(changed("/known", Json{{"x", 0.1}}), Contains("no parameter is called 'x'"));
  CHECK_THAT(changed("/level", 2), Contains("/level"));
  Json creep = spring_design();
  creep["candidates"] = Json::array(
      {{{"kind", "creep"}, {"load", {"1 N"}}, {"hold", {"1 s"}}, {"interval", {"1 s"}}}});
  CHECK_THAT(message(creep), Contains("/noise: creep without the noise of a depth"));
  CHECK_THROWS_WITH(
      check_design(parsed(spring_design()), parsed(spring_design()).candidates.front(), 3, 0),
      Contains("expected 10 or more"));
}
