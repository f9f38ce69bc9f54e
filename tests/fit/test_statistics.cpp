// Likelihoods, correlation, bootstrap, bands, derivatives, specimens and the words about them,
// each against a textbook formula, another library or a published number.
#include <Eigen/LU>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/laplace.hpp>
#include <boost/math/distributions/lognormal.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <catch2/catch.hpp>
#include <ctime>
#include <limits>
#include <numbers>

#include "expected_values.hpp"
#include "gradient_check.hpp"
#include "statistics_problems.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/fit/likelihood/estimated_sigma.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/fit/likelihood/noise.hpp"
#include "tpm/fit/prediction.hpp"
#include "tpm/fit/select/random_effects.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/fit/waterfall.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::files;
using namespace tpm::organ;
using namespace tpm::fit;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const ErrorLaw kNormal{};
const ErrorLaw kLaplace{ErrorShape::laplace, ErrorScale::linear, 4.0};
const ErrorLaw kStudent{ErrorShape::student_t, ErrorScale::linear, 4.0};

ErrorLaw on_scale(ErrorLaw law, ErrorScale scale) {
  law.scale = scale;
  return law;
}

/// Normal readings of a constant with sigma = a + b |mean|; parameters mean, a, b.
class EstimatedNoise final : public ResidualFunction {
 public:
  EstimatedNoise(std::vector<double> y, std::vector<double> gain, EstimatedSigma sigma,
                 ErrorLaw law = {})
      : y_(std::move(y)), gain_(std::move(gain)), sigma_(sigma), law_(law) {}

  Eigen::Index residual_count() const override { return 2 * static_cast<Eigen::Index>(y_.size()); }
  double offset() const override { return kNormalisationOffset * static_cast<double>(y_.size()); }
  bool evaluate(std::span<const double> p, Eigen::VectorXd& r, RowMatrix* j) const override {
    r.resize(residual_count());
    if (j != nullptr) j->resize(residual_count(), 3);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const auto n = noise_residual(law_, sigma_, y_[i], p[0] * gain_[i], p[1], p[2]);
      if (!n) return false;
      const auto row = 2 * static_cast<Eigen::Index>(i);
      r[row] = n->residual.value;
      r[row + 1] = n->normalisation.value;
      if (j != nullptr) put(*n, i, row, *j);
    }
    return true;
  }
  bool information_root(std::span<const double> p, RowMatrix& root) const override {
    root.resize(residual_count(), 3);
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const auto n = noise_information(law_, sigma_, p[0] * gain_[i], p[1], p[2]);
      if (!n) return false;
      put(*n, i, 2 * static_cast<Eigen::Index>(i), root);
    }
    return true;
  }

 private:
  void put(const NoiseResidual& n, std::size_t i, Eigen::Index row, RowMatrix& j) const {
    j.row(row) << n.residual.by_f * gain_[i], n.residual.by_a, n.residual.by_b;
    j.row(row + 1) << n.normalisation.by_f * gain_[i], n.normalisation.by_a, n.normalisation.by_b;
  }

  std::vector<double> y_, gain_;
  EstimatedSigma sigma_;
  ErrorLaw law_;
};

FitResult result_with(std::vector<FitParameter> parameters, const std::vector<double>& direction,
                      double weakest, bool full_rank) {
  FitResult result;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    ParameterResult p;
    p.parameter = parameters[i];
    result.parameters.push_back(p);
    result.covariance.free.push_back(i);
  }
  result.covariance.weakest_direction =
      Eigen::Map<const Eigen::VectorXd>(direction.data(),
                                        static_cast<Eigen::Index>(direction.size()))
          .normalized();
  result.covariance.singular_values = Eigen::Vector2d(1.4, weakest);
  result.covariance.full_rank = full_rank;
  return result;
}

const Unit kPascal{"Pa", Dimension::stress, 1.0};
const Unit kPascalSecond{"Pa s", Dimension::viscosity, 1.0};

FitParameter log_parameter(const char* name, const Unit& unit = kPascal) {
  return parameter(name, Scale::log, 1.0, 1e-3, 1e3, unit);
}

}  // namespace

// --- error laws ----------------------------------------------------------------------------------

