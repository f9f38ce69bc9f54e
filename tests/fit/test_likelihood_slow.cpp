// The likelihood of a whole fit: noise distributions, estimated noise, correlated residuals,
// bootstrap, bands, and what is said of data that cannot tell.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "fitted_parameter.hpp"
#include "gradient_check.hpp"
#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// True values of the synthetic recordings: k_inf, k1 (N/m), tau1 (s), contact, offset.
const std::vector<double> kTrueValues{40.0, 60.0, 5.0, 0.0, 0.0};

/// A ramp of 2 s to 4 mm and a hold to 30 s, answered by the law linear-1 and scattered by `error`
/// (N); computed, not measured.
Recording computed_recording(const std::vector<double>& error) {
  const std::size_t n = error.size();
  Recording r;
  r.provenance = Provenance::derived;
  for (std::size_t i = 0; i < n; ++i) {
    const double t = 30.0 * static_cast<double>(i) / static_cast<double>(n - 1);
    r.time_s.push_back(t);
    r.drive.push_back(4e-3 * std::min(t / 2.0, 1.0));
  }
  LawSpec spec;
  spec.reference = 4e-3;
  const Response answer =
      LawModel(spec).respond(measured_history(Drive::displacement, r.time_s, r.drive), r.time_s,
                             kTrueValues, Want::values);
  for (std::size_t i = 0; i < n; ++i) {
    r.response.push_back(answer.value[static_cast<Eigen::Index>(i)] + error[i]);
  }
  return r;
}

std::vector<double> normal_errors(std::size_t n, double sigma, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> errors(n);
  for (double& e : errors) e = sigma * random.normal();
  return errors;
}

/// An autoregression of first order with the stationary standard deviation sigma.
std::vector<double> correlated_errors(std::size_t n, double sigma, double phi, std::uint64_t seed) {
  std::vector<double> errors = normal_errors(n, sigma, seed);
  for (std::size_t i = 1; i < n; ++i) {
    errors[i] = phi * errors[i - 1] + std::sqrt(1.0 - phi * phi) * errors[i];
  }
  return errors;
}

/// The law linear-1 (or another) for recordings a, b, ... with one noise; members of `more` are
/// added to the document.
FitConfig law_config(const std::string& noise, const std::string& more = "",
                     const std::string& law = "linear-1", std::size_t recordings = 1) {
  std::string second;
  if (law == "linear-2") {
    second = R"(, "k2": {"start": "30 N/m", "lower": "0.1 N/m", "upper": "1000 N/m"},
                 "tau2": {"start": "20 s", "lower": "0.1 s", "upper": "100 s"})";
  }
  std::string data;
  for (std::size_t i = 0; i < recordings; ++i) {
    data += fmt::format(R"({}{{"dataset": "{}", "protocol": {{"kind": "measured"}}, "noise": {}}})",
                        i == 0 ? "" : ", ", std::string(1, static_cast<char>('a' + i)), noise);
  }
  const std::string text = R"({"title": "computed", "law": {"name": ")" + law +
                           R"(", "reference": "4 mm"}, "parameters": {
      "k_inf": {"start": "30 N/m", "lower": "0.1 N/m", "upper": "1000 N/m"},
      "k1": {"start": "30 N/m", "lower": "0.1 N/m", "upper": "1000 N/m"},
      "tau1": {"start": "2 s", "lower": "0.1 s", "upper": "100 s"})" +
                           second + R"(}, "data": [)" + data + R"(], "starts": {"count": 4})" +
                           more + "}";
  return parse_fit_config(parse_json(text, "f.json"), "f.json");
}

FitConfig without_profiles(FitConfig config) {
  config.profiles = false;
  return config;
}

FitConfig relaxation() {
  FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_relaxation.json");
  config.hypotheses.clear();
  config.starts = 8;
  return without_profiles(config);
}

/// The liver relaxation with one noise.
FitConfig relaxation_with(const std::string& noise) {
  Json j = read_json(std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_relaxation.json");
  j["data"][0]["noise"] = parse_json(noise, "noise");
  j.erase("hypotheses");
  j["starts"]["count"] = 8;
  return without_profiles(parse_fit_config(j, "f.json"));
}

const std::string kKnown = R"({"kind": "absolute", "absolute": "1 mN"})";

}  // namespace

