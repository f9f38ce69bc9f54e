// Laws of errors of readings and standard deviations that are estimated, against Boost, PEtab and
// closed forms.
#include <boost/math/distributions/laplace.hpp>
#include <boost/math/distributions/lognormal.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "expected_values.hpp"
#include "statistics_problems.hpp"
#include "tpm/fit/likelihood/estimated_sigma.hpp"
#include "tpm/fit/likelihood/noise.hpp"

using namespace tpm;
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

TEST_CASE("Student's t without a variance is refused") {
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
