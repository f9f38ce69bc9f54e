#pragma once
#include <optional>
#include <vector>

#include "tpm/organ/balance/effective_moduli.hpp"
#include "tpm/organ/bonds/contact_stiffness.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// Of some numbers, the least, the mean and the largest; all 0 if there are none.
struct Spread {
  double min = 0.0, mean = 0.0, max = 0.0;
};

/// Properties of a network.
struct NetworkInspection {
  std::size_t radial_bonds = 0, lateral_bonds = 0;
  std::size_t free_coordinates = 0;
  std::vector<NearestDistances> nearest;            ///< a layer each, outermost first
  std::vector<Spread> lateral_count, radial_count;  ///< bonds of a sphere, a layer each
  /// Bond sums (network.hpp) over the spheres that are not the contact and have such bonds; under
  /// the rule `normalised` they would be 1 and 2, were an exact scaling possible.
  Spread radial_sum, lateral_sum;
  /// Of the contact along its normal, its neighbours fixed, over that of the star.
  std::optional<ContactStiffness> contact_over_star;
  /// Of the inside of a solid, instantaneous and at equilibrium; none for single layers and shells.
  std::optional<EffectiveModuli> instantaneous, equilibrium;
};

[[nodiscard]] NetworkInspection inspect(const Tissue& tissue);

}  // namespace tpm::organ
