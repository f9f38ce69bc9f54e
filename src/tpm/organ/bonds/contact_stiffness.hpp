#pragma once
#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::organ {

/// Resistance to a small displacement of one sphere while all others are fixed, N/m.
struct ContactStiffness {
  double instantaneous = 0.0;  ///< before the bonds relax
  double equilibrium = 0.0;    ///< at equilibrium
};

/// @param rest the positions at which every bond has its rest length
/// @param direction unit vector
[[nodiscard]] ContactStiffness held_stiffness(const BondSystem& bonds, const Positions& rest,
                                              std::size_t sphere, const Eigen::Vector3d& direction);

}  // namespace tpm::organ