TEST_CASE("log densities equal Boost's distributions, constants included") {
  namespace bm = boost::math;
  for (const double sigma : {1e-6, 0.3, 1.6, 2e5}) {
    for (const double z : {-7.0, -0.4, 0.0, 1e-8, 2.5}) {
      const double f = 4.5 * sigma;
      const double y = f + z * sigma;
      CAPTURE(sigma, z);
      CHECK_THAT(log_density(kNormal, y, f, sigma),
                 WithinRel(std::log(bm::pdf(bm::normal(f, sigma), y)), 1e-12));
      CHECK_THAT(log_density(kLaplace, y, f, sigma),
                 WithinRel(std::log(bm::pdf(bm::laplace(f, sigma), y)), 1e-12));
      for (const double nu : {2.5, 4.0, 30.0}) {
        const ErrorLaw student{ErrorShape::student_t, ErrorScale::linear, nu};
        const double expected =
            std::log(bm::pdf(bm::students_t(nu), (y - f) / sigma)) - std::log(sigma);
        CHECK_THAT(log_density(student, y, f, sigma), WithinAbs(expected, 1e-10));
      }
    }
  }
  // Log-normal: Boost's density is by y itself, too.
  CHECK_THAT(log_density(on_scale(kNormal, ErrorScale::ln), 5.3, 4.5, 0.2),
             WithinRel(std::log(bm::pdf(bm::lognormal(std::log(4.5), 0.2), 5.3)), 1e-12));
  CHECK(log_density(on_scale(kNormal, ErrorScale::ln), -1.0, 4.5, 0.2) ==
        -std::numeric_limits<double>::infinity());
}

TEST_CASE("log densities are PEtab's") {
  // PEtab's six definitions at its own test point: measurement 5.3, simulation 4.5, noise 1.6.
  const double m = 5.3;
  const double s = 4.5;
  const double sigma = 1.6;
  const double two_pi = 2.0 * std::numbers::pi;
  const double ln10 = std::log(10.0);
  const double dln = (std::log(s) - std::log(m)) / sigma;
  const double dlog10 = (std::log10(s) - std::log10(m)) / sigma;
  const double lin = (s - m) / sigma;
  const auto llh = [&](const ErrorLaw& law, ErrorScale scale) {
    return log_density(on_scale(law, scale), m, s, sigma);
  };
  CHECK_THAT(llh(kNormal, ErrorScale::linear),
             WithinRel(-0.5 * (lin * lin + std::log(two_pi * sigma * sigma)), 1e-13));
  CHECK_THAT(llh(kNormal, ErrorScale::ln),
             WithinRel(-0.5 * (dln * dln + std::log(two_pi * sigma * sigma * m * m)), 1e-13));
  CHECK_THAT(
      llh(kNormal, ErrorScale::log10),
      WithinRel(-0.5 * (dlog10 * dlog10 + std::log(two_pi * sigma * sigma * m * m * ln10 * ln10)),
                1e-13));
  CHECK_THAT(llh(kLaplace, ErrorScale::linear),
             WithinRel(-std::abs(lin) - std::log(2.0 * sigma), 1e-13));
  CHECK_THAT(llh(kLaplace, ErrorScale::ln),
             WithinRel(-std::abs(dln) - std::log(2.0 * sigma * m), 1e-13));
  CHECK_THAT(llh(kLaplace, ErrorScale::log10),
             WithinRel(-std::abs(dlog10) - std::log(2.0 * sigma * m * ln10), 1e-13));

  // Its test case 0001: a reaction A <-> B from A = 1 with k1 = 0.8, k2 = 0.6, readings 0.7 at 0
  // and 0.1 at 10, noise 0.5; printed there: llh -0.84750169713188.
  const double a10 = (0.6 + 0.8 * std::exp(-14.0)) / 1.4;
  CHECK_THAT(log_density(kNormal, 0.7, 1.0, 0.5) + log_density(kNormal, 0.1, a10, 0.5),
             test::expected("reaction_a_b.log_likelihood"));
}

TEST_CASE("the square of a shaped residual is the deviance of its law") {
  for (const double z : {-40.0, -2.0, -1e-3, 1e-12, 0.5, 3.0, 1e6}) {
    CAPTURE(z);
    for (const ErrorLaw& law : {kNormal, kStudent, kLaplace}) {
      const ShapedResidual shaped = shaped_residual(law, z);
      const double rise = 2.0 * (log_density(law, 0.0, 0.0, 1.0) - log_density(law, z, 0.0, 1.0));
      const double tip = law.shape == ErrorShape::laplace ? 2.0 * kLaplaceTip : 0.0;
      CHECK(shaped.r * shaped.r <= rise * (1.0 + 1e-9) + 1e-15);
      CHECK(shaped.r * shaped.r >= (rise - tip) * (1.0 - 1e-9) - 1e-15);
      CHECK(std::signbit(shaped.r) == std::signbit(z));
      const double h = 1e-5 * std::max(std::abs(z), 1e-4);
      const double difference =
          (shaped_residual(law, z + h).r - shaped_residual(law, z - h).r) / (2.0 * h);
      CHECK_THAT(shaped.slope, WithinRel(difference, 1e-6));
    }
  }
  for (const ErrorLaw& law : {kStudent, kLaplace}) {
    CHECK(shaped_residual(law, 0.0).r == 0.0);
    CHECK(shaped_residual(law, 0.0).slope > 0.0);
  }
}

