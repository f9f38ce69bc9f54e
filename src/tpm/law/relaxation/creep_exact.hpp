#pragma once
#include "tpmkit/tpm_element.hpp"

namespace tpm::law {

/// Creep of the element under a constant load with the true lambda1(e): exact up to quadrature.
///
/// With T(u) = lambda1(u) u, f = load l0/A0 and R(u) = f - P2 u - T(u) the depth obeys
///     (E2 + T'(u)) du/dt = ((E1 + E2)/eta1) R(u),
/// so t(e) = tau * integral from e0 to e of (E2 + T'(u)) / R(u) du. R has one simple zero, at the
/// final depth; its pole is integrated in closed form and the smooth rest by Gauss-Legendre
/// quadrature. The depth at a time follows by Newton's method on the logarithm of the remaining
/// depth. Sensitivities come from differentiating t(e; parameters) at constant t.
class CreepUnderConstantLoad {
 public:
  /// @param load_N finite; a negative load pulls and gives the mirrored depth
  /// Throws Error(bad_input) if E2 = 0 and E' = 0, or if nothing carries the load in the end.
  CreepUnderConstantLoad(const TpmParameters& p, double load_N);

  /// @param time_s >= 0 since the load was applied, may be infinite
  [[nodiscard]] double depth_m(double time_s) const;

  /// d depth / d parameter at constant time and load, in the order of kTpmParameterTable.
  [[nodiscard]] TpmVector depth_sensitivity(double time_s) const;

  [[nodiscard]] double instantaneous_depth_m() const { return sign_ * start_; }

 private:
  [[nodiscard]] double remaining_log(double time_s) const;

  TpmParameters p_;
  double sign_;
  double stress_length_;  // |load| l0 / A0, Pa m
  double start_ = 0.0;    // depth at 0+, m, of the load's absolute value
  double final_ = 0.0;
  double tau_;
};

}  // namespace tpm::law
