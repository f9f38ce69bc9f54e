// What readings at rest tell of zero and drift, whatever their correlation.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/base/random.hpp"
#include "tpm/fit/autoregressive.hpp"
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