TEST_CASE("drawn errors have the law's standard deviation, and sigma is the scale") {
  Random random(7);
  for (const ErrorLaw& law :
       {kNormal, kLaplace, ErrorLaw{ErrorShape::student_t, ErrorScale::linear, 12.0}}) {
    double squares = 0.0;
    constexpr int kDraws = 20000;
    for (int i = 0; i < kDraws; ++i) {
      const double z = draw_error(law, random);
      squares += z * z;
    }
    CHECK_THAT(std::sqrt(squares / kDraws), WithinRel(standard_deviation(law, 1.0), 0.03));
  }
  CHECK_THAT(standard_deviation(kLaplace, 2.0), WithinRel(2.0 * std::sqrt(2.0), 1e-15));
  CHECK_THAT(standard_deviation(kStudent, 2.0), WithinRel(2.0 * std::sqrt(2.0), 1e-15));
  CHECK_THAT(scattered(on_scale(kNormal, ErrorScale::log10), 2.0, 1.0, 1.0),
             WithinRel(20.0, 1e-15));
  CHECK_THAT(scattered(on_scale(kNormal, ErrorScale::ln), 2.0, 1.0, 0.0), WithinRel(2.0, 1e-15));
}

TEST_CASE("an error law is read and refused by name") {
  for (const ErrorShape shape : {ErrorShape::normal, ErrorShape::laplace, ErrorShape::student_t}) {
    CHECK(parse_error_shape(error_shape_name(shape), "x") == shape);
  }
  CHECK_THROWS_WITH(parse_error_shape("cauchy", "fit.json"),
                    "fit.json: unknown noise distribution 'cauchy'; expected one of normal, "
                    "laplace, student_t");
  CHECK_THROWS_WITH(require_valid({ErrorShape::student_t, ErrorScale::linear, 2.0}, "fit.json"),
                    Contains("expected a number above 2"));
  CHECK_NOTHROW(require_valid({ErrorShape::laplace, ErrorScale::linear, 0.0}, "fit.json"));
}

TEST_CASE("an error law gives a residual its shape") {
  DatumResidual r{2.0, 3.0};
  apply_shape(kNormal, r);
  CHECK((r.r == 2.0 && r.d_r == 3.0));
  apply_shape(kStudent, r);
  CHECK_THAT(r.r * r.r, WithinRel(5.0 * std::log(2.0), 1e-14));
}

TEST_CASE("Laplace noise fits a constant by the median, Student's t resists an outlier") {
  const std::vector<double> zeros(7, 0.0);
  CurveData data{{0, 0, 0, 0, 0, 0, 0}, {1.0, 1.2, 1.3, 1.35, 1.5, 1.7, 50.0}, 0.1, kLaplace};
  const std::vector<FitParameter> parameters = line_parameters();
  const std::vector<double> start{20.0, 0.0};
  const FixedMask slope_fixed{false, true};
  const auto fitted = [&](const ErrorLaw& law) {
    data.law = law;
    const CurveResiduals function(straight_line, data);
    const Minimum m = minimise(function, parameters, start, slope_fixed);
    CHECK(m.converged);
    return m.natural[0];
  };
  CHECK_THAT(fitted(kLaplace), WithinAbs(1.35, 1e-3));
  CHECK_THAT(fitted(kNormal), WithinAbs(59.05 / 7 - 0.15, 0.2));
  CHECK_THAT(fitted(kStudent), WithinAbs(1.34, 0.05));
}

// --- estimated sigma -----------------------------------------------------------------------------