// --- likelihood ----------------------------------------------------------------------------------

TEST_CASE("the likelihood and the criteria equal hand computations") {
  const FitResult fit = run_fit(relaxation());
  // normal with sigma = 0.1 y: deviance + sum of ln(2 pi sigma^2), by hand from the data
  double constants = 0.0;
  for (const FittedDatum& d : fit.data) {
    constants += std::log(2.0 * std::numbers::pi * std::pow(0.1 * *d.datum.value, 2));
  }
  REQUIRE(fit.likelihood);
  CHECK_THAT(fit.likelihood->minus_two_log, WithinRel(fit.best.deviance + constants, 1e-12));
  CHECK(fit.likelihood->readings == 8);
  CHECK(fit.likelihood->parameters == 3);
  const Likelihood l = information_criteria(100.0, 20, 4);
  CHECK_THAT(l.aic, WithinRel(108.0, 1e-14));
  CHECK_THAT(*l.aicc, WithinRel(108.0 + 40.0 / 15.0, 1e-14));
  CHECK_THAT(l.bic, WithinRel(100.0 + 4.0 * std::log(20.0), 1e-14));
  CHECK_FALSE(information_criteria(100.0, 5, 4).aicc);
}

TEST_CASE("log-normal noise is a normal law of the logarithms, with the Jacobian of the scale") {
  const FitResult fit =
      run_fit(relaxation_with(R"({"distribution": "log_normal", "relative": 0.1})"));
  const FitResult same = run_fit(relaxation_with(R"({"kind": "log", "relative": 0.1})"));
  CHECK(fit.best.deviance == same.best.deviance);
  double of_logarithms = 0.0;  // -2 ln L of ln y, by hand
  double jacobian = 0.0;       // d ln y / d y
  for (const FittedDatum& d : fit.data) {
    const double z = std::log(d.predicted / *d.datum.value) / 0.1;
    of_logarithms += z * z + std::log(2.0 * std::numbers::pi * 0.01);
    jacobian += 2.0 * std::log(*d.datum.value);
  }
  CHECK_THAT(fit.likelihood.value().minus_two_log, WithinRel(of_logarithms + jacobian, 1e-10));
}

TEST_CASE("a common factor of the noise counts as a parameter with its most likely value") {
  const FitResult fit = run_fit(
      relaxation_with(R"({"kind": "relative_to_datum", "relative": 0.1, "scale": "estimated"})"));
  double by_hand = 0.0;
  for (const FittedDatum& d : fit.data) {
    const double variance = 0.01 * *d.datum.value * *d.datum.value * fit.chi_square / 8.0;
    by_hand += 1.0 + std::log(2.0 * std::numbers::pi * variance);
  }
  CHECK_THAT(fit.likelihood.value().minus_two_log, WithinRel(by_hand, 1e-10));
  CHECK(fit.likelihood->parameters == 4);
}

TEST_CASE("each distribution is fitted, with derivatives that agree with differences") {
  for (const char* noise :
       {R"({"kind": "absolute", "absolute": "20 mN", "distribution": "laplace"})",
        R"({"kind": "log", "relative": 0.1, "distribution": "student_t", "degrees_of_freedom": 3})",
        R"({"kind": "relative_to_model", "relative": 0.1, "distribution": "student_t"})",
        R"({"kind": "combined", "absolute": "estimated", "relative": "estimated"})",
        R"({"kind": "log", "relative": "estimated"})"}) {
    CAPTURE(noise);
    const FitConfig config = relaxation_with(noise);
    const ExperimentResiduals function(config);
    std::vector<FitParameter> parameters;
    for (const EstimatedParameter& p : function.config().parameters) parameters.push_back(p.fit);
    const GradientCheck check = check_gradient(function, parameters, {2, 1, 3e-4});
    INFO(to_terminal_text(check));
    CHECK(check.wrong == 0);
    const FitResult fit = run_fit(config);
    CHECK(fit.best.usable);
    CHECK(fit.likelihood.has_value());
    CHECK_FALSE(fit.chi_square_p.has_value());
  }
}

