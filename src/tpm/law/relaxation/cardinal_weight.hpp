#pragma once
#include "tpm/law/relaxation/relaxation_spectrum.hpp"

namespace tpm::law {

/// The weight of the rate exp(x)/tau, x = (m + phase) h, in a sum that replaces the spectral
/// integral of E_alpha(-(t/tau)^alpha) over x. With y = -x + i pi (1 - alpha)/alpha
///
///     W(x) = (h/2 pi) Im[ (2 exp(i pi y/h) - 1 - cosh(alpha y)) / sinh(alpha y) ]
///
/// -(1 + cosh)/sinh = -coth(alpha y/2) is the trapezoidal rule h w(x); the other term is the
/// residue that the rule misses, spread over the grid by the cardinal functions of sin(pi
/// x/h)/sinh(alpha x). The pole of one cancels that of the other, so W is smooth in x and alpha, up
/// to alpha = 1, where it is (h/pi) sin(pi x/h)/sinh(x).
class CardinalWeight {
 public:
  /// @param alpha 0 < alpha <= 1, not checked
  /// @param phase -1/2 to 1/2, place of the grid relative to ln(1/tau)
  CardinalWeight(double alpha, double phase, double h);

  [[nodiscard]] double place(long m) const { return h_ * (static_cast<double>(m) + phase_); }
  /// W at the node m, and its derivatives by alpha and by x (that is: by ln tau).
  [[nodiscard]] SpectralValue at(long m) const;
  /// The sum of W over the nodes m, m + direction, m + 2 direction, ... with direction +1 or -1, as
  /// accurate as RelaxationSpectrum::sum_from: the peak at x = 0 should lie well behind m.
  [[nodiscard]] SpectralValue sum_from(long m, int direction) const;

 private:
  [[nodiscard]] SpectralValue residue(long m) const;
  [[nodiscard]] SpectralValue near_pole(double x) const;

  RelaxationSpectrum spectrum_;
  double h_;
  double phase_;
  double pole_damping_;  ///< exp(-pi height/h): size of the residue
  double phase_cosine_;  ///< cos(pi phase)
  double phase_sine_;
  double pole_sine_;  ///< of the pole angle pi (1 - alpha)
  double pole_cosine_;
};

}  // namespace tpm::law
