#pragma once
#include <optional>

#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::organ {

/// Moduli of a network of bonds as a solid, by a relaxed test.
struct EffectiveModuli {
  Eigen::Vector3d young_Pa = Eigen::Vector3d::Zero();  ///< along x, y and z
  double poisson = 0.0;                                ///< mean over the six pairs of axes
  double anisotropy = 1.0;  ///< Zener's ratio 2 C44/(C11 - C12) of means over the axes
  std::size_t spheres = 0;  ///< that were free in the test

  [[nodiscard]] double mean_young_Pa() const { return young_Pa.mean(); }
};

/// The moduli of the inside of a solid filling at rest: six unit strains are imposed on the shell
/// of an inner block, the spheres inside find their balance, and the stress is their virial. The
/// affine sum over bonds, without the balance, is too stiff off a lattice. The block is a box of up
/// to nine spacings around the deepest sphere. None for what has no such inside: single layers and
/// shells, bodies with fewer than eight spheres that deep, and insides that are no lattice, whose
/// volume per sphere is not known.
/// @param relaxation_factor 0: instantaneous, 1: equilibrium
[[nodiscard]] std::optional<EffectiveModuli> effective_moduli(const Network& network,
                                                              const BondSystem& bonds,
                                                              double relaxation_factor);

}  // namespace tpm::organ
