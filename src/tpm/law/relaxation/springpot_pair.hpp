#pragma once

namespace tpm::law {

/// A number that depends on two orders and on a place x on an axis of logarithmic rates.
struct PairValue {
  double value = 0.0;
  double d_alpha = 0.0;
  double d_beta = 0.0;
  double d_x = 0.0;

  PairValue& operator+=(const PairValue& other) {
    value += other.value;
    d_alpha += other.d_alpha;
    d_beta += other.d_beta;
    d_x += other.d_x;
    return *this;
  }
  [[nodiscard]] PairValue times(double factor) const {
    return {factor * value, factor * d_alpha, factor * d_beta, factor * d_x};
  }
};

/// Two spring-pots in series, with the operational stiffness 1/((s tau)^-alpha + (s tau)^-beta):
///
///     G(t) = (t/tau)^-beta E_{d,1-beta}(-(t/tau)^d),   d = alpha - beta
///          = integral w(x) exp(-e^x t/tau) dx
///     w(x) = (e^(beta x) sin(pi alpha) + e^(alpha x) sin(pi beta)) / (2 pi (cosh(d x) + cos(pi
///     d)))
///
/// from the jump of the transform across the negative real axis. It is the same for alpha and beta
/// exchanged, and for beta = 0 the spectrum of E_alpha (relaxation_spectrum.hpp).
///
/// @param t_over_tau > 0
/// The derivatives d_x are those by ln tau.
[[nodiscard]] PairValue pair_relaxation(double alpha, double beta, double t_over_tau);
/// The mean of G from 0 to t.
[[nodiscard]] PairValue pair_relaxation_mean(double alpha, double beta, double t_over_tau);

/// The weight of the rate exp(x)/tau, x = (m + phase) h, in a sum that replaces the spectral
/// integral. With y = i pi (1 - d)/d - x
///
///     W(x) = (h/2 pi) Re{ exp(i pi (alpha + beta)/(2 d)) [exp(-alpha y) + exp(-beta y) - 2 exp(i
///     pi
///            y/h)] / sinh(d y) }
///
/// The first two terms are the trapezoidal rule h w(x); the third is the residue that the rule
/// misses at the pole y = 0, spread over the grid as in CardinalWeight, of which this is the
/// generalisation. The bracket vanishes at y = 0, so W is smooth up to alpha = 1, beta = 0.
class PairWeight {
 public:
  /// @param alpha 0 to 1, not checked
  /// @param beta  0 to 1, not checked
  /// @param phase -1/2 to 1/2, place of the grid relative to ln(1/tau)
  PairWeight(double alpha, double beta, double phase, double h);

  [[nodiscard]] double place(long m) const { return h_ * (static_cast<double>(m) + phase_); }
  /// W at the node m, and its derivatives; that by x is also that by ln tau.
  [[nodiscard]] PairValue at(long m) const;

 private:
  [[nodiscard]] PairValue density(double x) const;
  [[nodiscard]] PairValue residue(long m) const;
  [[nodiscard]] PairValue near_pole(double x) const;

  bool exchanged_;  ///< alpha_ and beta_ are the caller's beta and alpha
  double alpha_;    ///< the larger order
  double beta_;
  double gap_;  ///< d = alpha_ - beta_
  double h_;
  double phase_;
  double pole_height_;   ///< pi (1 - d)/d
  double pole_damping_;  ///< exp(-pi height/h): size of the residue
};

}  // namespace tpm::law
