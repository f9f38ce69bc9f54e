#pragma once
#include <array>

#include "tpm/network/quasistatic.hpp"

namespace tpm {

/// The changes of a network's bonds per Pa of E1, E2 and E', in that order: what
/// QuasiStaticOptions::directions takes. The change of the relaxation time is part of them.
[[nodiscard]] std::array<TangentDirection, 3> material_directions(const Network& network,
                                                                  const TpmParameters& material);

/// The change of everything about the bonds from one system to another of the same graph, over a
/// step: a central difference where the two lie on either side. To first order in the step, exact
/// to about the square of its size.
/// Throws Error(bad_input) if their laws do not correspond: a branch has vanished, or two materials
/// that were one law part.
[[nodiscard]] TangentDirection direction_between(const BondSystem& minus, const BondSystem& plus,
                                                 double step);

}  // namespace tpm