TEST_CASE("residuals of an estimated sigma have exact derivatives") {
  const EstimatedSigma sigma{{}, {}, 3.0};
  for (const ErrorLaw& base : {kNormal, kLaplace, kStudent}) {
    for (const ErrorScale scale : {ErrorScale::linear, ErrorScale::ln, ErrorScale::log10}) {
      const ErrorLaw law = on_scale(base, scale);
      const double y = 2.0;
      std::array<double, 3> at{scale == ErrorScale::linear ? -2.7 : 2.7, 0.3, 0.05};
      if (scale != ErrorScale::linear) at[0] = 2.7;
      const auto value = [&](const std::array<double, 3>& p) {
        return *noise_residual(law, sigma, y, p[0], p[1], p[2]);
      };
      const NoiseResidual exact = value(at);
      const std::array residual{exact.residual.by_f, exact.residual.by_a, exact.residual.by_b};
      const std::array normalisation{exact.normalisation.by_f, exact.normalisation.by_a,
                                     exact.normalisation.by_b};
      for (std::size_t i = 0; i < 3; ++i) {
        auto up = at;
        auto down = at;
        up[i] += 1e-6;
        down[i] -= 1e-6;
        CHECK_THAT((value(up).residual.value - value(down).residual.value) / 2e-6,
                   WithinRel(residual[i], 1e-6));
        CHECK_THAT((value(up).normalisation.value - value(down).normalisation.value) / 2e-6,
                   WithinRel(normalisation[i], 1e-6));
      }
    }
  }
}

TEST_CASE("an estimated sigma works from 1e-9 to 1e9 of the data and refuses loudly beyond") {
  const EstimatedSigma free{{}, {}, 5.0};
  for (const double a : {5e-9, 5.0, 5e9}) {
    const auto n = noise_residual(kNormal, free, 5.0, 5.0, a, 0.0);
    REQUIRE(n);
    const double deviance = n->residual.value * n->residual.value +
                            n->normalisation.value * n->normalisation.value - kNormalisationOffset;
    CHECK_THAT(deviance - 2.0 * log_density(kNormal, 5.0, 5.0, 5.0),
               WithinAbs(-2.0 * log_density(kNormal, 5.0, 5.0, a), 1e-9));
  }
  CHECK_FALSE(noise_residual(kNormal, free, 5.0, 5.0, 5e-12, 0.0));
  CHECK_FALSE(noise_residual(kNormal, free, 5.0, 5.0, 0.0, 0.0));
  CHECK_FALSE(noise_residual(kNormal, free, 5.0, 5.0, -1.0, 0.0));
  CHECK_FALSE(noise_residual(kNormal, free, 5.0, 5.0, std::nan(""), 0.0));
  CHECK_FALSE(noise_residual(on_scale(kNormal, ErrorScale::ln), free, 5.0, -5.0, 1.0, 0.0));
  const EstimatedSigma fixed_a{0.0, {}, 5.0};
  CHECK_FALSE(noise_residual(kNormal, fixed_a, 5.0, 0.0, 7.0, 0.1));  // sigma = 0.1 * 0
  const auto only_b = noise_residual(kNormal, fixed_a, 5.0, 4.0, 7.0, 0.1);
  REQUIRE(only_b);
  CHECK(only_b->residual.by_a == 0.0);
  CHECK_THAT(only_b->residual.value, WithinRel(-1.0 / 0.4, 1e-14));
}

TEST_CASE("an estimated sigma of normal data is the root mean square, from far starts, too") {
  Random random(11);
  std::vector<double> y = normal_errors(60, random);
  double mean = 0.0;
  for (double& value : y) {
    value = 1000.0 + 20.0 * value;
    mean += value / 60.0;
  }
  double square = 0.0;
  for (const double value : y) square += (value - mean) * (value - mean) / 60.0;
  const EstimatedSigma sigma{{}, 0.0, 1000.0};
  const EstimatedNoise function(y, std::vector<double>(60, 1.0), sigma);
  const std::vector<FitParameter> parameters{parameter("mean", Scale::linear, 0.0, -1e5, 1e5),
                                             parameter("a", Scale::log, 1.0, 1e-6, 1e9),
                                             parameter("b", Scale::linear, 0.0, -1.0, 1.0)};
  const FixedMask fixed{false, false, true};
  int iterations = 0;
  for (const double start : {1e-3, 1.0, 1e3, 1e6}) {
    const Minimum m = minimise(function, parameters, std::vector<double>{900.0, start, 0.0}, fixed);
    CAPTURE(start, m.message, m.iterations);
    CHECK(m.converged);
    CHECK_THAT(m.natural[0], WithinRel(mean, 1e-7));
    CHECK_THAT(m.natural[1], WithinRel(std::sqrt(square), 1e-6));
    iterations = std::max(iterations, m.iterations);
  }
  CHECK(iterations < test::allowed_cost("fit.search_from_far_noise"));

  // sd of ln sigma is 1 / sqrt(2 n), of the mean sigma / sqrt(n).
  Minimum m = minimise(function, parameters, std::vector<double>{900.0, 1.0, 0.0}, fixed);
  RowMatrix root;
  REQUIRE(function.information_root(m.natural, root));
  const Eigen::Matrix2d information = (root.transpose() * root).topLeftCorner<2, 2>();
  const Eigen::Matrix2d covariance = information.inverse();
  CHECK_THAT(std::sqrt(covariance(0, 0)), WithinRel(m.natural[1] / std::sqrt(60.0), 1e-9));
  CHECK_THAT(std::sqrt(covariance(1, 1)) / m.natural[1], WithinRel(1.0 / std::sqrt(120.0), 1e-9));
}

