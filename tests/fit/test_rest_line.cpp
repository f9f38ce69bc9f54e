// What readings at rest tell of zero and drift, whatever their correlation.
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/base/random.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/measured_at_rest.hpp"
#include "tpm/fit/recording/rest_line.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Two rests of 40 readings, 20 s apart, 10 readings a second.
std::vector<double> rest_times_s() {
  std::vector<double> time_s;
  for (const double begin_s : {0.0, 24.0}) {
    for (int i = 0; i < 40; ++i) time_s.push_back(begin_s + 0.1 * i);
  }
  return time_s;
}

/// Noise of variance 1, an autoregression over 0.1 s.
std::vector<double> correlated_noise(const std::vector<double>& time_s, double phi,
                                     Random& random) {
  std::vector<double> noise;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    const double rho = i > 0 ? std::pow(phi, (time_s[i] - time_s[i - 1]) / 0.1) : 0.0;
    noise.push_back((i > 0 ? rho * noise.back() : 0.0) +
                    std::sqrt(1.0 - rho * rho) * random.normal());
  }
  return noise;
}

}  // namespace

TEST_CASE("the phi that readings leave possible spread as the curvature of the likelihood says",
          "[placement]") {
  std::vector<double> time_s;
  for (int i = 0; i < 4000; ++i) time_s.push_back(0.1 * i);
  Random random(3);
  const std::vector<double> noise = correlated_noise(time_s, 0.6, random);
  const Eigen::VectorXd residual = Eigen::VectorXd::Map(noise.data(), std::ssize(noise));
  const Eigen::MatrixXd level = Eigen::VectorXd::Ones(residual.size());
  const auto found = estimate_autoregression(time_s, residual, level, 0.1);
  double sum = 0.0, mean = 0.0, square = 0.0;
  for (const auto& one : possible_autoregressions(time_s, residual, level, 0.1, found)) {
    sum += one.weight;
    mean += one.weight * one.phi;
    square += one.weight * one.phi * one.phi;
  }
  CHECK_THAT(sum, WithinRel(1.0, 1e-12));
  CHECK_THAT(mean, WithinAbs(found.phi, 0.1 * std::sqrt(found.phi_variance)));
  CHECK_THAT(square - mean * mean, WithinRel(found.phi_variance, 0.05));
}

TEST_CASE("zero and drift of correlated rests are held in 93 to 97 %", "[placement]") {
  // 926 to 971 of 1,000.
  constexpr int kSets = 1000, kFewest = 926, kMost = 971;
  const std::vector<double> time_s = rest_times_s();
  for (const double phi : {0.5, 0.9}) {
    Random random(11);
    int zero = 0, drift = 0;
    for (int set = 0; set < kSets; ++set) {
      const std::vector<double> reading = correlated_noise(time_s, phi, random);
      const RestLine line = fit_rest_line(time_s, reading, true, 0.0, nullptr);
      zero += std::abs(line.zero.value) <= 1.96 * line.zero.sd;
      drift += std::abs(line.slope.value().value) <= 1.96 * line.slope->sd;
    }
    CAPTURE(phi, zero, drift);
    CHECK(zero >= kFewest);
    CHECK(zero <= kMost);
    CHECK(drift >= kFewest);
    CHECK(drift <= kMost);
  }
}

TEST_CASE("the noise of a rest goes on behind it as generalised least squares say", "[placement]") {
  constexpr double kPhi = 0.9, kStep_s = 0.1, kLast_s = 3.9, kVariance = 2.0;
  const std::vector<double> time_s = rest_times_s();
  const auto n = std::ssize(time_s);
  const auto correlation = [](double a, double b) {
    return std::pow(kPhi, std::abs(a - b) / kStep_s);
  };
  Eigen::MatrixXd r(n, n), line(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = time_s[static_cast<std::size_t>(i)];
    line.row(i) << 1.0, t;
    for (Eigen::Index k = 0; k < n; ++k)
      r(i, k) = correlation(t, time_s[static_cast<std::size_t>(k)]);
  }
  const Eigen::MatrixXd weights = r.inverse() * line;
  Eigen::Matrix2d d = (line.transpose() * weights).inverse();
  const double origin_s = -d(0, 1) / d(1, 1);
  line.col(1).array() -= origin_s;
  d = (line.transpose() * r.inverse() * line).inverse();
  const Eigen::MatrixXd estimate = d * line.transpose() * r.inverse();
  MeasuredAtRest rest;
  rest.last_s = kLast_s;
  rest.origin_s = origin_s;
  rest.sigma = 4.0;
  rest.zero_sd = std::sqrt(kVariance * d(0, 0));
  rest.drift_sd = std::sqrt(kVariance * d(1, 1));
  const double variance = kVariance / (rest.sigma * rest.sigma);  // of declared ones
  const Eigen::Vector2d with_last = rest.covariance_with_last(variance);
  for (const double t : {4.0, 4.5, 6.0}) {
    Eigen::VectorXd with(n);
    for (Eigen::Index i = 0; i < n; ++i)
      with[i] = correlation(t, time_s[static_cast<std::size_t>(i)]);
    const Eigen::Vector2d exact = kVariance * (estimate * with) / rest.sigma;
    CAPTURE(t);
    CHECK_THAT(correlation(t, kLast_s) * with_last[0], WithinRel(exact[0], 1e-5));
    CHECK_THAT(correlation(t, kLast_s) * with_last[1], WithinRel(exact[1], 1e-5));
  }
  // Stated wider than this, they do not say more of the last reading than itself.
  rest.zero_sd *= 5.0;
  rest.drift_sd *= 5.0;
  const Eigen::Vector2d wide = rest.covariance_with_last(variance);
  const double predicted = rest.sigma * (wide[0] + (kLast_s - origin_s) * wide[1]);
  CHECK_THAT(predicted, WithinRel(kVariance, 1e-12));
  CHECK_THAT(wide[1] / wide[0], WithinRel(with_last[1] / with_last[0], 1e-12));
}
