#include "tpm/fit/recording/pull_after_withdrawal.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numeric>

#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {
namespace {

double mean_of_all(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

bool is_pulled_after(const ReadingsAtRest& before, const ReadingsAtRest& after) {
  constexpr std::size_t kFewestBefore = 20, kFewestAfter = 8;
  constexpr double kSure = 5.0;  // standard deviations of the difference
  constexpr double kSeen = 2.0;  // of one reading
  if (before.reading.size() < kFewestBefore || after.reading.size() < kFewestAfter) return false;
  const auto n = static_cast<Eigen::Index>(before.reading.size());
  const double middle = mean_of_all(before.time_s), level = mean_of_all(before.reading);
  const double length = before.time_s.back() - before.time_s.front();
  Eigen::MatrixXd line(n, 2);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    line.row(i) << 1.0, (before.time_s[k] - middle) / length;
    y[i] = before.reading[k] - level;
  }
  if (!(y.cwiseAbs().maxCoeff() > 0.0)) return false;  // without noise nothing is uncertain
  const double step_s = median_step(before.time_s);
  const AutoregressionEstimate noise = estimate_autoregression(before.time_s, y, line, step_s);
  Eigen::MatrixXd whitened(n, 3);
  whitened << line, y;
  AutoregressiveNoise(noise.phi, step_s).whiten(before.time_s, whitened);
  const Eigen::MatrixXd j = whitened.leftCols(2);
  const Eigen::Matrix2d inverse = (j.transpose() * j).inverse();
  const Eigen::Vector2d at = inverse * (j.transpose() * whitened.col(2));
  const Eigen::Vector2d later(1.0, (mean_of_all(after.time_s) - middle) / length);
  const double correlated = (1.0 + noise.phi) / (1.0 - noise.phi);
  const double variance = noise.variance * (later.dot(inverse * later) +
                                            correlated / static_cast<double>(after.reading.size()));
  const double below = level + later.dot(at) - mean_of_all(after.reading);
  return below > kSure * std::sqrt(variance) && below > kSeen * std::sqrt(noise.variance);
}

}  // namespace tpm::fit
