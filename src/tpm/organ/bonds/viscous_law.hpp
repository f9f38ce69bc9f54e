#pragma once
#include <vector>

#include "tpmkit/bond_law.hpp"

namespace tpm::organ {

/// A bond law in parts of its stiffnesses, shared by all bonds that differ by a factor. With k the
/// instantaneous stiffness at rest and g its relaxing part a bond pulls with
///
///     N = (k - g) u(l) + g (V(l) - y),   u = sum of shares times functions,   y = sum gamma_j m_j
struct ViscousLaw {
  struct Spring {
    double share = 0.0;
    ElongationFunction function;
  };
  struct Branch {
    double share = 0.0;              ///< gamma_j
    double relaxation_time_s = 0.0;  ///< tau_j
    std::size_t time = 0;            ///< index into BondSystem::relaxation_times_s()
  };
  std::vector<Spring> springs;   ///< shares add up to 1
  ElongationFunction kernel;     ///< V
  std::vector<Branch> branches;  ///< shares add up to 1; the shortest relaxation time first

  ViscousLaw() = default;
  explicit ViscousLaw(const BondLaw& law);

  [[nodiscard]] bool is_linear() const;
  /// Equal to rounding. A law without branches is also one that has them: nothing of the bond
  /// relaxes.
  [[nodiscard]] bool serves(const ViscousLaw& other) const;

  [[nodiscard]] double equilibrium(double l) const;           ///< u, m
  [[nodiscard]] double equilibrium_slope(double l) const;     ///< u'
  [[nodiscard]] double equilibrium_integral(double l) const;  ///< m^2
};

}  // namespace tpm::organ
