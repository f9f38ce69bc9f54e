#include "tpm/network/bond_system.hpp"

#include <cmath>

namespace tpm {

BondSystem::BondSystem(const Network& network, const TpmParameters& material, LateralBond lateral)
    : spheres_(network.organ.size()),
      rest_length_(static_cast<Eigen::Index>(network.bonds.size())),
      stiffness_(rest_length_.size()),
      relaxing_(rest_length_.size()) {
  for (const Bond& bond : network.bonds) {
    rest_length_[static_cast<Eigen::Index>(end_a_.size())] = bond.rest_length_m;
    end_a_.push_back(bond.a);
    end_b_.push_back(bond.b);
    rope_.push_back(bond.kind == BondKind::lateral && lateral == LateralBond::tension_only);
  }
  set_material(network, material);
}

void BondSystem::set_material(const Network& network, const TpmParameters& material) {
  relaxation_time_s_ = material.relaxation_time_s();
  const double per_Pa = material.modulus_to_stiffness_m();
  Eigen::Index i = 0;
  for (const Bond& bond : network.bonds) {
    const bool radial = bond.kind == BondKind::radial;
    stiffness_[i] = bond.factor * per_Pa * (radial ? material.E2_Pa : material.Eprime_Pa);
    relaxing_[i] = radial ? bond.factor * per_Pa * material.relaxing_modulus_Pa() : 0.0;
    ++i;
  }
}

BondSystem BondSystem::with_material(const Network& network, const TpmParameters& material) const {
  BondSystem other = *this;
  other.set_material(network, material);
  return other;
}

const BondSystem::Graph& BondSystem::graph() const {
  std::call_once(graph_->once, [&] {
    std::vector<std::array<std::uint32_t, 2>> edges(size());
    for (std::size_t i = 0; i < size(); ++i) edges[i] = {end_a_[i], end_b_[i]};
    graph_->graph.emplace(Graph{BlockPattern(spheres_, edges), {}});
    Graph& found = *graph_->graph;
    for (const auto& [a, b] : edges) found.place.push_back(found.pattern.place(a, b));
  });
  return *graph_->graph;
}

BondSystem::Pull BondSystem::pull(std::size_t bond, double elongation,
                                  const BondMemory& memory) const {
  if (rope_[bond] && elongation < 0.0) return {0.0, 0.0};
  const auto i = static_cast<Eigen::Index>(bond);
  const double slope = stiffness_[i] - relaxing_[i] * memory.following;
  return {slope * elongation - relaxing_[i] * memory.offset[i], slope};
}

void BondSystem::elongations(const Positions& position, Eigen::VectorXd& elongation) const {
  elongation.resize(rest_length_.size());
  for (std::size_t i = 0; i < size(); ++i) {
    const double length = (position.col(end_b_[i]) - position.col(end_a_[i])).norm();
    const auto row = static_cast<Eigen::Index>(i);
    elongation[row] = length - rest_length_[row];
  }
}

void BondSystem::add_forces(const Positions& position, const BondMemory& memory,
                            Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d along = position.col(end_b_[i]) - position.col(end_a_[i]);
    const double length = along.norm();
    const double n = pull(i, length - rest_length_[row], memory).force;
    const Eigen::Vector3d f = (n / length) * along;
    force.col(end_a_[i]) += f;
    force.col(end_b_[i]) -= f;
  }
}

Eigen::Matrix3d BondSystem::stiffness_block(std::size_t bond, const Positions& position,
                                            const BondMemory& memory) const {
  const Eigen::Vector3d along = position.col(end_b_[bond]) - position.col(end_a_[bond]);
  const double length = along.norm();
  const Eigen::Vector3d direction = along / length;
  const double rest = rest_length_[static_cast<Eigen::Index>(bond)];
  const auto [force, slope] = pull(bond, length - rest, memory);
  const double across = force / length;
  Eigen::Matrix3d block = (slope - across) * direction * direction.transpose();
  block.diagonal().array() += across;
  return block;
}

void BondSystem::add_stiffness(const Positions& position, const BondMemory& memory,
                               BlockMatrix& matrix) const {
  const Graph& on = graph();
  for (std::size_t i = 0; i < size(); ++i) {
    const Eigen::Matrix3d block = stiffness_block(i, position, memory);
    matrix.diagonal[end_a_[i]] += block;
    matrix.diagonal[end_b_[i]] += block;
    matrix.below[on.place[i].index] -= block;  // symmetric: the same either way round
  }
}

void BondSystem::elongation_changes(const Positions& position, const Eigen::Matrix3Xd& displacement,
                                    Eigen::VectorXd& change) const {
  change.resize(rest_length_.size());
  for (std::size_t i = 0; i < size(); ++i) {
    const Eigen::Vector3d along = position.col(end_b_[i]) - position.col(end_a_[i]);
    change[static_cast<Eigen::Index>(i)] =
        along.dot(displacement.col(end_b_[i]) - displacement.col(end_a_[i])) / along.norm();
  }
}

void BondSystem::add_stiffness_times(const Positions& position, const BondMemory& memory,
                                     const Eigen::Matrix3Xd& displacement,
                                     Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d along = position.col(end_b_[i]) - position.col(end_a_[i]);
    const double length = along.norm();
    const auto [n, slope] = pull(i, length - rest_length_[row], memory);
    const double across = n / length;
    const Eigen::Vector3d apart = displacement.col(end_b_[i]) - displacement.col(end_a_[i]);
    const Eigen::Vector3d f =
        across * apart + (slope - across) * along.dot(apart) / (length * length) * along;
    force.col(end_b_[i]) += f;
    force.col(end_a_[i]) -= f;
  }
}

double BondSystem::potential_J(const Positions& position, const BondMemory& memory) const {
  double energy = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double l = (position.col(end_b_[i]) - position.col(end_a_[i])).norm() - rest_length_[row];
    if (rope_[i] && l < 0.0) continue;
    const double k = stiffness_[row] - relaxing_[row] * memory.following;
    energy += l * (0.5 * k * l - relaxing_[row] * memory.offset[row]);
  }
  return energy;
}

double BondSystem::stored_energy_J(const Positions& position,
                                   const Eigen::VectorXd& remembered) const {
  // With k = E2, g = E2 a, a = E2/(E1 + E2) and e1 = a y:
  // E2 (l - a y)^2/2 + E1 (a y)^2/2 = k l^2/2 - g l y + g y^2/2.
  double energy = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double l = (position.col(end_b_[i]) - position.col(end_a_[i])).norm() - rest_length_[row];
    if (rope_[i] && l < 0.0) continue;
    const double y = remembered[row];
    energy += 0.5 * stiffness_[row] * l * l - relaxing_[row] * y * (l - 0.5 * y);
  }
  return energy;
}

double BondSystem::dissipation_W(const Positions& position,
                                 const Eigen::VectorXd& remembered) const {
  // eta1 (de1/dt)^2 = tau g (dy/dt)^2 = g (l - y)^2 / tau.
  Eigen::VectorXd elongation;
  elongations(position, elongation);
  return ((elongation - remembered).array().square() * relaxing_.array()).sum() /
         relaxation_time_s_;
}

}  // namespace tpm
