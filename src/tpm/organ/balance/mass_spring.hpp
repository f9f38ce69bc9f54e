#pragma once
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/bond_system.hpp"

namespace tpm::organ {

/// Springs of the mass-spring model.
enum class SpringRule {
  like_the_bonds,  ///< in proportion to the bonds' factors
  equal,           ///< one stiffness for all: the textbook's model
};

/// Force per depth at the probe for small depths, N/m, at equilibrium
/// (relaxation_factor = 1) or before anything has (0). Throws Error(bad_input) for a probe that
/// cannot move or a network with zero-energy modes.
[[nodiscard]] double contact_stiffness_N_per_m(const BondSystem& bonds, const Positions& rest,
                                               const Constraints& constraints, const Probe& probe,
                                               double relaxation_factor);

/// The mass-spring model on the spheres of a network: every bond becomes one elastic spring along
/// itself (in this library's terms a lateral bond), so that nothing relaxes. The masses are the
/// spheres', the dampers those of InertialOptions with stiffness_share = 1: one beside each spring.
[[nodiscard]] Network msm_network(const Network& network, SpringRule rule);

/// The elastic material with which the springs of an msm_network, fixed and pushed alike, meet a
/// small depth with the given stiffness.
/// @param stiffness_N_per_m > 0, as contact_stiffness_N_per_m gives it for the tissue
/// Throws Error(bad_input) as contact_stiffness_N_per_m does, and for a stiffness that is not > 0.
[[nodiscard]] BondMaterial msm_material(const Network& msm, const Constraints& constraints,
                                        const Probe& probe, double stiffness_N_per_m);

}  // namespace tpm::organ
