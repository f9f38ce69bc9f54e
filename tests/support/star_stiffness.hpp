#pragma once
#include "tpm/organ/bonds/contact_stiffness.hpp"

namespace tpm::organ {

/// Resistance of the four-sphere star along its radial bond: its moduli times A0/l0 (its lateral
/// bonds are square to the displacement).
[[nodiscard]] inline ContactStiffness star_stiffness(const BondMaterial& material) {
  const double length = material.modulus_to_stiffness_m();
  return {material.instantaneous_Pa() * length, material.equilibrium_Pa * length};
}

}  // namespace tpm::organ
