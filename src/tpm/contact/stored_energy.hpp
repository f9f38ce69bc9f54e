#pragma once
#include "tpm/law/kernel.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::contact {

/// Energy stored in a contact that answers by a law with parallel branches on a kernel V,
///
///     F = k_inf V(u) + sum k_i (V(u) - V_i) + k_tension T(u),
///     S = k_inf P(u) + sum k_i [P(u) + P*(V_i) - u V_i] + k_tension Q(u),
///
/// P and Q the integrals of V and T, P*(v) = u_v v - P(u_v) with V(u_v) = v the Legendre transform
/// of P. S >= 0 and dS/dt <= F du/dt for rising V and k >= 0 (Fenchel-Young). V is continued below
/// 0 as an odd function.
class StoredEnergy {
 public:
  /// Throws Error(bad_input) for fractional laws and Kelvin chains.
  explicit StoredEnergy(const LawFile& law);

  /// P(u), m^2.
  [[nodiscard]] double potential(double u) const;
  /// P*(v), m^2.
  [[nodiscard]] double conjugate(double v) const;
  /// P(u) + P*(v) - u v >= 0, m^2: the energy of a branch per stiffness.
  [[nodiscard]] double branch(double u, double v) const;
  /// V(u), continued below 0.
  [[nodiscard]] double kernel(double u) const;
  /// k_inf V(u) + k_tension T(u), N.
  [[nodiscard]] double lasting_force(double u) const;
  /// k_inf P(u) + k_tension Q(u), J.
  [[nodiscard]] double lasting(double u) const;
  /// sum k_i, N/m.
  [[nodiscard]] double relaxing_stiffness() const { return relaxing_; }

 private:
  [[nodiscard]] double tension_potential(double u) const;

  LawSpec spec_;
  law::KernelShape shape_;
  law::TensionShape tension_;
  double exponent_, share_, k_inf_, k_tension_, relaxing_;
};

}  // namespace tpm::contact
