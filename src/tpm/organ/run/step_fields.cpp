#include "tpm/organ/run/step_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tpm::organ {
std::vector<double> list_of(const Eigen::MatrixXd& numbers) {
  return {numbers.data(), numbers.data() + numbers.size()};
}

std::string viscous_name(Eigen::Index branch, Eigen::Index branches) {
  return branches == 1 ? "viscous_m" : fmt::format("viscous_{}_m", branch + 1);
}

StepFields fields_of(const ExperimentScene& scene, const RunNetwork& network,
                     const ValidityWatch& watch, const QuasiStaticState& state) {
  StepFields fields;
  const Eigen::Matrix3Xd moved = displacements_m(network, state);
  fields.of_spheres = {{"displacement_m", 3, list_of(moved)},
                       {"displacement_magnitude_m", 1, list_of(moved.colwise().norm())}};
  fields.validity = watch.flags(network.spheres(state.position));
  const Eigen::VectorXd bond_force = bond_forces_N(network.driven.bonds, state);
  if (scene.outputs.force) {
    const std::vector<char> open(network.driven.bonds.contact_count(), 0);
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, state.position.cols());
    network.driven.bonds.add_forces(
        state.position, {network.driven.bonds.mean_viscous(state.viscous), 0.0, open}, force);
    fields.of_spheres.push_back({"force_N", 3, list_of(network.spheres(force))});
    fields.of_spheres.push_back(
        {"largest_bond_force_N", 1, largest_bond_forces_N(network.network, bond_force)});
  }
  if (scene.outputs.bond_force) {
    fields.of_bonds.push_back({"bond_force_N", 1, list_of(bond_force)});
  }
  if (scene.outputs.viscous) {
    const auto bonds = static_cast<Eigen::Index>(network.network.bonds.size());
    for (Eigen::Index j = 0; j < state.viscous.cols(); ++j) {
      fields.of_bonds.push_back(
          {viscous_name(j, state.viscous.cols()), 1, list_of(state.viscous.col(j).head(bonds))});
    }
  }
  return fields;
}

Eigen::VectorXd bond_forces_N(const BondSystem& bonds, const QuasiStaticState& state) {
  Eigen::VectorXd tension;
  bonds.tensions(state.position, {bonds.mean_viscous(state.viscous), 0.0}, tension);
  return tension.head(static_cast<Eigen::Index>(bonds.first_contact()));
}

std::vector<double> largest_bond_forces_N(const Network& network,
                                          const Eigen::VectorXd& bond_force_N) {
  std::vector<double> largest(network.organ.size(), 0.0);
  for (std::size_t i = 0; i < network.bonds.size(); ++i) {
    const double force = std::abs(bond_force_N[static_cast<Eigen::Index>(i)]);
    for (const std::size_t end : {network.bonds[i].a, network.bonds[i].b}) {
      largest[end] = std::max(largest[end], force);
    }
  }
  return largest;
}

Eigen::Matrix3Xd displacements_m(const RunNetwork& network, const QuasiStaticState& state) {
  return network.spheres(state.position) - network.network.organ.position;
}

}  // namespace tpm::organ
