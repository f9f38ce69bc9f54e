// Intervals under noise that is not white, rounded readings and outliers, and what is said of a
// minimum or a law that the data do not settle.
#include <Eigen/Cholesky>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "support/placed_recordings.hpp"
#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/confirmation.hpp"
#include "tpm/fit/noise_of_estimates.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/select/fixed_times.hpp"
#include "tpm/fit/select/gate.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kSigma = 0.01;

/// Rest, ramp and hold of linear-1 with a peak of about 1 N.
Recording made_ramp(double phi, std::uint64_t seed, int samples = 300) {
  Recording r;
  for (int i = 0; i < samples; ++i) {
    const double t = -3.0 + 24.0 * i / (samples - 1.0);
    r.time_s.push_back(t);
    r.drive.push_back(std::clamp(5e-3 * t, -1e-3, 5e-3));
  }
  Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  history.set_equilibrium_at_start(true);
  const LawModel model(parse_law_name("linear-1", "test"));
  const std::vector<double> values{120.0, 100.0, 3.0, 0.0, 0.0};
  const Eigen::VectorXd f = model.respond(history, r.time_s, values, Want::values).value;
  Random random(seed);
  double noise = random.normal();
  for (int i = 0; i < samples; ++i) {
    if (i > 0) noise = phi * noise + std::sqrt(1.0 - phi * phi) * random.normal();
    r.response.push_back(f[i] + kSigma * noise);
  }
  return r;
}

FitConfig ramp_config(const std::vector<PreparedRecording>& one) {
  SetupOptions setup;
  setup.profiles = false;
  setup.nuisance = Nuisance::none;
  setup.starts = 4;
  return recording_config(parse_law_name("linear-1", "test"), one, setup);
}

std::vector<PreparedRecording> prepared_ramp(Recording r) {
  return {prepare_recording("ramp.csv", std::move(r))};
}

}  // namespace

