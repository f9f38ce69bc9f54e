#pragma once
#include <string>
#include <vector>

#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// Motions of the free coordinates at rest that no bond resists, to first order.
struct ZeroEnergyModes {
  std::size_t count = 0;
  /// Spheres that take part, those that move most first; from 0. Where there are more than 24
  /// modes, those of 24 of them.
  std::vector<std::size_t> spheres;

  [[nodiscard]] bool is_rigid() const { return count == 0; }
};

/// Motions of the whole body that the constraints leave free, 0 to 6 orthonormal columns;
/// coordinates of all spheres.
[[nodiscard]] Eigen::MatrixXd whole_motions(const Positions& rest, const Constraints& constraints);

/// Counts the eigenvalues of the stiffness matrix at rest that are 0 within 1e-9 of its mean
/// diagonal, by the signs of the pivots of the shifted matrix, and finds the modes by inverse
/// iteration.
/// @param rest the positions at which every bond has its rest length
/// @param whole motions that are not counted, as of whole_motions; the spheres are named that move
///   in the others
[[nodiscard]] ZeroEnergyModes zero_energy_modes(const BondSystem& bonds, const Positions& rest,
                                                const Constraints& constraints,
                                                const Eigen::MatrixXd& whole = {});

/// "3 zero-energy modes; loose: spheres 12, 14 and 5 more": for messages.
[[nodiscard]] std::string words(const ZeroEnergyModes& modes);

/// Throws Error(bad_input) unless the network is rigid.
/// @param whole as in zero_energy_modes
void require_rigid(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                   std::string_view where, const Eigen::MatrixXd& whole = {});

}  // namespace tpm::organ
