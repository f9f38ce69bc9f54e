#pragma once
#include <vector>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/tool.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// A tool and how it takes part in what is imposed.
struct PressedTool {
  Tool tool;
  double share = 1.0;              ///< as Probe::share; 0: it stands still
  double stiffness_N_per_m = 0.0;  ///< of its contacts, > 0
  std::size_t group = 0;           ///< of probes: 0 the first, else one of Loading::beside
};

/// A network with all that touches it: what a run needs.
struct DrivenNetwork {
  BondSystem bonds;         ///< with the contacts
  Positions rest;           ///< of spheres, then tools
  Constraints constraints;  ///< a tool that is driven is guided, one that stands still is fixed
  Probes probes;
  std::vector<PressedTool> tools;

  [[nodiscard]] std::size_t spheres() const { return bonds.spheres() - tools.size(); }
  [[nodiscard]] Eigen::Index column_of_tool(std::size_t tool) const {
    return static_cast<Eigen::Index>(spheres() + tool);
  }
};

/// @param bonds, constraints of the organ
/// @param organ in equilibrium with the dead loads of `loading`
/// @param driven spheres that are driven themselves
/// @param loading of the spheres alone: tools are added to their groups
/// Throws Error(bad_input) if nothing is driven.
[[nodiscard]] DrivenNetwork driven_network(const BondSystem& bonds, const Organ& organ,
                                           const Constraints& constraints,
                                           std::vector<Probe> driven,
                                           std::vector<PressedTool> tools, Loading loading = {});

/// Where the spheres of a network are in equilibrium with forces that do not change, everything
/// relaxed. The forces are raised in parts where they cannot be applied together.
/// @param force_N one column per sphere
/// Throws Error(numerical) if the network buckles or its forces cannot be balanced.
[[nodiscard]] Positions loaded_positions(const BondSystem& bonds, const Positions& rest,
                                         const Constraints& constraints,
                                         const Eigen::Matrix3Xd& force_N);

/// Stiff enough for a force to be known to about 1e-4, and not so stiff that rounding shows: 1e4
/// times the stiffest bond, N/m.
[[nodiscard]] double usual_contact_stiffness_N_per_m(const BondSystem& bonds);

/// Place and force of a tool at an instant.
struct ToolState {
  Eigen::Vector3d position;  ///< m
  Eigen::Vector3d force;     ///< on the tissue, N
  int touching = 0;          ///< spheres
  double overlap_m = 0.0;    ///< the largest: what the finite stiffness of the contact costs
};

/// @param position of spheres and tools
/// @param contact_push_N what each contact pushes with, where bodies have mass and contacts
/// dashpots;
///        none: what their overlaps say
[[nodiscard]] std::vector<ToolState> tool_states(const DrivenNetwork& network,
                                                 const Positions& position,
                                                 const Eigen::VectorXd& contact_push_N = {});

/// Force on the tissue along what is driven, N: the contact force under an imposed depth (summed by
/// share); under a load that of the tools' contacts and of what loads spheres, which differs from
/// the load by what accelerates the tools.
[[nodiscard]] double force_on_tissue_N(const DrivenNetwork& network,
                                       const std::vector<ToolState>& tools, Drive drive,
                                       double imposed, double response);

/// Throws Error(numerical) if a tool has come into a sphere that is none of its possible_contacts.
void require_expected_contacts(const DrivenNetwork& network, const Positions& position,
                               double radius_m, double time_s);

}  // namespace tpm::organ
