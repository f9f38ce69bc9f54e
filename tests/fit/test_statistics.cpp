// Correlation of residuals, thresholds, bootstrap and prediction bands, against closed forms,
// other implementations and simulation.
#include <Eigen/LU>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <ctime>

#include "expected_values.hpp"
#include "statistics_problems.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/prediction.hpp"
#include "tpm/fit/verdict.hpp"

using namespace tpm;
using namespace tpm::fit;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

// --- correlation ---------------------------------------------------------------------------------

TEST_CASE("the effective number of an autoregression is n (1 - phi) / (1 + phi)") {
  Random random(3);
  for (const double phi : {0.3, 0.6, 0.9}) {
    double mean = 0.0;
    for (int i = 0; i < 10; ++i) {
      const Correlation c = residual_correlation(autoregression(10000, phi, random));
      CHECK(c.significant);
      CHECK_THAT(c.lag1, WithinAbs(phi, 0.05));
      mean += 0.1 * c.effective_count;
    }
    CAPTURE(phi);
    CHECK_THAT(mean, WithinRel(10000.0 * (1.0 - phi) / (1.0 + phi), 0.12));
  }
  const Correlation alternating = residual_correlation(autoregression(10000, -0.5, random));
  CHECK(alternating.significant);
  CHECK_THAT(alternating.integrated_time, WithinRel(1.0 / 3.0, 0.1));
  CHECK(alternating.effective_count == 10000.0);
  CHECK(alternating.inflation() == 1.0);
  CHECK_THAT(alternating.summary, Contains("alternate"));
}

TEST_CASE("independent residuals keep their number") {
  Random random(1);
  int alarms = 0;
  constexpr int kSets = 2000;
  for (int i = 0; i < kSets; ++i) {
    const Correlation c = residual_correlation(normal_errors(100, random));
    if (c.significant) {
      ++alarms;
    } else {
      CHECK(c.effective_count == 100.0);
    }
  }
  CAPTURE(alarms);
  CHECK(alarms > 6);  // 1 % of 2000, and three standard deviations either way
  CHECK(alarms < 45);
}

TEST_CASE("odd residuals: constant, zero, three, none, several recordings") {
  const std::vector<double> constant(500, 0.7);
  const Correlation c = residual_correlation(constant);
  CHECK(c.significant);
  CHECK_THAT(c.effective_count, WithinAbs(1.0, 1e-6));
  const Correlation zero = residual_correlation(std::vector<double>(500, 0.0));
  CHECK_FALSE(zero.significant);
  CHECK(zero.effective_count == 500.0);
  const Correlation three = residual_correlation(std::vector<double>{1.0, 1.0, 1.0});
  CHECK(three.effective_count == 3.0);
  CHECK(three.ljung_box_lags == 0);
  CHECK_THAT(three.summary, Contains("too few"));
  CHECK(residual_correlation(std::vector<double>{}).inflation() == 1.0);
  CHECK_THROWS_WITH(residual_correlation(std::vector<double>{1.0, std::nan("")}),
                    Contains("finite"));

  // Pooling two halves is almost the whole; the products across the cut are missing.
  Random random(9);
  const std::vector<double> whole = autoregression(20000, 0.7, random);
  const std::array<std::span<const double>, 3> halves{
      std::span(whole).first(8000), std::span<const double>(), std::span(whole).subspan(8000)};
  CHECK_THAT(residual_correlation(halves).lag1, WithinAbs(residual_correlation(whole).lag1, 1e-3));
}

TEST_CASE("the autocorrelation is the sum of lagged products, and a million residuals are quick") {
  const std::vector<double> x{1.0, -2.0, 3.0, 0.5, 1.0, -1.0};
  double products = 0.0;
  double squares = 1.0;  // of the last
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    products += x[i] * x[i + 1];
    squares += x[i] * x[i];
  }
  const Correlation c = residual_correlation(x);
  CHECK_THAT(c.lag1, WithinRel(products / squares, 1e-12));
  // Ljung and Box's Q with one lag, chi-square with one degree of freedom.
  const double q = 6.0 * 8.0 / 5.0 * c.lag1 * c.lag1;
  CHECK_THAT(c.ljung_box_p, WithinRel(std::erfc(std::sqrt(q / 2.0)), 1e-10));

  Random random(2);
  const std::vector<double> many = autoregression(1000000, 0.99, random);
  const std::clock_t begin = std::clock();
  const Correlation long_one = residual_correlation(many);
  const double processor_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  CHECK_THAT(long_one.inflation(), WithinRel(199.0, 0.25));
  CHECK(processor_s < test::allowed_cost("fit.correlation_of_a_million_residuals"));
}