TEST_CASE("an estimated sigma is the most likely one, with an interval and a place in k") {
  const Recording r = computed_recording(normal_errors(300, 2e-3, 5));
  const FitResult fit =
      run_fit(law_config(R"({"kind": "absolute", "absolute": "estimated"})"), {DataSet(r)});
  const ParameterResult& sigma = find(fit, "sigma_a");
  // for normal noise the most likely sigma is the root mean square of the residuals
  CHECK_THAT(sigma.estimate, WithinRel(fit.recordings[0].rms_residual, 1e-5));
  CHECK(sigma.verdict == Verdict::identified);
  CHECK(*sigma.lower < 2e-3);
  CHECK(*sigma.upper > 2e-3);
  CHECK_THAT(*sigma.standard_error, WithinRel(sigma.estimate / std::sqrt(600.0), 1e-3));
  CHECK(fit.likelihood.value().parameters == 4);
  const double n = 300.0;
  const double most_likely = n * std::log(2.0 * std::numbers::pi * std::pow(sigma.estimate, 2)) + n;
  CHECK_THAT(fit.likelihood->minus_two_log, WithinRel(most_likely, 1e-8));
  // as good as the same fit with a common factor
  const FitResult factor =
      run_fit(without_profiles(
                  law_config(R"({"kind": "absolute", "absolute": "1 mN", "scale": "estimated"})")),
              {DataSet(r)});
  CHECK_THAT(factor.likelihood.value().minus_two_log,
             WithinRel(fit.likelihood->minus_two_log, 1e-8));
  CHECK(factor.likelihood->parameters == 4);
  CHECK_THAT(find(factor, "tau1").estimate, WithinRel(find(fit, "tau1").estimate, 1e-5));
  CHECK_THAT(std::string(test::remark_text(fit.remarks, "noise_estimated")),
             Contains("from 300 values"));
}

TEST_CASE("data sets share a noise parameter or have their own") {
  const std::vector<DataSet> sets{DataSet(computed_recording(normal_errors(200, 1e-3, 1))),
                                  DataSet(computed_recording(normal_errors(200, 4e-3, 2)))};
  const std::string own = R"({"kind": "absolute", "absolute": "estimated"})";
  const FitResult apart = run_fit(without_profiles(law_config(own, "", "linear-1", 2)), sets);
  CHECK_THAT(find(apart, "sigma_a a").estimate, WithinRel(1e-3, 0.15));
  CHECK_THAT(find(apart, "sigma_a b").estimate, WithinRel(4e-3, 0.15));
  const std::string shared = R"({"kind": "absolute", "absolute": "estimated machine"})";
  const FitResult together = run_fit(without_profiles(law_config(shared, "", "linear-1", 2)), sets);
  CHECK(together.parameters.size() == 4);
  CHECK_THAT(find(together, "machine").estimate, WithinRel(std::sqrt(8.5) * 1e-3, 0.15));
  CHECK(apart.likelihood.value().bic < together.likelihood.value().bic);
}

// --- correlated residuals ------------------------------------------------------------------------

TEST_CASE("correlated noise widens the intervals, and ignoring it is a choice") {
  const std::vector<DataSet> data{
      DataSet(computed_recording(correlated_errors(400, 1e-3, 0.8, 3)))};
  const FitResult adjusted = run_fit(law_config(kKnown), data);
  REQUIRE(adjusted.correlation);
  CHECK(adjusted.correlation->significant);
  REQUIRE(adjusted.noise);
  CHECK_THAT(adjusted.noise->phi, WithinAbs(0.8, 0.1));
  CHECK_THAT(adjusted.inflation, WithinRel(9.0, 0.5));
  const FitResult ignored = run_fit(law_config(kKnown, R"(, "correlation": "ignore")"), data);
  CHECK(ignored.inflation == 1.0);
  CHECK(ignored.correlation->significant);  // said all the same
  const auto width = [](const FitResult& fit) {
    return std::log(*find(fit, "tau1").upper / *find(fit, "tau1").lower);
  };
  // A fast branch suffers less from slow noise than a mean does, a slow one as much.
  const double wider = width(adjusted) / width(ignored);
  CHECK(wider > 1.5);
  CHECK(wider < 1.5 * std::sqrt(adjusted.inflation));
  CHECK(*find(adjusted, "k1").standard_error > *find(ignored, "k1").standard_error);
  CHECK(test::has_remark(adjusted.remarks, "correlated_noise"));
  CHECK_THAT(to_terminal_text(adjusted), Contains("a: 400 of 400 samples fitted, rms residual"));
}