TEST_CASE("an estimated Laplace scale is the mean absolute deviation from the median") {
  Random random(12);
  std::vector<double> y(101);
  for (double& value : y) value = 50.0 + 3.0 * draw_error(kLaplace, random);
  std::vector<double> sorted = y;
  std::sort(sorted.begin(), sorted.end());
  double deviation = 0.0;
  for (const double value : y) deviation += std::abs(value - sorted[50]) / 101.0;
  const EstimatedNoise function(y, std::vector<double>(101, 1.0), {{}, 0.0, 50.0}, kLaplace);
  const std::vector<FitParameter> parameters{parameter("median", Scale::linear, 0.0, -1e5, 1e5),
                                             parameter("a", Scale::log, 1.0, 1e-6, 1e9),
                                             parameter("b", Scale::linear, 0.0, -1.0, 1.0)};
  const Minimum m = minimise(function, parameters, std::vector<double>{45.0, 1.0, 0.0},
                             FixedMask{false, false, true});
  CAPTURE(m.iterations, m.message);
  CHECK(m.converged);
  CHECK_THAT(m.natural[0], WithinAbs(sorted[50], 0.01 * deviation));
  CHECK_THAT(m.natural[1], WithinRel(deviation, 1e-3));
}

TEST_CASE("both parts of sigma = a + b |f| are found") {
  Random random(5);
  std::vector<double> y;
  std::vector<double> gain;
  for (int i = 0; i < 2000; ++i) {
    gain.push_back(0.01 * i);
    const double f = 10.0 * gain.back();
    y.push_back(f + (0.5 + 0.1 * f) * random.normal());
  }
  const EstimatedNoise function(y, gain, {{}, {}, 100.0});
  const std::vector<FitParameter> parameters{parameter("scale", Scale::log, 5.0, 1e-2, 1e3),
                                             parameter("a", Scale::log, 5.0, 1e-4, 1e3),
                                             parameter("b", Scale::log, 1.0, 1e-4, 1e2)};
  Minimum m = minimise(function, parameters, std::vector<double>{5.0, 5.0, 1.0});
  CHECK(m.converged);
  const Covariance c = linear_covariance(function, parameters, m, Threshold{});
  REQUIRE(c.full_rank);
  const std::array true_values{10.0, 0.5, 0.1};
  for (std::size_t i = 0; i < 3; ++i) {
    const double sd = c.theta_sd[static_cast<Eigen::Index>(i)];
    CAPTURE(parameters[i].name, m.natural[i], sd);
    CHECK(std::abs(std::log(m.natural[i] / true_values[i])) < 3.0 * sd);
    CHECK(sd < 0.2);
  }
}

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

// --- derivatives ---------------------------------------------------------------------------------

namespace {

/// A decay whose Jacobian or values are falsified.
class Falsified final : public ResidualFunction {
 public:
  double jacobian_factor = 1.0;  ///< of the entry below
  Eigen::Index row = 3, column = 1;
  double noise = 0.0;  ///< amplitude of a rough function of the parameters, relative
  bool broken_away_from_nominal = false;

