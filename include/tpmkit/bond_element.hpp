#pragma once
#include <cmath>

#include "tpmkit/bond_material.hpp"

namespace tpm {

/// 1 - cos(arctan(e / x)), dimensionless, without cancellation for e << x.
template <class T>
[[nodiscard]] T one_minus_cosine(const T& elongation, const T& spacing) {
  using std::sqrt;
  const T ratio2 = (elongation / spacing) * (elongation / spacing);
  const T root = sqrt(ratio2 + 1.0);
  return ratio2 / (root * (root + 1.0));
}

/// lambda1(e) = 2 E' (1 - cos(arctan(e / x))), Pa (Eq. 2). Elongation and spacing in m.
[[nodiscard]] inline double lambda1_Pa(double Eprime_Pa, double elongation_m, double spacing_m) {
  return 2.0 * Eprime_Pa * one_minus_cosine(elongation_m, spacing_m);
}

/// Force of the bonds at an elongation, in units of stress times length (Pa m): multiply by
/// A0 / l0 for newtons.
struct TensionLaw {
  double Eprime_Pa;
  double spacing_m;

  /// lambda1(e) e
  [[nodiscard]] double value(double e) const { return lambda1_Pa(Eprime_Pa, e, spacing_m) * e; }
  /// d(lambda1(e) e)/de
  [[nodiscard]] double slope(double e) const;
  /// d(lambda1(e) e)/dx
  [[nodiscard]] double d_spacing(double e) const;
};

/// One sphere on a bond of a material, with the pull of two lateral bonds whose far ends stand at
/// the spacing x: the four-sphere star of the paper, moved by e along its normal (Bao et al. 2013),
///
///     F = (A0/l0) [Einf e + sum_j g_j (e - m_j) + lambda1(e) e]
///
/// for linear branches and lateral bonds of modulus E'.
struct BondElement : BondMaterial {
  double spacing_m = 0.030;  ///< x, > 0

  [[nodiscard]] TensionLaw tension() const { return {lateral_Pa, spacing_m}; }
  /// Relaxation time of the first branch, s; infinite without a branch.
  [[nodiscard]] double relaxation_time_s() const;
  /// A copy with another relaxation time of the first branch. The element must have a branch.
  [[nodiscard]] BondElement with_relaxation_time(double time_s) const;
  /// True for one linear branch and lateral bonds that do not relax. Ropes count: in the star the
  /// lateral bonds are only stretched.
  [[nodiscard]] bool has_one_branch() const;
};

/// The element of the paper: E1 = E2 = E' = 12 kPa, x = 30 mm, and eta1 = 5 Pa s, that is tau =
/// 0.208 ms, or another relaxation time.
[[nodiscard]] BondElement paper_element(double relaxation_time_s = 5.0 / 24e3);

/// Throws Error(bad_input) for a parameter out of its range, and unless has_one_branch().
void require_one_branch(const BondElement& element, std::string_view where);

/// Depth e, m, at which the elastic part carries the load with the true lambda1(e):
/// (modulus + lambda1(e)) e A0/l0 = load. The instantaneous modulus yields the instantaneous depth,
/// the equilibrium modulus the final one. Converges for every load, because the left side is
/// strictly increasing.
/// @param modulus_Pa >= 0; if 0, E' must be > 0
[[nodiscard]] double equilibrium_depth_m(const BondElement& element, double modulus_Pa,
                                         double load_N);

}  // namespace tpm