TEST_CASE("independent noise keeps the exact thresholds, readings of tables too") {
  const std::vector<DataSet> data{DataSet(computed_recording(normal_errors(400, 1e-3, 4)))};
  const FitResult fit = run_fit(without_profiles(law_config(kKnown)), data);
  CHECK_FALSE(fit.correlation.value().significant);
  CHECK(fit.inflation == 1.0);
  CHECK_FALSE(run_fit(relaxation()).correlation.has_value());
}

// --- bootstrap -----------------------------------------------------------------------------------

TEST_CASE("a bootstrap of a configuration repeats for its seed and agrees with the covariance") {
  const std::vector<DataSet> data{DataSet(computed_recording(normal_errors(150, 1e-3, 6)))};
  FitConfig config =
      without_profiles(law_config(kKnown, R"(, "bootstrap": {"replicates": 200, "seed": 3})"));
  const FitResult fit = run_fit(config, data);
  REQUIRE(fit.bootstrap);
  CHECK(fit.bootstrap->failed == 0);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK_THAT(fit.bootstrap->parameters[i].standard_error,
               WithinRel(fit.parameters[i].standard_error.value(), 0.25));
  }
  CHECK(to_text(to_json(run_fit(config, data))) == to_text(to_json(fit)));
  CHECK_THAT(to_terminal_text(fit), Contains("200 refits to resampled residuals, seed 3"));
}

TEST_CASE("whole recordings are drawn; a reading drawn twice counts twice") {
  const std::vector<DataSet> data{DataSet(computed_recording(normal_errors(60, 1e-3, 7))),
                                  DataSet(computed_recording(normal_errors(60, 2e-3, 8))),
                                  DataSet(computed_recording(normal_errors(60, 3e-3, 9)))};
  FitConfig config = without_profiles(law_config(
      kKnown, R"(, "bootstrap": {"replicates": 40, "resample": "recordings"})", "linear-1", 3));
  CHECK(run_fit(config, data).bootstrap->parameters.size() == 3);

  const ExperimentResiduals function(config, data);
  const ExperimentRefit refit(function);
  CHECK(refit.recording_lengths() == std::vector<std::size_t>{60, 60, 60});
  const std::vector<double> at{35.0, 50.0, 4.0};
  const std::vector<std::size_t> first_twice{0, 0};
  const std::vector<std::size_t> first{0};
  const double once = deviance_at(*refit.with_readings(first), at);
  CHECK_THAT(deviance_at(*refit.with_readings(first_twice), at), WithinRel(2.0 * once, 1e-12));
  // the residuals put back are the data again
  const std::vector<double> z = refit.standardised_residuals(at);
  CHECK_THAT(deviance_at(*refit.with_residuals(at, z), at),
             WithinRel(deviance_at(function, at), 1e-9));

  config.parameters[0].sets[0].data = {0, 1};
  config.fixed[0] = 40.0;
  CHECK_THROWS_WITH(run_fit(config, data), Contains("'k_inf' belongs to some data sets only"));
}

// --- bands ---------------------------------------------------------------------------------------

