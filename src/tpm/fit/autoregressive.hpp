#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

namespace tpm::fit {

/// Noise whose neighbours are correlated: stationary, normal, with the correlation
///
///     rho(dt) = phi^(dt / step),   0 <= phi < 1,
///
/// between samples dt apart: an autoregression of first order (AR(1)), also for uneven sampling.
/// Whitening keeps the marginal variance: with rho_i of the distance to the sample before,
///
///     e_0 = r_0,   e_i = (r_i - rho_i r_(i-1)) / sqrt(1 - rho_i^2).
class AutoregressiveNoise {
 public:
  /// @param step_s > 0: the distance of samples that phi belongs to
  AutoregressiveNoise(double phi, double step_s) : phi_(phi), step_s_(step_s) {}

  [[nodiscard]] double phi() const { return phi_; }
  [[nodiscard]] double step_s() const { return step_s_; }
  /// Correlation of two samples dt_s > 0 apart.
  [[nodiscard]] double correlation(double dt_s) const;
  /// Whitens the rows of a matrix (or a vector) in the order of time, in place.
  template <class Matrix>
  void whiten(std::span<const double> time_s, Matrix& rows) const {
    if (phi_ == 0.0) return;
    for (Eigen::Index i = rows.rows() - 1; i > 0; --i) {
      const auto k = static_cast<std::size_t>(i);
      const double rho = correlation(time_s[k] - time_s[k - 1]);
      rows.row(i) = (rows.row(i) - rho * rows.row(i - 1)) / std::sqrt((1.0 - rho) * (1.0 + rho));
    }
  }
  /// ln of the determinant of the correlation matrix: sum ln(1 - rho_i^2).
  [[nodiscard]] double log_determinant(std::span<const double> time_s) const;

 private:
  double phi_, step_s_;
};

/// Estimates of phi and of the size of the noise from the residuals of a fit.
struct AutoregressionEstimate {
  double phi = 0.0;
  double phi_variance = 0.0;  ///< from the curvature of the criterion; 0 where phi is on a bound
  double variance = 0.0;      ///< marginal, of one reading: whitened sum of squares / (n - p)
  double criterion = 0.0;     ///< restricted deviance at phi
  double gain = 0.0;          ///< how far it lies below the one at phi = 0
  double log_squares_slope = 0.0;  ///< d ln(variance) / d phi
  /// Of each column: d ln(variance of its estimate) / d phi.
  Eigen::VectorXd log_variance_slope;
};

/// Restricted maximum likelihood (REML; Patterson & Thompson, Biometrika 58 (1971) 545) of phi for
/// r = J x + noise, x free: the maximum of the plain likelihood puts phi too low, because J follows
/// some of the noise. Minimises over 0 <= phi <= 0.999
///
///     (n - p) ln RSS(phi) + ln|R(phi)| + ln|J' R(phi)^-1 J|.
///
/// @param residual n values in the order of time; @param jacobian n x p, of full rank, p < n
[[nodiscard]] AutoregressionEstimate estimate_autoregression(std::span<const double> time_s,
                                                             const Eigen::VectorXd& residual,
                                                             const Eigen::MatrixXd& jacobian,
                                                             double step_s);

/// One phi among those that residuals leave possible.
struct PossibleAutoregression {
  double phi = 0.0;
  double weight = 0.0;    ///< of this phi; those of all sum to 1
  double variance = 0.0;  ///< marginal, of one reading, at this phi
};

/// The phi that residuals leave possible: points across the restricted likelihood, weighted by it,
/// all phi from 0 to 0.999 being equally likely before. An interval at the most likely phi alone is
/// too narrow where few readings tell phi: the variance of an estimate grows with
/// (1 + phi)/(1 - phi), and where phi came out small by chance the expansion about it
/// (satterthwaite_degrees) also states too small an uncertainty of this variance.
/// @param found by estimate_autoregression() from the same residuals
[[nodiscard]] std::vector<PossibleAutoregression> possible_autoregressions(
    std::span<const double> time_s, const Eigen::VectorXd& residual,
    const Eigen::MatrixXd& jacobian, double step_s, const AutoregressionEstimate& found);

/// Degrees of freedom of Student's t for an estimate whose variance rests on an estimated phi and
/// an estimated size of the noise (Satterthwaite, as Kenward & Roger, Biometrics 53 (1997) 983):
/// 2 / Var(ln v), Var(ln v) = slope^2 Var(phi) + 2/(n - p). Throws std::logic_error for a column
/// that the estimate does not have.
[[nodiscard]] double satterthwaite_degrees(const AutoregressionEstimate& estimate,
                                           Eigen::Index column, Eigen::Index n, Eigen::Index p);

}  // namespace tpm::fit
