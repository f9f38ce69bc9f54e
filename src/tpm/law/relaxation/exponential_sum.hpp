#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

namespace tpm::law {

/// A fractional relaxation function as a sum over the rates r_j of a ExponentialSum,
///
///     G(t) ~ constant + sum_j weight_j exp(-r_j t) + dashpot_s delta(t)
///
/// with its derivatives by the order alpha (of two spring-pots: alpha and beta) and by ln tau.
/// Weights may be negative by up to about a
/// fifth of the total: no sum of positive weights on fixed rates can follow E_alpha as alpha -> 1.
struct FractionalWeights {
  Eigen::VectorXd weight;  ///< one for each rate, dimensionless
  Eigen::VectorXd d_weight_d_alpha;
  Eigen::VectorXd d_weight_d_beta;
  Eigen::VectorXd d_weight_d_log_tau;
  double constant = 0.0;  ///< part that relaxes too slowly to be seen in the window
  double d_constant_d_alpha = 0.0;
  double d_constant_d_beta = 0.0;
  double d_constant_d_log_tau = 0.0;
  double dashpot_s = 0.0;  ///< part that relaxes within a step: acts on du/dt
  double d_dashpot_d_alpha_s = 0.0;
  double d_dashpot_d_beta_s = 0.0;
  double d_dashpot_d_log_tau_s = 0.0;
};

/// Exponential sums for fractional elements over a window of times: rates r_j on a logarithmic grid
/// that depends on the window and the tolerance only. While alpha and tau are being fitted the
/// states y_j of a given history u,
///
///     dy_j/dt = du/dt - r_j y_j,   F = constant u + sum_j weight_j y_j + dashpot_s du/dt,
///
/// stay what they are; the weights change, and the derivatives of F are the same sum with the
/// derivatives of the weights. One step over h in which u is linear is
/// y_new = exp(-z) y + (1 - exp(-z))/z (u_new - u_old), z = r_j h.
///
/// Accuracy: for every t in [t_min, t_max] and every 0 < alpha <= 1, any tau,
///
///     |sum - G|(t) <= e g,   |integral over [0, t] of (sum - G)| <= e g t
///
/// with e = stated_error(), g = 1 for E_alpha, g = G(t_min) for the spring-pot and the mean of G
/// over [0, t_min] for two spring-pots. So a history whose knots are at least t_min apart is
/// answered at its knots to e g times its total variation. Not for t < t_min: just after a jump G
/// is 1 (E_alpha) or infinite (spring-pot), and the sum is less. If u is curved between the knots,
/// dashpot_s du/dt is off by dashpot_s u''/r_max.
///
/// Method: the trapezoidal rule on the spectrum in ln(rate); where the poles of the spectrum come
/// near (alpha -> 1) their residue, an exponential of a complex rate, is interpolated on the same
/// grid by cardinal functions sin/sinh, which turns it into a change of the weights. Nothing
/// switches at any alpha, and alpha = 1 is exp(-t/tau) like the rest. Rates below the grid go into
/// `constant` and the first weight with total and mean rate kept, rates above it into `dashpot_s`.
/// docs/theory.md has the derivation and measured errors.
class ExponentialSum {
 public:
  /// @param t_min_s smallest time between knots, > 0
  /// @param t_max_s longest time from the first knot to an answer, >= t_min_s
  /// @param tolerance 1e-12 to 1e-3
  /// Throws Error(bad_input).
  ExponentialSum(double t_min_s, double t_max_s, double tolerance = 1e-9);

  /// log_step() of a tolerance: the rates of all windows lie on one lattice, exp(k log_step).
  [[nodiscard]] static double log_step_for(double tolerance);
  /// Rising; neighbours differ by the factor exp(log_step()).
  [[nodiscard]] std::span<const double> rates_per_s() const { return rates_; }
  [[nodiscard]] double log_step() const { return step_; }
  /// The bound in the description of the class, <= tolerance.
  [[nodiscard]] double stated_error() const { return stated_error_; }

  /// G(t) = E_alpha(-(t/tau)^alpha). At alpha = 1 the derivative by alpha is the one-sided limit.
  /// Allocates only if `out` has another size. Throws Error(bad_input) unless 0 < alpha <= 1 and
  /// tau_s > 0 and finite.
  void mittag_leffler(double alpha, double tau_s, FractionalWeights& out) const;

  /// G(t) = (t / 1 s)^(-alpha) / Gamma(1 - alpha), a dashpot of 1 s at alpha = 1, a constant at
  /// alpha = 0. The derivatives by ln tau are 0. Throws Error(bad_input) unless 0 <= alpha <= 1.
  void springpot(double alpha, FractionalWeights& out) const;

  /// Two spring-pots in series, G(t) = (t/tau)^-beta E_{d,1-beta}(-(t/tau)^d), d = alpha - beta,
  /// which is the same with alpha and beta exchanged (springpot_pair.hpp). At beta = 0 it is
  /// mittag_leffler up to the stated error; at alpha = 1 a dashpot in series with a spring-pot.
  /// Throws Error(bad_input) unless alpha and beta are from 0 to 1 and tau_s > 0 and finite.
  void springpots_in_series(double alpha, double beta, double tau_s, FractionalWeights& out) const;

 private:
  void prepare(FractionalWeights& out) const;

  double t_min_s_;
  double t_max_s_;
  double step_;  ///< h, spacing in ln(rate)
  long first_;   ///< the rates are exp(k h) per second, k = first_ ...
  double stated_error_;
  std::vector<double> rates_;
  std::vector<double> damping_;  ///< exp(-j h), j = 1 ... until it no longer counts
};

}  // namespace tpm::law