TEST_CASE("blocks grow with the correlation and the number of readings") {
  CHECK(block_length(1.0, 1000) == 1);
  CHECK(block_length(0.4, 1000) == 1);
  // rho = 0.5: (6 n)^(1/3) (rho / (1 - rho^2))^(2/3)
  CHECK(block_length(3.0, 1000) ==
        static_cast<std::size_t>(std::ceil(std::cbrt(6000.0) * std::pow(0.5 / 0.75, 2.0 / 3.0))));
  CHECK(block_length(1e9, 30) == 15);
}

// --- thresholds ----------------------------------------------------------------------------------

TEST_CASE("thresholds grow with the inflation and are untouched without") {
  Threshold plain{0.95, true, 40, 2};
  CHECK_THAT(plain.rise(30.0), WithinRel(3.841458820694124, 1e-13));
  Threshold inflated = plain;
  inflated.inflation = 4.0;
  CHECK_THAT(inflated.rise(30.0), WithinRel(4.0 * plain.rise(30.0), 1e-14));
  CHECK_THAT(inflated.p_value(8.0, 30.0), WithinRel(plain.p_value(2.0, 30.0), 1e-14));

  plain.scale_known = inflated.scale_known = false;
  CHECK(plain.variance_factor(30.0) == 30.0 / 38.0);
  CHECK(inflated.residual_degrees() == 8.0);
  CHECK(inflated.variance_factor(30.0) == 30.0 / 32.0);
  const double f = boost::math::quantile(boost::math::fisher_f(1, 8), 0.95);
  CHECK_THAT(inflated.rise(30.0), WithinRel(4.0 * 30.0 / 32.0 * f, 1e-13));
  CHECK_THAT(inflated.p_value(inflated.rise(30.0), 30.0), WithinRel(0.05, 1e-10));
  inflated.inflation = 39.0;
  CHECK(inflated.residual_degrees() == 1.0);

  Random random(4);
  const CurveResiduals function(
      straight_line, curve_data(straight_line, {1.0, 2.0}, 1.0, 0.1, normal_errors(30, random)));
  const Minimum m = minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
  const Threshold known{0.95, true, 30, 2};
  Threshold nine = known;
  nine.inflation = 9.0;
  const Covariance one = linear_covariance(function, line_parameters(), m, known);
  const Covariance wide = linear_covariance(function, line_parameters(), m, nine);
  CHECK_THAT(wide.theta_sd[0], WithinRel(3.0 * one.theta_sd[0], 1e-12));
  const Profile p = profile_likelihood(function, line_parameters(), {&m, 1}, 0, wide, nine);
  CHECK_THAT(*p.upper - *p.lower, WithinRel(2.0 * 1.959963984540054 * wide.theta_sd[0], 1e-6));
}

namespace {

/// One reading of 1 with a standard deviation of 1, by a model that ends below 0.9.
class EndingModel final : public ResidualFunction {
 public:
  Eigen::Index residual_count() const override { return 1; }
  bool evaluate(std::span<const double> p, Eigen::VectorXd& r, RowMatrix* j) const override {
    if (p[0] < 0.9) return false;
    r = Eigen::VectorXd::Constant(1, p[0] - 1.0);
    if (j != nullptr) *j = RowMatrix::Ones(1, 1);
    return true;
  }
};

}  // namespace

