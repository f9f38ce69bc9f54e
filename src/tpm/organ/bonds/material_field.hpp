#pragma once
#include <cstdint>
#include <vector>

#include "tpm/organ/bonds/network.hpp"
#include "tpmkit/bond_material.hpp"

namespace tpm::organ {

/// Material that the spheres of a network stand in. A bond between two spheres of one material and
/// one factor has their law; between others it follows by `between`.
struct MaterialField {
  MaterialField() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): one material everywhere is the usual case
  MaterialField(BondMaterial everywhere) : materials{std::move(everywhere)} {}

  /// All with one lateral rule.
  std::vector<BondMaterial> materials;
  std::vector<std::uint16_t> of_sphere;  ///< index of each sphere's material; empty: the first
  Eigen::VectorXd factor;                ///< on all moduli, one per sphere, > 0; empty: 1
  BlendRule between = BlendRule::mean;

  [[nodiscard]] LateralBond lateral() const { return materials.front().lateral; }
};

/// The law of each bond of a network, for a bond of factor 1 (Bond::factor is left out).
/// Throws Error(bad_input) as blended() does, for materials out of their range, and for materials
/// of different lateral rules.
class BondLaws {
 public:
  BondLaws(const Network& network, const MaterialField& field);

  /// The law of a bond, and the factor that multiplies it.
  struct Found {
    const BondLaw* law;
    double factor;
  };
  [[nodiscard]] Found of(std::size_t bond);

 private:
  [[nodiscard]] const BondLaw& law_of(std::size_t material, BondKind kind) const;

  const Network& network_;
  const MaterialField& field_;
  std::vector<BondLaw> radial_, lateral_;  ///< of each material
  BondLaw blend_;                          ///< the latest
};

}  // namespace tpm::organ