TEST_CASE("correlated noise: the covariance of least squares agrees with dense matrices",
          "[intervals]") {
  const auto one = prepared_ramp(made_ramp(0.8, 3));
  const ExperimentResiduals function(ramp_config(one), data_sets(one));
  const FitResult fit = fit_experiments(function);
  REQUIRE(fit.noise);
  const NoiseOfEstimates& noise = *fit.noise;
  CHECK(noise.correlated);
  CHECK_THAT(noise.phi, WithinAbs(0.8, 0.12));
  CHECK(noise.beyond == 1.0);
  Eigen::VectorXd residual;
  RowMatrix rows;
  REQUIRE(function.evaluate(fit.best.natural, residual, &rows));
  const Eigen::MatrixXd j = rows;
  Eigen::MatrixXd r(j.rows(), j.rows());
  for (Eigen::Index a = 0; a < r.rows(); ++a) {
    for (Eigen::Index b = 0; b < r.rows(); ++b) {
      r(a, b) = std::pow(noise.phi, static_cast<double>(std::abs(a - b)));
    }
  }
  const Eigen::MatrixXd bread = (j.transpose() * j).inverse();
  const Eigen::MatrixXd expected = noise.variance * bread * (j.transpose() * r * j) * bread;
  REQUIRE(noise.covariance.rows() == expected.rows());
  for (Eigen::Index k = 0; k < expected.rows(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    CHECK_THAT(noise.covariance(k, k), WithinRel(expected(k, k), 1e-6));
    CHECK_THAT(fit.parameters[i].standard_error.value(),
               WithinRel(std::sqrt(expected(k, k)), 1e-6));
    CHECK_THAT(noise.of[i].variance_ratio, WithinRel(expected(k, k) / bread(k, k), 1e-6));
    CHECK(noise.of[i].degrees > 5.0);
    CHECK(noise.of[i].degrees < 300.0);
  }
  CHECK_THAT(noise.inflation, WithinRel(r.sum() / static_cast<double>(r.rows()), 1e-9));
  CHECK(test::has_remark(fit.remarks, "correlated_noise"));
  CHECK(to_json(fit)["noise_of_estimates"]["parameters"].size() == fit.parameters.size());
}

TEST_CASE("noise that goes on from a rest into the fit is counted with its priors", "[intervals]") {
  test::PlacedTest made;
  made.rest_s = made.after_s = 4.0;
  made.ramp_s = 1.0;
  made.hold_s = 20.0;
  made.start_m = -2e-3;
  made.step_s = 0.1;
  made.phi = 0.9;
  made.noise_N = 1e-3;
  const std::vector<PreparedRecording> one{test::prepared(made, 5)};
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = made.reference_m;
  const FitConfig config = recording_config(test::spec_of(made), one, setup);
  const ExperimentResiduals declared(config, data_sets(one));
  const FitResult fit = fit_experiments(declared);
  const auto function = declared.copy();
  const double weight = std::sqrt(fit.inflation * fit.variance_factor);
  function->set_prior_weight(weight);
  const std::vector<FitParameter> parameters = searched_parameters(fit.config);
  const auto noise = noise_of_estimates(*function, parameters, fit.best.natural);
  REQUIRE(noise);
  REQUIRE(noise->correlated);
  REQUIRE(noise->free.size() == parameters.size());
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  REQUIRE(function->evaluate(fit.best.natural, residual, &jacobian));
  const Eigen::Index values = function->value_count(), n = residual.size();
  REQUIRE(n == values + 3);  // zero, contact, drift
  // Covariance of all residuals, those of the priors last.
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(n, n);
  const double variance = noise->variance * noise->beyond;
  for (Eigen::Index a = 0; a < values; ++a) {
    for (Eigen::Index b = 0; b < values; ++b) {
      c(a, b) = variance * std::pow(noise->phi, static_cast<double>(std::abs(a - b)));
    }
  }
  c.bottomRightCorner(3, 3).diagonal().setConstant(weight * weight);
  const Eigen::MatrixXd j = jacobian;
  const Eigen::MatrixXd to = (j.transpose() * j).inverse() * j.transpose();
  const Eigen::MatrixXd apart = to * c * to.transpose();
  std::size_t contact = 0;
  Eigen::Index prior = values;
  const auto drift = std::ranges::find_if(
      config.parameters, [](const EstimatedParameter& p) { return p.drift.has_value(); });
  REQUIRE(drift != config.parameters.end());
  const FitDatum& first = *std::ranges::find(function->data(), false, &FitDatum::held_out);
  const double sigma = first.sigma;
  const double away_s = first.time_s - made.step_s - drift->drift->origin_s;
  const auto zero = std::ranges::find_if(
      config.parameters, [](const EstimatedParameter& p) { return p.fit.name == "offset"; });
  const double line =
      std::pow(zero->prior.value().sd, 2) + std::pow(drift->prior.value().sd * away_s, 2);
  const double share = std::min(1.0, variance * sigma * sigma / line);
  for (std::size_t i = 0; i < config.parameters.size(); ++i) {
    const EstimatedParameter& p = config.parameters[i];
    if (p.fit.name == "contact") contact = i;
    if (!p.prior) continue;
    const double by = p.drift ? away_s : p.fit.name == "offset" ? 1.0 : 0.0;
    for (Eigen::Index a = 0; a < values; ++a) {
      c(a, prior) = weight * p.prior->sd * by * share / sigma *
                    std::pow(noise->phi, static_cast<double>(a + 1));
      c(prior, a) = c(a, prior);
    }
    ++prior;
  }
  const Eigen::MatrixXd expected = to * c * to.transpose();
  for (Eigen::Index k = 0; k < expected.rows(); ++k) {
    CAPTURE(parameters[static_cast<std::size_t>(k)].name);
    CHECK_THAT(noise->covariance(k, k), WithinRel(expected(k, k), 1e-6));
  }
  // Contact is where the readings leave the line of the rest, whose noise they share.
  const auto at = static_cast<Eigen::Index>(contact);
  CHECK(noise->covariance(at, at) < 0.7 * apart(at, at));
}

TEST_CASE("white noise keeps its exact intervals", "[intervals]") {
  const auto one = prepared_ramp(made_ramp(0.0, 4));
  const ExperimentResiduals function(ramp_config(one), data_sets(one));
  const FitResult fit = fit_experiments(function);
  CHECK_FALSE(fit.noise);
  CHECK(fit.inflation == 1.0);
}

TEST_CASE("the limits of a profile follow each parameter's own noise", "[intervals]") {
  const auto one = prepared_ramp(made_ramp(0.8, 5));
  FitConfig config = ramp_config(one);
  config.profiles = true;
  const ExperimentResiduals function(config, data_sets(one));
  const FitResult fit = fit_experiments(function);
  REQUIRE(fit.noise);
  const Threshold threshold = threshold_of(fit);
  const std::vector<FitParameter> parameters = searched_parameters(fit.config);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    const double risen =
        profile_deviance(function, parameters, std::vector<std::vector<double>>{fit.best.natural},
                         i, p.upper.value()) -
        fit.best.deviance;
    CHECK_THAT(risen, WithinRel(threshold.rise_of(i, fit.best.deviance), 1e-3));
  }
  const NoiseOfEstimates& noise = *fit.noise;
  CHECK(noise.of[0].variance_ratio != noise.of[1].variance_ratio);
}