TEST_CASE("an interval ends where the model does, soon and said in words") {
  const EndingModel function;
  const std::vector<FitParameter> parameters{{"p", {}, Scale::linear, 1.0, -10.0, 10.0}};
  const std::vector<Minimum> minima{minimise(function, parameters, std::vector<double>{1.2})};
  const Threshold threshold{0.95, true, 1, 1};
  const Profile profile = profile_likelihood(
      function, parameters, minima, 0,
      linear_covariance(function, parameters, minima.front(), threshold), threshold);
  CHECK(profile.cut_short);
  CHECK(profile.failures < test::allowed_cost("fit.profile_past_end_of_model"));
  CHECK_THAT(profile.lower.value(), WithinAbs(0.9, 2e-3));
  CHECK_THAT(profile.upper.value(), WithinAbs(2.95996, 1e-4));
  ParameterResult result;
  result.parameter = parameters.front();
  result.estimate = 1.0;
  result.lower = profile.lower;
  result.upper = profile.upper;
  result.profile = profile;
  result.verdict = verdict_of(result);
  CHECK_THAT(parameter_words(result, 0.95),
             Contains("a limit is where the model can no longer be evaluated"));
}

TEST_CASE("fewer residuals than parameters are rank-deficient, not undefined") {
  const CurveResiduals function(straight_line, {{2.0}, {5.0}, 1.0, {}});
  Minimum m;
  m.natural = {1.0, 2.0};
  const Covariance c = linear_covariance(function, line_parameters(), m, Threshold{});
  CHECK_FALSE(c.full_rank);
  REQUIRE(c.singular_values.size() == 2);
  CHECK_THAT(c.singular_values[1], WithinAbs(0.0, 1e-12));
  CHECK_THAT(c.weakest_direction[0] + 2.0 * c.weakest_direction[1], WithinAbs(0.0, 1e-12));
}

// --- bootstrap -----------------------------------------------------------------------------------

TEST_CASE("the residual bootstrap of a straight line has the standard errors of linear theory") {
  Random random(21);
  const CurveData data = curve_data(straight_line, {1.0, 2.0}, 1.0, 0.1, normal_errors(40, random));
  const CurveRefit refit(straight_line, data, 1);
  const CurveResiduals function(straight_line, data);
  const Minimum m = minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
  Threshold estimated{0.95, false, 40, 2};
  const Covariance c = linear_covariance(function, line_parameters(), m, estimated);
  BootstrapOptions options;
  options.replicates = 1000;
  options.seed = 5;
  const BootstrapResult b = bootstrap(refit, line_parameters(), m, options);
  CHECK(b.failed == 0);
  for (std::size_t i = 0; i < 2; ++i) {
    const BootstrapParameter& p = b.parameters[i];
    const double sd = c.theta_sd[static_cast<Eigen::Index>(i)];
    CAPTURE(p.name, sd, p.standard_error);
    CHECK_THAT(p.standard_error, WithinRel(sd, 0.08));
    CHECK(std::abs(p.bias) < 4.0 * sd / std::sqrt(1000.0));
    const double half = 1.96 * sd;
    CHECK_THAT(p.percentile.lower, WithinAbs(p.estimate - half, 0.25 * half));
    CHECK_THAT(p.percentile.upper, WithinAbs(p.estimate + half, 0.25 * half));
    REQUIRE(p.bca);
    CHECK_THAT(p.bca->lower, WithinAbs(p.estimate - half, 0.3 * half));
    CHECK_THAT(p.bca->upper, WithinAbs(p.estimate + half, 0.3 * half));
    CHECK(std::abs(p.acceleration) < 0.1);
  }
  const BootstrapResult again = bootstrap(refit, line_parameters(), m, options);
  CHECK(again.parameters[0].replicates == b.parameters[0].replicates);
  options.seed = 6;
  const BootstrapResult other = bootstrap(refit, line_parameters(), m, options);
  CHECK(other.parameters[0].replicates != b.parameters[0].replicates);
}

TEST_CASE("the residual bootstrap of an exponential decay has the linearised standard errors") {
  Random random(22);
  const CurveData data = curve_data(decay, {3.0, 2.0}, 8.0, 0.03, normal_errors(50, random));
  const CurveRefit refit(decay, data, 1);
  const CurveResiduals function(decay, data);
  const Minimum m = minimise(function, decay_parameters(), std::vector<double>{1.0, 1.0});
  const Covariance c =
      linear_covariance(function, decay_parameters(), m, Threshold{0.95, false, 50, 2});
  BootstrapOptions options;
  options.replicates = 600;
  const BootstrapResult b = bootstrap(refit, decay_parameters(), m, options);
  for (std::size_t i = 0; i < 2; ++i) {
    const double sd = c.theta_sd[static_cast<Eigen::Index>(i)] * m.natural[i];
    CHECK_THAT(b.parameters[i].standard_error, WithinRel(sd, 0.1));
  }
}