TEST_CASE("95 % of the samples lie in the prediction band, and it is wider than the curve's") {
  const std::vector<DataSet> data{DataSet(computed_recording(normal_errors(1000, 1e-3, 10)))};
  const FitResult fit = run_fit(without_profiles(law_config(kKnown)), data);
  const RecordingFit& r = fit.recordings.at(0);
  REQUIRE(r.lower.size() == 1000);
  CHECK_THAT(r.share_inside.value(), WithinAbs(0.95, 0.02));
  CHECK_THAT(r.upper[500] - r.predicted[500], WithinRel(1.96e-3, 0.02));
  const FitResult points = run_fit(relaxation());
  for (const FittedDatum& d : points.data) {
    REQUIRE(d.confidence);
    REQUIRE(d.prediction);
    CHECK(d.prediction->lower < d.confidence->lower);
    CHECK(d.confidence->upper < d.prediction->upper);
    CHECK_THAT(d.confidence->upper - d.predicted, WithinRel(1.959964 * *d.predicted_sd, 1e-5));
  }
  const Json j = to_json(points);
  CHECK(j["data"][0].contains("prediction_band_N"));
  CHECK(to_json(fit)["recordings"][0]["samples_fitted"] == 1000);
}

TEST_CASE("the ends of all starts are told") {
  const FitResult fit = run_fit(relaxation());
  CHECK(fit.waterfall.starts == 8);
  CHECK(fit.waterfall.deviances.front() == fit.best.deviance);
  const Json j = to_json(fit);
  CHECK(j["starts"]["end_deviances"].size() == 8);
  CHECK_THAT(j["starts"]["summary"].get<std::string>(),
             Contains("of 8 starts end at the best minimum"));
}

// --- data that cannot tell -----------------------------------------------------------------------

TEST_CASE("two equal relaxation times: the covariance is not of full rank, or says what is known") {
  const std::vector<DataSet> data{DataSet(computed_recording(normal_errors(200, 1e-3, 11)))};
  const FitResult fit = run_fit(law_config(kKnown, "", "linear-2"), data);
  const FitResult one = run_fit(without_profiles(law_config(kKnown)), data);
  // two branches more cost two parameters and gain almost nothing
  CHECK(fit.best.deviance > one.best.deviance - 8.0);
  CHECK(one.likelihood.value().bic < fit.likelihood.value().bic);
  int open = 0;
  for (const ParameterResult& p : fit.parameters) {
    open += p.verdict != Verdict::identified ? 1 : 0;
    CHECK_FALSE(p.summary.empty());
  }
  CHECK(open >= 2);
}

TEST_CASE(
    "exact data: the true values come back, and nothing divides by the noise that is not there") {
  const std::vector<DataSet> data{DataSet(computed_recording(std::vector<double>(100, 0.0)))};
  const FitResult fit = run_fit(law_config(kKnown), data);
  CHECK_THAT(find(fit, "tau1").estimate, WithinRel(5.0, 1e-6));
  CHECK(fit.chi_square < 1e-6);
  const FitResult factor = run_fit(
      law_config(R"({"kind": "absolute", "absolute": "1 mN", "scale": "estimated"})"), data);
  CHECK_THAT(find(factor, "tau1").estimate, WithinRel(5.0, 1e-6));
  CHECK_NOTHROW(to_text(to_json(factor)));
  const FitResult sigma =
      run_fit(law_config(R"({"kind": "absolute", "absolute": "estimated"})"), data);
  CHECK(find(sigma, "sigma_a").at_lower_bound);
  CHECK_THAT(find(sigma, "tau1").estimate, WithinRel(5.0, 1e-4));
  CHECK_NOTHROW(to_text(to_json(sigma)));
}

TEST_CASE("one datum: it is fitted, flat parameters are said, a scale cannot be estimated") {
  FitConfig config = relaxation();
  for (const double depth : {4e-3, 6e-3, 8e-3}) {
    config.data[0].exclude.push_back({depth, std::nullopt, std::nullopt});
  }
  config.data[0].exclude.push_back({2e-3, std::nullopt, "end"});
  config.profiles = true;
  const FitResult fit = run_fit(config);
  CHECK(fit.value_count == 1);
  const auto open =
      std::count_if(fit.parameters.begin(), fit.parameters.end(),
                    [](const ParameterResult& p) { return p.verdict != Verdict::identified; });
  CHECK(open >= 2);
  CHECK(fit.best.deviance < 1e-9);
  CHECK_FALSE(fit.likelihood.value().aicc.has_value());
  config.data[0].noise.scale_known = false;
  CHECK_THROWS_WITH(run_fit(config), Contains("1 data with 3 parameters"));
}

