#pragma once
#include <array>

#include "tpm/network/quasistatic.hpp"

namespace tpm {

/// The changes of a network's bonds per relative change of E1, E2 and E' (d / d ln E), in that
/// order: what QuasiStaticOptions::directions takes.
[[nodiscard]] std::array<TangentDirection, 3> material_directions(const Network& network,
                                                                  const BondSystem& bonds,
                                                                  const TpmParameters& material);

}  // namespace tpm