TEST_CASE("a noise of half a step of the readings is no smaller one but by chance", "[intervals]") {
  test::PlacedTest made;
  made.start_m = -0.5e-3;
  const double step = 2.0 * made.noise_N;
  const Recording clean = test::placed(made);
  Random random(5);
  constexpr int kRests = 200;
  int widened = 0;
  for (int i = 0; i < kRests; ++i) {
    Recording readings = test::measured(made, clean, random);
    for (double& v : readings.response) v = step * std::round(v / step);
    const RestReadings rests = read_rests(prepare_recording("made.csv", std::move(readings)));
    REQUIRE(rests.zero);
    REQUIRE(rests.before >= 95);
    if (rests.zero->sd > 0.25 * step) ++widened;
  }
  CHECK(widened <= 20);  // 5 % are expected
}

TEST_CASE("readings that hide their noise widen an interval by half a step", "[intervals]") {
  Recording coarse = made_ramp(0.0, 6);
  const double step = 10.0 * kSigma;
  for (double& f : coarse.response) f = step * std::round(f / step);
  const auto one = prepared_ramp(coarse);
  const FitResult fit = run_fit(ramp_config(one), data_sets(one));
  REQUIRE(fit.noise);
  CHECK(test::has_remark(fit.remarks, "limited_by_resolution"));
  // All readings of a plateau half a step off: that is the bound of its stiffness, and more.
  for (const NoiseOfEstimate& e : fit.noise->of) CHECK(e.bias > 0.0);
  const double half_of_plateau = 0.5 * step / 5e-3;
  const double bound = fit.noise->of[0].bias * fit.parameters[0].standard_error.value() /
                       std::sqrt(fit.noise->of[0].variance_ratio);
  CHECK(bound > 0.9 * half_of_plateau);
  // Noise above half a step is noise: nothing is said.
  Recording fine = made_ramp(0.0, 6);
  for (double& f : fine.response) f = kSigma * std::round(f / kSigma);
  const auto two = prepared_ramp(fine);
  CHECK_FALSE(
      test::has_remark(run_fit(ramp_config(two), data_sets(two)).remarks, "limited_by_resolution"));
}

TEST_CASE("isolated outliers are left out and said, and the law's misfit is none", "[intervals]") {
  Recording r = made_ramp(0.0, 7);
  const auto clean = prepared_ramp(r);
  const FitResult before = run_fit(ramp_config(clean), data_sets(clean));
  for (const std::size_t i : {60U, 120U, 250U}) r.response[i] += 20.0 * kSigma;
  r.response[121] -= 20.0 * kSigma;  // two in a row on one side would be something that lasted
  const auto one = prepared_ramp(r);
  const FitResult fit = run_fit(ramp_config(one), data_sets(one));
  CHECK_THAT(std::string(test::remark_text(fit.remarks, "outliers_left_out")),
             Contains("4 outliers"));
  CHECK(std::ranges::count(fit.recordings.at(0).outlier, true) == 4);
  CHECK(fit.value_count == before.value_count - 4);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const double sd = before.parameters[i].standard_error.value();
    CHECK(std::abs(fit.parameters[i].estimate - before.parameters[i].estimate) < 0.5 * sd);
    CHECK_THAT(fit.parameters[i].standard_error.value(), WithinRel(sd, 0.1));
  }
  CHECK_THAT(to_terminal_text(fit), Contains("4 outliers left out"));
  // Another law: far from the curve, but together.
  FitConfig elastic = recording_config(parse_law_name("linear", "test"), clean, {});
  elastic.profiles = false;
  const FitResult of_elastic = run_fit(elastic, data_sets(clean));
  CHECK_FALSE(test::has_remark(of_elastic.remarks, "outliers_left_out"));
  CHECK_FALSE(test::has_remark(of_elastic.remarks, "outliers"));
}