TEST_CASE("all-equal data: stiffness that does not relax, or noise that cannot be sized") {
  Recording r = computed_recording(std::vector<double>(50, 0.0));
  for (double& f : r.response) f = 0.0;
  CHECK_THROWS_WITH(
      run_fit(law_config(R"({"kind": "absolute", "absolute": "estimated"})"), {DataSet(r)}),
      Contains("no value other than 0"));
  const FitResult zero = run_fit(law_config(kKnown), {DataSet(r)});
  CHECK(find(zero, "k_inf").at_lower_bound);
  CHECK(find(zero, "k1").at_lower_bound);
  CHECK_NOTHROW(to_text(to_json(zero)));
}

TEST_CASE(
    "an outlier of 100 sigma: left out and said, or held down by a wide-tailed law or a loss") {
  std::vector<double> errors = normal_errors(200, 1e-3, 12);
  errors[40] += 0.1;
  const std::vector<DataSet> data{DataSet(computed_recording(errors))};
  const auto shift = [&](const FitResult& fit) {
    return std::abs(std::log(find(fit, "tau1").estimate / 5.0));
  };
  const FitResult normal = run_fit(without_profiles(law_config(kKnown)), data);
  CHECK_THAT(std::string(test::remark_text(normal.remarks, "outliers_left_out")),
             Contains("1 outlier (") && Contains("t = 6.0"));
  const FitResult wide = run_fit(
      without_profiles(
          law_config(R"({"kind": "absolute", "absolute": "1 mN", "distribution": "student_t"})")),
      data);
  CHECK(test::has_remark(wide.remarks, "outliers"));
  const FitResult huber =
      run_fit(without_profiles(law_config(kKnown, R"(, "loss": {"kind": "huber"})")), data);
  CAPTURE(shift(normal), shift(wide), shift(huber));
  for (const FitResult* fit : {&normal, &wide, &huber}) {
    const ParameterResult& tau = find(*fit, "tau1");
    CHECK(shift(*fit) < 3.0 * tau.standard_error.value() / tau.estimate);
  }
  CHECK_FALSE(huber.likelihood.has_value());
}

TEST_CASE("mistakes about the noise are named") {
  const auto refuse = [](const char* noise, const char* message) {
    CAPTURE(noise);
    CHECK_THROWS_WITH(law_config(noise), Contains(message) && Catch::StartsWith("f.json"));
  };
  refuse(R"({"relative": 0.1})", "/data/0/noise/kind: is missing");
  refuse(R"({"kind": "absolute", "distribution": "log_normal", "absolute": "1 mN"})",
         "'log_normal' beside another kind");
  refuse(R"({"kind": "log", "distribution": "normal", "relative": 0.1})",
         "'normal' beside the kind 'log'");
  refuse(R"({"kind": "absolute", "absolute": "1 mN", "degrees_of_freedom": 4})",
         "without Student's t");
  refuse(R"({"kind": "absolute", "absolute": "1 mN", "distribution": "student_t",
             "degrees_of_freedom": 2})",
         "/data/0/noise/degrees_of_freedom: 2; expected above 2");
  refuse(R"({"kind": "relative_to_datum", "relative": "estimated"})",
         "estimated under 'relative_to_datum'");
  refuse(R"({"kind": "absolute", "absolute": "estimated", "scale": "estimated"})",
         "a common factor and sigma, both estimated");
  refuse(R"({"kind": "absolute", "absolute": "1 mN", "distribution": "laplace",
             "scale": "estimated"})",
         "estimated under distribution 'laplace'");
  refuse(R"({"kind": "relative_to_model", "relative": "guessed"})",
         "/data/0/noise/relative: 'guessed'; expected \"estimated\"");
  CHECK_THROWS_WITH(law_config(R"({"kind": "absolute", "absolute": "estimated"})",
                               R"(, "loss": {"kind": "huber"})"),
                    Contains("either a loss, or a likelihood"));
}
