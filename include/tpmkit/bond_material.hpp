#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/bond_law.hpp"
#include "tpmkit/units.hpp"

namespace tpm {

/// Law of the bonds within a layer.
enum class LateralBond {
  elastic,       ///< modulus E', pulling and pushing
  tension_only,  ///< modulus E', as a rope
  relaxing,      ///< instantaneous modulus E'; relaxes by the same function as the radial bonds
};

/// The material of the bonds of a network: an equilibrium modulus, any number of relaxing branches,
/// and the modulus of the lateral bonds. Moduli are Pa; a bond of factor w has the stiffness
/// w (modulus) A0/l0. A radial bond of elongation l pulls with
///
///     f = w (A0/l0) [Einf W(l) + sum_j g_j (V(l) - m_j)],     dm_j/dt = (V(l) - m_j)/tau_j
///
/// W is the shape of the equilibrium potential, V(l) = l or the kernel that the branches act on. A
/// lateral bond has the same shapes and the modulus E' (LateralBond). docs/materials.md lists
/// the formulations that take each material.
///
/// The paper's element is the instance with W(l) = V(l) = l, Einf = P2, one branch of modulus
/// E2^2/(E1 + E2) and tau = eta1/(E1 + E2).
struct BondMaterial {
  struct Branch {
    double modulus_Pa = 0.0;         ///< g_j, >= 0
    double relaxation_time_s = 0.0;  ///< tau_j, > 0
  };
  static constexpr std::size_t kMostBranches = 40;

  double equilibrium_Pa = 0.0;   ///< Einf, >= 0
  ElongationFunction potential;  ///< W
  std::vector<Branch> branches;  ///< at most kMostBranches
  ElongationFunction kernel;     ///< V
  double lateral_Pa = 0.0;       ///< E', >= 0
  LateralBond lateral = LateralBond::elastic;
  double A0_m2 = 12.56e-6;  ///< > 0
  double l0_m = 1e-3;       ///< > 0

  [[nodiscard]] double relaxing_Pa() const;  ///< sum of g_j
  [[nodiscard]] double instantaneous_Pa() const { return equilibrium_Pa + relaxing_Pa(); }
  [[nodiscard]] double modulus_to_stiffness_m() const { return A0_m2 / l0_m; }

  /// Laws of bonds of factor 1.
  [[nodiscard]] BondLaw radial_law() const;
  [[nodiscard]] BondLaw lateral_law() const;
};

/// The table of a material's parameters: Einf, Eprime, those of the shape of W, those of the shape
/// of V with the prefix `kernel_`, g1, tau1, ... g40, tau40, A0, l0. Names, units and ranges come
/// from this table only.
[[nodiscard]] std::vector<MaterialParameter> parameters_of(const BondMaterial& material);

/// The name in the table for a parameter of the shape of V.
[[nodiscard]] std::string kernel_parameter(std::string_view name);

/// The value of a parameter by its name, SI; none if the material has no such parameter.
[[nodiscard]] std::optional<double> value_of(const BondMaterial& material, std::string_view name);

/// Sets a parameter by its name. Throws Error(bad_input) for an unknown name, with the list of
/// names, and for a value out of its range.
void set_value(BondMaterial& material, std::string_view name, double value, std::string_view where);

/// Throws Error(bad_input) naming the first parameter out of its range, and for too many branches.
void require_valid(const BondMaterial& material, std::string_view where);

}  // namespace tpm
