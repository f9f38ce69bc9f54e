#pragma once
#include <span>
#include <vector>

#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::organ {
/// Stress per strain, Pa, in Voigt's order xx, yy, zz, yz, xz, xy with engineering shear strains.
using Elasticity = Eigen::Matrix<double, 6, 6>;

/// A material by its engineering constants along the axes x, y, z.
struct Moduli {
  Eigen::Vector3d young_Pa;
  /// (i, j): contraction along j for a stretch along i under stress along i alone.
  Eigen::Matrix3d poisson;
  Eigen::Vector3d shear_Pa;  ///< yz, xz, xy
  double bulk_Pa = 0.0;      ///< of the mean stress under equal strains
  /// Relative loss of volume per compression along each axis: 1 - the two Poisson ratios.
  Eigen::Vector3d volume_change;
  /// Zener's ratio 2 C44/(C11 - C12) with the means over the three axes; 1 if isotropic.
  double anisotropy = 1.0;
};

/// The engineering constants of an elasticity that does not couple shear with stretch (orthotropic
/// along the axes). Throws Error(numerical) if it is not positive definite.
[[nodiscard]] Moduli moduli_of(const Elasticity& elasticity);

/// The elasticity of the network at rest if every sphere follows the mean strain (Cauchy and Born;
/// Born & Huang, Dynamical Theory of Crystal Lattices, 1954, section 11): the sum over bonds of
///
///     k L0^2 n_i n_j n_k n_l / volume
///
/// with half a bond for each of its ends among the spheres given. Exact for a Bravais lattice; for
/// an irregular arrangement an estimate that no uniform volume of these bonds exceeds, because
/// spheres that may give way make it softer. The tensor is symmetric in all four indices (Cauchy),
/// so C12 = C66, C13 = C55, C23 = C44.
/// @param relaxation_factor 0: instantaneous (k), 1: equilibrium (k - g)
/// @param spheres from 0, each once
/// @param volume_m3 that they fill up together, above 0
[[nodiscard]] Elasticity affine_elasticity(const Network& network, const BondSystem& bonds,
                                           double relaxation_factor,
                                           std::span<const std::size_t> spheres, double volume_m3);

/// The spheres that lie deeper than `margin_m` below every face of the organ's bounding box.
[[nodiscard]] std::vector<std::size_t> interior_spheres(const Organ& organ, double margin_m);

/// Response of a block to six strains imposed on its boundary.
struct PatchTest {
  Elasticity elasticity;
  std::size_t interior = 0;  ///< spheres that were free
  /// Largest displacement of a free sphere off the affine field, in parts of the field's largest.
  double deviation = 0.0;
};

/// The affine patch test at rest, to first order: the spheres within `margin_m` of a face move with
/// a uniform strain, the others find their balance, and the stress is the virial of the free ones
/// (half of each of their bonds). A free sphere of a lattice has all its neighbours at the
/// stiffness of the bulk if the margin is at least twice the support radius.
/// @param volume_per_sphere_m3 see volume_per_sphere()
/// Throws Error(bad_input) if the margin leaves no sphere free, Error(numerical) if they are loose.
[[nodiscard]] PatchTest affine_patch_test(const Network& block, const BondSystem& bonds,
                                          double relaxation_factor, double margin_m,
                                          double volume_per_sphere_m3);

/// A block between two smooth rigid plates across z, its sides free, to first order.
struct PlateTest {
  double young_Pa = 0.0;       ///< force over the area of the bounding box, per strain
  Eigen::Vector2d poisson;     ///< stretch along x and y of the best affine fit, per compression
  double volume_change = 0.0;  ///< relative loss of volume per compression: 1 - both
};

/// Unlike affine_patch_test() it sees the faces of the block, whose spheres have fewer bonds: its
/// results approach the bulk's as the number of cells grows.
/// Throws Error(numerical) if spheres are loose.
[[nodiscard]] PlateTest plate_test(const Network& block, const BondSystem& bonds,
                                   double relaxation_factor);

}  // namespace tpm::organ
