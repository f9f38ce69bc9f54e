#pragma once
#include "tpmkit/bond_element.hpp"

namespace tpm::accuracy {

/// A copy whose equilibrium modulus is wrong by a share.
[[nodiscard]] inline BondElement flawed(BondElement element, double share) {
  element.equilibrium_Pa *= 1.0 + share;
  return element;
}

}  // namespace tpm::accuracy
