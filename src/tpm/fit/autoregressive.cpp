#include "tpm/fit/autoregressive.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kMostPhi = 0.999;

/// The restricted likelihood of one phi.
struct Whitened {
  double criterion = std::numeric_limits<double>::infinity();
  double squares = 0.0;
  Eigen::VectorXd log_variance;  ///< of each estimate
};

class RestrictedLikelihood {
 public:
  RestrictedLikelihood(std::span<const double> time_s, const Eigen::VectorXd& residual,
                       const Eigen::MatrixXd& jacobian, double step_s)
      : time_s_(time_s), both_(residual.size(), jacobian.cols() + 1), step_s_(step_s) {
    // Columns of one size, so that the determinant does not mix units.
    length_ = jacobian.colwise().norm().transpose();
    both_.leftCols(jacobian.cols()) = jacobian * length_.cwiseInverse().asDiagonal();
    both_.col(jacobian.cols()) = residual;
  }

  [[nodiscard]] Whitened at(double phi) const {
    const AutoregressiveNoise noise(phi, step_s_);
    Eigen::MatrixXd rows = both_;
    noise.whiten(time_s_, rows);
    const Eigen::Index p = rows.cols() - 1;
    const Eigen::MatrixXd gram = rows.transpose() * rows;
    const Eigen::LLT<Eigen::MatrixXd> normal(gram.topLeftCorner(p, p));
    Whitened w;
    w.log_variance = Eigen::VectorXd::Zero(p);
    if (normal.info() != Eigen::Success) return w;
    const Eigen::VectorXd right = gram.topRightCorner(p, 1);
    w.squares = gram(p, p) - right.dot(normal.solve(right));
    if (!(w.squares > 0.0)) return w;
    const double freedom = static_cast<double>(rows.rows() - p);
    double log_gram = 0.0;
    for (Eigen::Index i = 0; i < p; ++i) log_gram += 2.0 * std::log(normal.matrixL()(i, i));
    w.criterion = freedom * std::log(w.squares) + noise.log_determinant(time_s_) + log_gram;
    const Eigen::MatrixXd inverse = normal.solve(Eigen::MatrixXd::Identity(p, p));
    w.log_variance = (inverse.diagonal().array() * (w.squares / freedom)).log();
    return w;
  }

 private:
  std::span<const double> time_s_;
  Eigen::MatrixXd both_;
  Eigen::VectorXd length_;
  double step_s_;
};

}  // namespace

double AutoregressiveNoise::correlation(double dt_s) const {
  if (phi_ == 0.0) return 0.0;
  // Times of even sampling differ from a multiple of the step by their rounding.
  constexpr double kRounding = 1e-9;
  const double steps = dt_s / step_s_;
  return std::abs(steps - 1.0) < kRounding ? phi_ : std::pow(phi_, steps);
}

double AutoregressiveNoise::log_determinant(std::span<const double> time_s) const {
  if (phi_ == 0.0) return 0.0;
  double sum = 0.0, of_step = 0.0, last_rho = 0.0;
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    const double rho = correlation(time_s[i] - time_s[i - 1]);
    if (rho != last_rho) of_step = std::log1p(-rho * rho);
    last_rho = rho;
    sum += of_step;
  }
  return sum;
}