TEST_CASE("a minimum that one start of five finds is not called identified", "[intervals]") {
  FitResult fit;
  ParameterResult p;
  p.parameter.name = "k1";
  p.estimate = 1.0;
  p.lower = 0.9;
  p.upper = 1.1;
  p.verdict = Verdict::identified;
  fit.parameters = {p};
  mark_unconfirmed(fit, Confirmation{5, 2, std::nullopt});
  CHECK(verdict_text(fit.parameters[0]) == "identified");
  mark_unconfirmed(fit, Confirmation{5, 1, std::nullopt});
  CHECK_THAT(
      verdict_text(fit.parameters[0]),
      Contains("not identified: found by one start of 5; another start has to end there, too "
               "(--starts 200"));
  CHECK_THAT(fit.parameters[0].summary, !Contains("is identified"));
}

TEST_CASE("order 1 of a spring-pot is a dashpot, and no bound", "[intervals]") {
  Candidate c;
  c.law = parse_law_name("linear-fmaxwell", "test");
  c.fit.config.law = c.law;
  ParameterResult alpha;
  alpha.parameter.name = "alpha";
  alpha.parameter.scale = Scale::linear;
  alpha.parameter.lower = 0.01;
  alpha.parameter.upper = 1.0;
  alpha.estimate = 1.0;
  alpha.at_upper_bound = true;
  c.fit.parameters = {alpha};
  const ProtocolSpans spans{.hold_s = 10.0};
  judge_identified(c, spans);
  CHECK(c.identified);
  CHECK(c.special == "alpha = 1: the spring-pot is a dashpot");
  ParameterResult& order = c.fit.parameters[0];
  order.verdict = Verdict::lower_only;
  CHECK(verdict_text(order) == "one-sided: lower limit only; 1: a dashpot");
  order.at_upper_bound = false;
  order.estimate = 0.9996;
  CHECK(verdict_text(order) == "one-sided: lower limit only; not told from 1, a dashpot");
  order.verdict = Verdict::identified;
  CHECK(verdict_text(order) == "identified");
  c.fit.parameters[0].at_lower_bound = true;
  judge_identified(c, spans);
  CHECK(c.reason == "alpha ends at its lower bound");
}

namespace {

Candidate made_candidate(const char* law, double delta_bic, int parameters, double k1_sd) {
  Candidate c;
  c.law = parse_law_name(law, "test");
  c.fit.config.law = c.law;
  c.delta_bic = delta_bic;
  c.parameters = parameters;
  ParameterResult k1;
  k1.parameter.name = c.law.branches > 0 ? "k1" : "k_inf";
  k1.parameter.scale = Scale::linear;
  k1.parameter.lower = 0.0;
  k1.estimate = 1.0;
  k1.standard_error = k1_sd;
  c.fit.parameters = {k1};
  return c;
}

Selection made_contest(double ahead, double sd) {
  Selection s;
  s.candidates = {made_candidate("linear-1", 0.0, 4, sd), made_candidate("linear", ahead, 2, 0.1)};
  for (Candidate& c : s.candidates) judge_identified(c, {.hold_s = 10.0});
  s.recommended = least_within(s.candidates, s.margin);
  return s;
}

}  // namespace