  Eigen::Index residual_count() const override { return 12; }
  bool evaluate(std::span<const double> p, Eigen::VectorXd& r, RowMatrix* j) const override {
    if (broken_away_from_nominal && std::abs(p[0] - 3.0) > 1.0) return false;
    r.resize(12);
    if (j != nullptr) j->resize(12, 2);
    for (Eigen::Index i = 0; i < 12; ++i) {
      double d[2];
      const double f = decay(0.5 * static_cast<double>(i), p, d);
      const double rough = std::sin(1e12 * (p[0] + 1.7 * p[1]) + static_cast<double>(i));
      r[i] = (f * (1.0 + noise * rough) - 1.0) / 0.1;
      if (j != nullptr) j->row(i) << d[0] / 0.1, d[1] / 0.1;
    }
    if (j != nullptr) (*j)(row, column) *= jacobian_factor;
    return true;
  }
};

std::vector<FitParameter> narrow_decay() {
  return {parameter("amplitude", Scale::log, 3.0, 0.5, 20.0),
          parameter("tau", Scale::log, 2.0, 0.5, 10.0)};
}

}  // namespace

TEST_CASE("a correct Jacobian passes the gradient check, with a noise floor, too") {
  for (const double noise : {0.0, 1e-12, 1e-9, 1e-7, 1e-6}) {
    Falsified function;
    function.noise = noise;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const GradientCheck check = check_gradient(function, narrow_decay(), {3, seed, 3e-4});
      INFO(to_terminal_text(check));
      CAPTURE(noise);
      CHECK(check.passed());
      CHECK(check.points.size() == 4);
      CHECK(check.points[0].natural == std::vector<double>{3.0, 2.0});
      CHECK(check.undecided == 0);
    }
  }
}

TEST_CASE("a Jacobian that is wrong by 0.1 % in one entry fails the gradient check") {
  for (const double noise : {0.0, 1e-12, 1e-9}) {
    for (const double factor : {1.001, 0.999, -1.0, 0.0, 1.1}) {
      for (Eigen::Index column : {0, 1}) {
        Falsified function;
        function.jacobian_factor = factor;
        function.column = column;
        function.noise = noise;
        const GradientCheck check = check_gradient(function, narrow_decay());
        INFO(to_terminal_text(check));
        CAPTURE(factor, noise);
        CHECK_FALSE(check.passed());
        const ParameterGradient& g = check.points[0].parameters[static_cast<std::size_t>(column)];
        CHECK(g.verdict == GradientVerdict::wrong);
        CHECK(g.residual == 3);
      }
    }
  }
}

TEST_CASE("the gradient check works at bounds, without influence, and says what it cannot do") {
  Falsified function;
  std::vector<FitParameter> at_bound = narrow_decay();
  at_bound[0].lower = at_bound[0].start;
  at_bound[1].upper = at_bound[1].start;
  CHECK(check_gradient(function, at_bound).passed());

  const CurveResiduals flat(straight_line, {{0, 0, 0}, {1, 2, 3}, 1.0, {}});
  const GradientCheck no_slope = check_gradient(flat, line_parameters());
  INFO(to_terminal_text(no_slope));
  CHECK(no_slope.passed());
  CHECK(no_slope.undecided == 0);

  function.noise = 0.3;
  const GradientCheck rough = check_gradient(function, narrow_decay());
  CHECK_FALSE(rough.passed());
  CHECK(rough.undecided > 4);

  const Json j = to_json(check_gradient(Falsified(), narrow_decay()));
  CHECK(j["passed"] == true);
  CHECK(j["points"].size() == 4);
  CHECK(j["points"][1]["parameters"][1]["verdict"] == "agrees");

  Falsified narrow;
  narrow.broken_away_from_nominal = true;
  CHECK_THROWS_WITH(check_gradient(narrow, narrow_decay()), Contains("random points"));
}

TEST_CASE("the derivatives of the liver relaxation fit pass the gradient check") {
  const FitConfig config =
      read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/liver_relaxation.json");
  const ExperimentResiduals function(config);
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  const GradientCheck check = check_gradient(function, parameters, {5, 1, 3e-4});
  INFO(to_terminal_text(check));
  CHECK(check.passed());
  CHECK(check.undecided == 0);
}

// --- specimens -----------------------------------------------------------------------------------