TEST_CASE("whole recordings carry the spread between specimens") {
  // Ten recordings of 8 readings, each with an offset of its own that is ten times the noise.
  Random random(23);
  CurveData data{{}, {}, 0.05, {}};
  std::vector<double> offsets;
  for (int r = 0; r < 10; ++r) {
    offsets.push_back(0.5 * random.normal());
    for (int i = 0; i < 8; ++i) {
      data.x.push_back(i / 7.0);
      data.y.push_back(1.0 + offsets.back() + 2.0 * data.x.back() + 0.05 * random.normal());
    }
  }
  const CurveResiduals function(straight_line, data);
  const Minimum m = minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
  const CurveRefit refit(straight_line, data, 10);
  BootstrapOptions options;
  options.replicates = 600;
  options.resampling = Resampling::recordings;
  const BootstrapResult b = bootstrap(refit, line_parameters(), m, options);
  const double mean = std::accumulate(offsets.begin(), offsets.end(), 0.0) / 10.0;
  double square = 0.0;
  for (const double o : offsets) square += (o - mean) * (o - mean) / 10.0;
  // The intercept is nearly the mean of the offsets.
  CHECK_THAT(b.parameters[0].standard_error, WithinRel(std::sqrt(square / 10.0), 0.15));
  CHECK(b.parameters[1].standard_error < 0.05);
  CHECK_THAT(b.summary, Contains("whole recordings"));

  const CurveRefit single(straight_line, data, 1);
  CHECK_THROWS_WITH(bootstrap(single, line_parameters(), m, options), Contains("at least 2"));
  options.replicates = 3;
  CHECK_THROWS_WITH(bootstrap(refit, line_parameters(), m, options), Contains("at least 20"));
}

namespace {

/// Fits that cannot be evaluated when the first reading's residual is above a limit.
class Fragile final : public Refittable {
 public:
  Fragile(const CurveRefit& sound, double limit) : sound_(sound), limit_(limit) {}
  std::vector<std::size_t> recording_lengths() const override { return sound_.recording_lengths(); }
  std::vector<double> standardised_residuals(std::span<const double> p) const override {
    return sound_.standardised_residuals(p);
  }
  std::unique_ptr<ResidualFunction> with_residuals(std::span<const double> p,
                                                   std::span<const double> z) const override {
    if (z[0] > limit_) return std::make_unique<Broken>();
    return sound_.with_residuals(p, z);
  }
  std::unique_ptr<ResidualFunction> with_readings(
      std::span<const std::size_t> readings) const override {
    return sound_.with_readings(readings);
  }

 private:
  struct Broken final : ResidualFunction {
    Eigen::Index residual_count() const override { return 2; }
    bool evaluate(std::span<const double>, Eigen::VectorXd&, RowMatrix*) const override {
      return false;
    }
  };
  const CurveRefit& sound_;
  double limit_;
};

}  // namespace

TEST_CASE("failed refits are counted and said") {
  Random random(24);
  const CurveData data = curve_data(straight_line, {1.0, 2.0}, 1.0, 0.1, normal_errors(30, random));
  const CurveRefit refit(straight_line, data, 1);
  const CurveResiduals function(straight_line, data);
  const Minimum m = minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
  BootstrapOptions options;
  options.replicates = 200;
  const BootstrapResult b = bootstrap(Fragile(refit, 1.0), line_parameters(), m, options);
  CHECK(b.failed > 0);
  CHECK(b.parameters[0].replicates.size() + static_cast<std::size_t>(b.failed) == 200);
  CHECK_THAT(b.summary, Contains("of them failed and are left out"));
  CHECK_THROWS_WITH(bootstrap(Fragile(refit, -0.5), line_parameters(), m, options),
                    Contains("refits failed"));
}

