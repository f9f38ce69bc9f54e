#pragma once
#include <array>

#include "tpm/network/quasistatic.hpp"

namespace tpm {

/// The changes of a network's bonds per Pa of E1, E2 and E', in that order: what
/// QuasiStaticOptions::directions takes. The change of the relaxation time is part of them.
[[nodiscard]] std::array<TangentDirection, 3> material_directions(const Network& network,
                                                                  const TpmParameters& material);

}  // namespace tpm