TEST_CASE("random effects of the BCG vaccine trials are metafor's") {
  // Cases and non-cases of tuberculosis, vaccinated and not, of the 13 trials of Colditz et al.
  // 1994 (dat.bcg of the R package metafor); log risk ratios. Printed in metafor's documentation
  // for rma(yi, vi, method = "REML"): mu = -0.7145, tau^2 = 0.3132, Q = 152.2330.
  const double trials[13][4] = {
      {4, 119, 11, 128},       {6, 300, 29, 274},        {3, 228, 11, 209},
      {62, 13536, 248, 12619}, {33, 5036, 47, 5761},     {180, 1361, 372, 1079},
      {8, 2537, 10, 619},      {505, 87886, 499, 87892}, {29, 7470, 45, 7232},
      {17, 1699, 65, 1600},    {186, 50448, 141, 27197}, {5, 2493, 3, 2338},
      {27, 16886, 29, 17825}};
  std::vector<SpecimenEstimate> specimens;
  for (const auto& t : trials) {
    const double treated = t[0] + t[1];
    const double control = t[2] + t[3];
    const double y = std::log(t[0] / treated / (t[2] / control));
    const double v = 1.0 / t[0] - 1.0 / treated + 1.0 / t[2] - 1.0 / control;
    specimens.push_back({"trial", y, std::sqrt(v)});
  }
  const RandomEffects r = random_effects(specimens);
  CHECK_THAT(r.mean, test::expected("bcg_trials.mean"));
  CHECK_THAT(*r.tau_squared, test::expected("bcg_trials.tau_squared"));
  CHECK_THAT(*r.q, test::expected("bcg_trials.q"));
  CHECK_THAT(*r.i_squared, WithinRel((*r.q - 12.0) / *r.q, 1e-12));
  CHECK(*r.q_p_value < 1e-20);

  // Hartung and Knapp's variance by its definition, from the estimates above.
  double weights = 0.0;
  double squares = 0.0;
  for (const SpecimenEstimate& s : specimens) {
    const double w = 1.0 / (s.standard_error * s.standard_error + *r.tau_squared);
    weights += w;
    squares += w * (s.estimate - r.mean) * (s.estimate - r.mean);
  }
  const double se = std::sqrt(std::max(1.0, squares / 12.0) / weights);
  const double t = boost::math::quantile(boost::math::students_t(12), 0.975);
  CHECK_THAT(r.standard_error, WithinRel(se, 1e-12));
  CHECK_THAT(r.interval.upper, WithinRel(r.mean + t * se, 1e-12));
  CHECK_THAT(r.new_specimen->lower,
             WithinRel(r.mean - t * std::sqrt(*r.tau_squared + se * se), 1e-12));
}

TEST_CASE("equal standard errors have REML in closed form, and its boundary") {
  // tau^2 = max(0, sample variance - s^2)
  const std::vector<double> y{1.0, 1.5, 3.0, 2.2};
  std::vector<SpecimenEstimate> specimens;
  specimens.reserve(y.size());
  for (const double value : y) specimens.push_back({"", value, 0.4});
  const double mean = 7.7 / 4.0;
  double variance = 0.0;
  for (const double value : y) variance += (value - mean) * (value - mean) / 3.0;
  const RandomEffects r = random_effects(specimens);
  CHECK_THAT(r.mean, WithinRel(mean, 1e-12));
  CHECK_THAT(*r.tau_squared, WithinRel(variance - 0.16, 1e-6));
  // The classic t interval of the mean.
  CHECK_THAT(r.standard_error, WithinRel(std::sqrt(variance / 4.0), 1e-6));
  CHECK_FALSE(r.tau_at_zero);

  for (SpecimenEstimate& s : specimens) s.standard_error = 2.0;
  const RandomEffects homogeneous = random_effects(specimens);
  CHECK(*homogeneous.tau_squared == 0.0);
  CHECK(homogeneous.tau_at_zero);
  CHECK(*homogeneous.i_squared == 0.0);
  CHECK_THAT(homogeneous.standard_error, WithinRel(1.0, 1e-12));  // 2 / sqrt(4), not less
  CHECK_THAT(homogeneous.summary, Contains("no spread"));
}