// --- prediction bands ----------------------------------------------------------------------------

TEST_CASE("bands of a straight line are the textbook's") {
  Random random(31);
  const CurveData data = curve_data(straight_line, {1.0, 2.0}, 3.0, 0.2, normal_errors(15, random));
  const CurveResiduals function(straight_line, data);
  const Minimum m = minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
  const Threshold threshold{0.95, false, 15, 2};
  const Covariance c = linear_covariance(function, line_parameters(), m, threshold);
  // At new points, the last beyond the data.
  const std::vector<double> x{0.0, 1.4, 3.0, 6.0};
  RowMatrix sensitivity(4, 2);
  Eigen::VectorXd predicted(4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    predicted[i] =
        straight_line(x[static_cast<std::size_t>(i)], m.natural, sensitivity.row(i).data());
  }
  const Eigen::VectorXd noise = Eigen::VectorXd::Constant(4, 0.2);
  const PredictionBands bands =
      prediction_bands(predicted, sensitivity, line_parameters(), m, c, threshold, noise);
  // s^2 = RSS / (n - 2); h = 1/n + (x - mean)^2 / Sxx
  const double mean = std::accumulate(data.x.begin(), data.x.end(), 0.0) / 15.0;
  double sxx = 0.0;
  double rss = 0.0;
  for (std::size_t i = 0; i < 15; ++i) {
    sxx += (data.x[i] - mean) * (data.x[i] - mean);
    rss += std::pow(data.y[i] - m.natural[0] - m.natural[1] * data.x[i], 2);
  }
  const double s = std::sqrt(rss / 13.0);
  const double t = boost::math::quantile(boost::math::students_t(13), 0.975);
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double d = x[static_cast<std::size_t>(i)] - mean;
    const double h = 1.0 / 15.0 + d * d / sxx;
    CHECK_THAT(bands.standard_error[i], WithinRel(s * std::sqrt(h), 1e-8));
    CHECK_THAT(bands.upper[i] - predicted[i], WithinRel(t * s * std::sqrt(h), 1e-8));
    CHECK_THAT(predicted[i] - bands.reading_lower[i], WithinRel(t * s * std::sqrt(1 + h), 1e-8));
  }
  const PredictionBands known = prediction_bands(predicted, sensitivity, line_parameters(), m, c,
                                                 Threshold{0.95, true, 15, 2}, {});
  CHECK_THAT(known.multiplier, WithinRel(1.959963984540054, 1e-12));
  CHECK(known.reading_lower.size() == 0);
  CHECK_THROWS_WITH(
      prediction_bands(predicted, sensitivity.topRows(2), line_parameters(), m, c, threshold, {}),
      Contains("one row per prediction"));
  CHECK_THROWS_WITH(
      prediction_bands(predicted, sensitivity, line_parameters(), m, {}, threshold, {}),
      Contains("full rank"));
}

TEST_CASE("bands follow the coordinate of the parameters") {
  Random random(32);
  const CurveData data = curve_data(decay, {3.0, 2.0}, 8.0, 0.05, normal_errors(40, random));
  const CurveResiduals function(decay, data);
  const auto standard_errors = [&](std::vector<FitParameter> parameters) {
    const Minimum m = minimise(function, parameters, std::vector<double>{2.5, 2.5});
    const Covariance c = linear_covariance(function, parameters, m, Threshold{});
    return prediction_standard_errors(function.sensitivity(m.natural), parameters, m.natural, c);
  };
  const Eigen::VectorXd in_logarithm = standard_errors(decay_parameters());
  const Eigen::VectorXd in_value = standard_errors(
      {parameter("a", Scale::linear, 3, 0.1, 9), parameter("t", Scale::linear, 2, 0.1, 9)});
  const Eigen::VectorXd mixed = standard_errors(
      {parameter("a", Scale::inverse_square, 3, 0.1, 9), parameter("t", Scale::log, 2, 0.1, 9)});
  for (Eigen::Index i = 0; i < in_value.size(); ++i) {
    CHECK_THAT(in_logarithm[i], WithinRel(in_value[i], 1e-6));
    CHECK_THAT(mixed[i], WithinRel(in_value[i], 1e-6));
  }
}