TEST_CASE("a Wald test that the profile contradicts does not count", "[intervals]") {
  const ProtocolSpans spans{.hold_s = 10.0};
  Selection s = made_contest(30.0, 0.8);
  CHECK(s.candidates[0].by_wald);
  CHECK(s.recommended == 1);
  const auto closed = [&](const LawSpec& law) {
    FitResult fit = law.branches > 0 ? s.candidates[0].fit : s.candidates[1].fit;
    fit.parameters[0].verdict = Verdict::identified;
    fit.parameters[0].lower = 0.2;
    fit.parameters[0].upper = 3.0;
    return fit;
  };
  settle_choice(s, spans, closed);
  CHECK(s.recommended == 0);
  CHECK(s.candidates[0].identified);
  CHECK_FALSE(s.preferred);
  // An interval that reaches 0 upholds it.
  s = made_contest(30.0, 0.8);
  const auto open = [&](const LawSpec& law) {
    FitResult fit = law.branches > 0 ? s.candidates[0].fit : s.candidates[1].fit;
    fit.parameters[0].verdict = Verdict::upper_only;
    fit.parameters[0].upper = 3.0;
    return fit;
  };
  settle_choice(s, spans, open);
  CHECK(s.recommended == 1);
  REQUIRE(s.preferred);
  CHECK(*s.preferred == 0);
  CHECK_THAT(
      least_law_words(s, "the data"),
      Contains("the data prefer linear-1, by 30 in BIC, but do not identify its parameters"));
  // No standard error is no more than one that is large: the profile decides.
  s = made_contest(30.0, 0.8);
  s.candidates[0].fit.parameters[0].standard_error.reset();
  judge_identified(s.candidates[0], spans);
  CHECK(s.candidates[0].reason == "k1 has no standard error");
  CHECK(s.candidates[0].by_wald);
  settle_choice(s, spans, closed);
  CHECK(s.recommended == 0);
  CHECK_FALSE(s.preferred);
  // A little behind is not worth two answers.
  s = made_contest(9.0, 0.8);
  settle_choice(s, spans, open);
  CHECK(s.recommended == 1);
  CHECK_FALSE(s.preferred);
}

TEST_CASE("relaxation times are stated as a list or a range", "[intervals]") {
  CHECK(parse_times("0.1 s, 1 s,10 s", "--times") == std::vector<double>{0.1, 1.0, 10.0});
  const std::vector<double> range = parse_times("1 ms : 1000 s : 13", "--times");
  REQUIRE(range.size() == 13);
  CHECK_THAT(range[0], WithinRel(1e-3, 1e-12));
  CHECK_THAT(range[6], WithinRel(1.0, 1e-12));
  CHECK_THAT(range[12], WithinRel(1e3, 1e-12));
  CHECK_THROWS_WITH(parse_times("1 s, 1 s", "--times"),
                    Contains("--times: 1 s after 1 s; expected "));
  CHECK_THROWS_WITH(parse_times("1 s : 2 s", "--times"), Contains("FIRST : LAST : COUNT"));
  CHECK_THROWS_WITH(parse_times("1 kg", "--times"), Contains("--times"));
  const std::vector<double> two{1.0, 2.0};
  CHECK(law_name(law_of_times(std::nullopt, two, "--times")) == "linear-2");
  CHECK_THROWS_WITH(law_of_times(parse_law_name("hertz-1", "test"), two, "--times"),
                    Contains("2 times for the law hertz-1"));
  CHECK(stated_time("tau2", two) == 2.0);
  CHECK_FALSE(stated_time("tau3", two));
  CHECK_FALSE(stated_time("k1", two));
}

TEST_CASE("a Prony series of 31 stated times is one linear problem", "[intervals]") {
  Recording g;
  g.drive_quantity = Quantity::strain;
  g.response_quantity = Quantity::relaxation_modulus;
  const std::vector<double> times_s = parse_times("1e-8 s : 1e7 s : 31", "test");
  std::vector<double> weight;
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    weight.push_back(1e3 * (1.0 + std::sin(0.7 * static_cast<double>(k))) + 50.0);
  }
  for (int i = 0; i < 300; ++i) {
    const double t = std::pow(10.0, -9.0 + 17.0 * i / 299.0);
    double sum = 2000.0;
    for (std::size_t k = 0; k < times_s.size(); ++k) sum += weight[k] * std::exp(-t / times_s[k]);
    g.time_s.push_back(t);
    g.response.push_back(sum);
  }
  SelectionOptions options;
  options.setup.times_s = times_s;
  options.laws = {law_of_times(std::nullopt, times_s, "test")};
  options.only_listed = true;
  options.setup.profiles = false;
  const Selection s = select_law(MaterialFunction{"made", g, {}, {}}, options);
  const FitResult& fit = s.candidates[0].fit;
  CHECK(fit.starts_run == 1);
  REQUIRE(fit.parameters.size() == 32);
  CHECK_THAT(fit.parameters[0].estimate, WithinRel(2000.0, 1e-3));
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    CHECK_THAT(fit.parameters[k + 1].estimate, WithinRel(weight[k], 1e-3));
  }
}