AutoregressionEstimate estimate_autoregression(std::span<const double> time_s,
                                               const Eigen::VectorXd& residual,
                                               const Eigen::MatrixXd& jacobian, double step_s) {
  if (residual.size() <= jacobian.cols() || jacobian.rows() != residual.size()) {
    throw bad_input("autoregression", "too few residuals", "more than parameters");
  }
  const RestrictedLikelihood likelihood(time_s, residual, jacobian, step_s);
  // In z = -ln(1 - phi) the criterion is about equally curved everywhere.
  const double end = -std::log(1.0 - kMostPhi);
  constexpr int kBits = 20;
  const auto [z, criterion] = boost::math::tools::brent_find_minima(
      [&](double each) { return likelihood.at(-std::expm1(-each)).criterion; }, 0.0, end, kBits);
  AutoregressionEstimate estimate;
  estimate.phi = -std::expm1(-z);
  const Whitened at_zero = likelihood.at(0.0);
  if (at_zero.criterion <= criterion) estimate.phi = 0.0;
  const Whitened best = likelihood.at(estimate.phi);
  if (!std::isfinite(best.criterion)) {
    throw Error(ExitCode::numerical, "autoregression", "the residuals have no likelihood",
                "parameters that the data tell apart");
  }
  const auto p = jacobian.cols();
  estimate.criterion = best.criterion;
  estimate.gain = std::max(at_zero.criterion - best.criterion, 0.0);
  estimate.variance = best.squares / static_cast<double>(residual.size() - p);
  // One-sided at phi = 0.
  const double step = 0.02 * (1.0 - estimate.phi) + 1e-6;
  const double below = std::max(estimate.phi - step, 0.0), above = estimate.phi + step;
  const Whitened low = likelihood.at(below), high = likelihood.at(above);
  estimate.log_variance_slope = (high.log_variance - low.log_variance) / (above - below);
  estimate.log_squares_slope = std::log(high.squares / low.squares) / (above - below);
  const double middle = 0.5 * (below + above);
  const Whitened centre = likelihood.at(middle);
  const double half = 0.5 * (above - below);
  const double curvature =
      (high.criterion - 2.0 * centre.criterion + low.criterion) / (half * half);
  if (curvature > 0.0) estimate.phi_variance = 2.0 / curvature;
  return estimate;
}

std::vector<PossibleAutoregression> possible_autoregressions(std::span<const double> time_s,
                                                             const Eigen::VectorXd& residual,
                                                             const Eigen::MatrixXd& jacobian,
                                                             double step_s,
                                                             const AutoregressionEstimate& found) {
  constexpr double kNegligible = 16.0;  // above the least criterion
  constexpr double kStep = 0.5, kLeastStep = 0.01, kMostStep = 0.25;
  const RestrictedLikelihood likelihood(time_s, residual, jacobian, step_s);
  const auto freedom = static_cast<double>(residual.size() - jacobian.cols());
  const double end = -std::log(1.0 - kMostPhi);
  const double best = -std::log1p(-found.phi);  // in z = -ln(1 - phi), as it was found
  const double spread = std::sqrt(found.phi_variance) / (1.0 - found.phi);
  const double step = spread > 0.0 ? std::clamp(kStep * spread, kLeastStep, kMostStep) : kMostStep;
  std::vector<PossibleAutoregression> points;
  double sum = 0.0;
  // False where nothing beyond counts.
  const auto add = [&](double z) {
    const double phi = -std::expm1(-z);
    const Whitened w = likelihood.at(phi);
    const double above = w.criterion - found.criterion;
    if (!(above < kNegligible)) return false;
    // d phi = exp(-z) dz
    points.push_back({phi, std::exp(-0.5 * above - z), w.squares / freedom});
    sum += points.back().weight;
    return true;
  };
  for (double z = best; z <= end && add(z); z += step) {
  }
  for (double z = best - step; z >= 0.0 && add(z); z -= step) {
  }
  for (PossibleAutoregression& p : points) p.weight /= sum;
  return points;
}

double satterthwaite_degrees(const AutoregressionEstimate& estimate, Eigen::Index column,
                             Eigen::Index n, Eigen::Index p) {
  if (column < 0 || column >= estimate.log_variance_slope.size()) {
    throw std::logic_error("degrees of freedom of a parameter that the estimate does not have");
  }
  const double slope = estimate.log_variance_slope[column];
  const double variance = slope * slope * estimate.phi_variance + 2.0 / static_cast<double>(n - p);
  return std::max(2.0 / variance, 1.0);
}

}  // namespace tpm::fit
