#pragma once
#include <array>

#include "tpm/organ/balance/quasistatic.hpp"

namespace tpm::organ {

/// The changes of a network's bonds per Pa of the paper's E1, E2 and E', in that order: what
/// QuasiStaticOptions::directions takes. The change of the relaxation time is part of them.
/// @param modulus_to_stiffness_m A0/l0
[[nodiscard]] std::array<TangentDirection, 3> material_directions(const Network& network,
                                                                  double E1_Pa, double E2_Pa,
                                                                  double modulus_to_stiffness_m);

/// The change of everything about the bonds of a system: a central difference between two systems
/// of the same graph on either side of it, over the step from one to the other. Throws
/// Error(bad_input) if their laws do not correspond: a branch has vanished, or materials that were
/// one part.
[[nodiscard]] TangentDirection direction_between(const BondSystem& minus, const BondSystem& bonds,
                                                 const BondSystem& plus, double step);

}  // namespace tpm::organ