TEST_CASE("one and two specimens are answered, none and bad ones refused") {
  const std::vector<SpecimenEstimate> one{{"A", 2.0, 0.5}};
  const RandomEffects single = random_effects(one);
  CHECK(single.mean == 2.0);
  CHECK_THAT(single.interval.upper, WithinRel(2.0 + 0.5 * 1.959963984540054, 1e-12));
  CHECK_FALSE(single.tau_squared);
  CHECK_FALSE(single.new_specimen);
  const std::vector<SpecimenEstimate> two{{"A", 2.0, 0.5}, {"B", 4.0, 0.5}};
  const RandomEffects pair = random_effects(two);
  CHECK_THAT(*pair.tau_squared, WithinRel(2.0 - 0.25, 1e-6));
  CHECK_THAT(pair.interval.upper, WithinRel(3.0 + 12.706204736 * 1.0, 1e-6));
  CHECK_FALSE(pair.new_specimen);
  const std::vector<SpecimenEstimate> same{{"A", 2.0, 0.5}, {"B", 2.0, 0.5}};
  CHECK(*random_effects(same).tau_squared == 0.0);
  CHECK(random_effects(same).interval.upper > 2.5);
  CHECK_THROWS_WITH(random_effects({}), Contains("at least one"));
  const std::vector<SpecimenEstimate> bad{{"A", 2.0, 0.5}, {"B", 4.0, 0.0}};
  CHECK_THROWS_WITH(random_effects(bad), Contains("specimen 'B'"));
  CHECK_THROWS_WITH(random_effects(two, 1.0), Contains("between 0 and 1"));
}

// --- starts and words ----------------------------------------------------------------------------

TEST_CASE("the waterfall sorts, clusters and counts the ends of the starts") {
  const double nan = std::nan("");
  const std::vector<double> ends{12.0, 10.0, nan, 10.000001, 10.05, 12.0, 300.0};
  const Waterfall w = waterfall(ends);
  CHECK(w.deviances == std::vector<double>{10.0, 10.000001, 10.05, 12.0, 12.0, 300.0});
  CHECK(w.clusters == std::vector<int>{0, 0, 1, 2, 2, 3});
  CHECK(w.summary == "3 of 7 starts within 0.1 of the best; 4 distinct minima, 1 failed");
  CHECK(waterfall(std::vector<double>{nan}).summary == "none of 1 starts ended in a usable point");
  CHECK(waterfall({}).near_best == 0);
}

TEST_CASE("simple trade-offs are named by what remains known") {
  const FitParameter e = log_parameter("E1");
  const FitParameter eta = log_parameter("eta1", kPascalSecond);
  const FitParameter linear1 = parameter("F1", Scale::linear, 0, -1, 1, kPascal);
  const FitParameter linear2 = parameter("F2", Scale::linear, 0, -1, 1, kPascal);
  const FitParameter other = parameter("x0", Scale::linear, 0, -1, 1, kPascalSecond);
  using Names = std::vector<FitParameter>;
  const auto known = [](const Names& names, const std::vector<double>& steps) {
    return known_combination(names, steps);
  };
  CHECK(known({e, eta}, {0.7, 0.7}) == "their ratio E1 / eta1");
  CHECK(known({e, eta}, {-0.72, 0.69}) == "their product E1 eta1");
  CHECK(known({e, eta}, {0.894, -0.447}) == "the product E1 eta1^2");
  CHECK(known({e, eta}, {0.447, 0.894}) == "the ratio E1^2 / eta1");
  CHECK(known({e, eta}, {0.97, 0.22}).empty());
  CHECK(known({linear1, linear2}, {0.7, -0.7}) == "their sum F1 + F2");
  CHECK(known({linear1, linear2}, {0.7, 0.7}) == "their difference F1 - F2");
  CHECK(known({linear1, other}, {0.7, -0.7}).empty());
  CHECK(known({e, linear1}, {0.7, -0.7}).empty());
  CHECK(known({e, log_parameter("E2"), eta}, {0.57, 0.58, 0.58}) ==
        "the ratios of E1, E2 and eta1");
  CHECK(known({e, log_parameter("E2"), eta}, {0.57, -0.58, 0.58}).empty());
  CHECK(known({e}, {1.0}).empty());

  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, 1.0}, 0.0, false)) ==
        "rank-deficient: E1 and eta1 trade off: only their ratio E1 / eta1 can be known (singular "
        "values 1.4:0 of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, -1.0}, 0.01, true)) ==
        "E1 and eta1 trade off: their product E1 eta1 is known much better than they are (singular "
        "values 1.4:0.01 of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {1.0, -1.0}, 0.4, true)) ==
        "least determined by the data: E1 up and eta1 down together; they trade off (singular "
        "values 1.4:0.4 "
        "of the scaled Jacobian)");
  CHECK(weakest_direction_words(result_with({e, eta}, {0.1, 1.0}, 0.4, true)) ==
        "least determined by the data: eta1 up (singular values 1.4:0.4 of the scaled Jacobian)");
  FitResult unevaluated = result_with({e, eta}, {0.1, 1.0}, 0.4, true);
  unevaluated.covariance.weakest_direction.resize(0);
  CHECK(weakest_direction_words(unevaluated).empty());
}
