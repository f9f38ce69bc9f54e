#include "tpm/organ/balance/driven_network.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/text.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

DrivenNetwork driven_network(const BondSystem& bonds, const Organ& organ,
                             const Constraints& constraints, std::vector<Probe> driven,
                             std::vector<PressedTool> tools, Loading loading) {
  const std::size_t spheres = organ.size();
  Positions rest(3, organ.position.cols() + static_cast<Eigen::Index>(tools.size()));
  rest.leftCols(organ.position.cols()) = organ.position;
  Constraints with_tools = constraints.extended(tools.size());
  std::vector<ToolContact> contacts;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const auto& [tool, share, stiffness, group] = tools[i];
    const std::size_t column = spheres + i;
    rest.col(static_cast<Eigen::Index>(column)) = tool.position;
    if (share > 0.0) {
      with_tools.slide(column, tool.direction);
      (group == 0 ? driven : loading.beside[group - 1].probes)
          .push_back({column, tool.direction, share});
    } else {
      with_tools.fix(column);
    }
    const auto possible =
        possible_contacts(tool, static_cast<std::uint32_t>(column), organ, stiffness);
    contacts.insert(contacts.end(), possible.begin(), possible.end());
  }
  if (loading.dead_N.size() > 0) {
    for (Eigen::Matrix3Xd* of : {&loading.dead_N, &loading.unloaded}) {
      of->conservativeResize(3, rest.cols());
    }
    const auto more = static_cast<Eigen::Index>(tools.size());
    loading.dead_N.rightCols(more).setZero();
    loading.unloaded.rightCols(more) = rest.rightCols(more);
  }
  return {bonds.with_tools(tools.size(), contacts), std::move(rest), std::move(with_tools),
          Probes(std::move(driven), std::move(loading)), std::move(tools)};
}

Positions loaded_positions(const BondSystem& bonds, const Positions& rest,
                           const Constraints& constraints, const Eigen::Matrix3Xd& force_N) {
  constexpr double kBalanced = 1e-12;  // of the sum of the forces
  constexpr double kLeastPart = 1.0 / 1024.0;
  const double tolerance_N = kBalanced * force_N.colwise().norm().sum();
  if (!(tolerance_N > 0.0)) return rest;
  Equilibrium equilibrium(bonds, constraints, {.solver = StiffnessSolver::automatic});
  const ViscousState relaxed{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 1.0};
  Positions position = rest;
  double done = 0.0, part = 1.0;
  bool unstable = false;
  while (done < 1.0) {
    const double aim = std::min(1.0, done + part);
    Positions next = position;
    const EquilibriumSearch found = equilibrium.find(next, relaxed, aim * force_N, tolerance_N);
    if (found.converged && found.stable) {
      position = std::move(next);
      done = aim;
      part *= 2.0;
      continue;
    }
    unstable = !found.stable;
    part *= 0.5;
    if (part >= kLeastPart) continue;
    const std::string fault =
        (unstable ? "buckles" : "finds no equilibrium near: it may snap through") +
        buckling_place(equilibrium, position, relaxed, position.cols());
    throw Error(ExitCode::numerical, unstable ? ErrorCause::buckled : ErrorCause::snapped_through,
                "loads",
                fmt::format("at {} % of the loads that stay the tissue {}",
                            significant(100.0 * aim, 3), fault),
                "weaker loads, a stiffer tissue or more anchors");
  }
  return position;
}

double usual_contact_stiffness_N_per_m(const BondSystem& bonds) {
  constexpr double kTimesStiffestBond = 1e4;
  return kTimesStiffestBond * bonds.stiffness().maxCoeff();
}

std::vector<ToolState> tool_states(const DrivenNetwork& network, const Positions& position,
                                   const Eigen::VectorXd& contact_push_N) {
  std::vector<ToolState> states;
  for (std::size_t i = 0; i < network.tools.size(); ++i) {
    states.push_back({position.col(network.column_of_tool(i)), Eigen::Vector3d::Zero(), 0, 0.0});
  }
  const std::vector<char> closed = network.bonds.closed_contacts(position);
  const auto& contacts = network.bonds.contacts();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ToolContact& contact = contacts[i];
    if (closed[i] == 0) continue;
    ToolState& state = states[contact.tool - network.spheres()];
    const Eigen::Vector3d sphere = position.col(contact.sphere);
    const double gap = contact_gap_m(contact, sphere, state.position);
    const Eigen::Vector3d towards_tool =
        contact.normal ? *contact.normal : (state.position - sphere).normalized();
    state.force -=
        towards_tool * (contact_push_N.size() > 0 ? contact_push_N[static_cast<Eigen::Index>(i)]
                                                  : -contact.stiffness_N_per_m * gap);
    state.touching += 1;
    state.overlap_m = std::max(state.overlap_m, -gap);
  }
  return states;
}

double force_on_tissue_N(const DrivenNetwork& network, const std::vector<ToolState>& tools,
                         Drive drive, double imposed, double response) {
  if (drive == Drive::displacement) return response;
  double shares = 0.0;
  for (const Probe& probe : network.probes) shares += probe.share;
  double force = 0.0;
  for (const Probe& probe : network.probes) {
    force += probe.sphere < network.spheres()
                 ? probe.share / shares * imposed
                 : tools[probe.sphere - network.spheres()].force.dot(probe.direction);
  }
  return force;
}

void require_expected_contacts(const DrivenNetwork& network, const Positions& position,
                               double radius_m, double time_s) {
  std::set<std::pair<std::size_t, std::size_t>> expected;  // tool, sphere
  for (const ToolContact& contact : network.bonds.contacts()) {
    expected.insert({contact.tool - network.spheres(), contact.sphere});
  }
  for (std::size_t t = 0; t < network.tools.size(); ++t) {
    const Eigen::Vector3d place = position.col(network.column_of_tool(t));
    for (std::size_t i = 0; i < network.spheres(); ++i) {
      const Eigen::Vector3d centre = position.col(static_cast<Eigen::Index>(i));
      if (overlap_m(network.tools[t].tool, place, centre, radius_m) <= 0.0) continue;
      if (expected.contains({t, i})) continue;
      throw Error(ExitCode::numerical, "contacts",
                  fmt::format("at t = {} s tool {} has come into sphere {}, which was too far to "
                              "its side at rest to be reckoned with",
                              significant(time_s, 5), t + 1, i + 1));
    }
  }
}

}  // namespace tpm::organ
