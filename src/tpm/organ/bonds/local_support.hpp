#pragma once
#include <string_view>
#include <vector>

#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/bonds/network.hpp"

namespace tpm::organ {

/// Below this share a sphere counts as loose. Sound networks (livers, shells and solid, blocks of
/// every lattice; support 1.5) have 0.33 and more everywhere, a shell without diagonal bonds 0.001.
inline constexpr double kLooseSupport = 0.05;

/// Support of each sphere by its surroundings: its stiffness along its normal at rest with all but
/// its bonded neighbours fixed, over that with the neighbours fixed too. 1 for a sphere that cannot
/// move along its normal; 0 where nothing resists. Unlike the lowest eigenvalue of the network it
/// does not fall with the number of spheres, and so tells a near mechanism (a shell whose curvature
/// alone resists, docs/theory.md) from a large organ that bends.
[[nodiscard]] std::vector<double> local_support(const BondSystem& bonds, const Organ& organ,
                                                const Constraints& constraints);

/// The spheres below kLooseSupport, the loosest first; from 0.
[[nodiscard]] std::vector<std::size_t> loose_spheres(const std::vector<double>& support);

/// Throws Error(bad_input) that names the loose spheres, unless there are none.
void require_supported(const BondSystem& bonds, const Organ& organ, const Constraints& constraints,
                       std::string_view where);

/// "sphere 7", "spheres 12, 14 and 5 more"; numbers from 1.
[[nodiscard]] std::string sphere_list(const std::vector<std::size_t>& spheres);
/// The same with the place of the first: "spheres 12, 14 and 5 more, the first at (1, 2, 3) mm".
[[nodiscard]] std::string sphere_list(const std::vector<std::size_t>& spheres,
                                      const Positions& position);

}  // namespace tpm::organ
