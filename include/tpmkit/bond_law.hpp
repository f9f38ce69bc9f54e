#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "tpmkit/elongation_function.hpp"

namespace tpm {

/// The law of one bond of unit factor, elongation l, viscous elongations m_j:
///
///     f = sum_i c_i W_i(l) + sum_j g_j (V(l) - m_j),     dm_j/dt = (V(l) - m_j) / tau_j
///
/// in N, N/m, m, s. The first sum is the equilibrium force U'(l) of a convex potential U. The
/// branches are linear where V(l) = l; otherwise they act on the kernel V (docs/theory.md).
/// With c_i, g_j >= 0 and tau_j > 0 the bond stores
///
///     U(l) + sum_j g_j [P(l) + P*(m_j) - l m_j],   P the integral of V, P* its Legendre transform
///
/// (linear branches: g_j (l - m_j)^2/2) and turns sum_j g_j (l - V^-1(m_j)) (V(l) - m_j)/tau_j >= 0
/// into heat: it is passive.
///
/// Mean viscous elongation: with G = sum_j g_j and shares gamma_j = g_j/G the force and its slope
/// depend on the m_j through mbar = sum_j gamma_j m_j alone,
///
///     f = U'(l) + G V(l) - G mbar
struct BondLaw {
  /// A part of the equilibrium force.
  struct Spring {
    double stiffness_N_per_m = 0.0;  ///< c_i, >= 0
    ElongationFunction function;
  };
  struct Branch {
    double stiffness_N_per_m = 0.0;  ///< g_j, > 0
    double relaxation_time_s = 0.0;  ///< tau_j, > 0
  };

  std::vector<Spring> springs;
  ElongationFunction kernel;     ///< V
  std::vector<Branch> branches;  ///< of different relaxation times, the shortest first

  [[nodiscard]] double equilibrium_N_per_m()
      const;  ///< sum of c_i: slope at rest after full relaxation
  [[nodiscard]] double relaxing_N_per_m() const;  ///< G
  /// Instantaneous slope at rest.
  [[nodiscard]] double instantaneous_N_per_m() const {
    return equilibrium_N_per_m() + relaxing_N_per_m();
  }
  [[nodiscard]] bool is_linear() const;

  /// All stiffnesses times a factor >= 0.
  [[nodiscard]] BondLaw scaled(double factor) const;
  /// Sorts the branches, joins those with equal relaxation times and removes those without
  /// stiffness.
  void tidy();
};

/// Rule by which the law of a bond between two materials follows from their laws.
enum class BlendRule {
  mean,    ///< half of each side by side: the mean of the forces
  series,  ///< one half of each behind the other: the harmonic mean of the complex moduli
};

/// The law of a bond between two materials. The mean of laws is a law whose branches are those of
/// both. The series of two linear laws with n and m relaxation times has up to n + m of its own:
/// the roots r of G_1(-r) + G_2(-r) = 0 and the relaxation times that both share.
/// @param where for messages
/// Throws Error(bad_input) for a mean of laws whose branches act on different kernels, and for a
/// series of laws that are not linear, unless both are one law times factors.
[[nodiscard]] BondLaw blended(const BondLaw& a, const BondLaw& b, BlendRule rule,
                              std::string_view where);

}  // namespace tpm
