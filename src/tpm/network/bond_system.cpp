#include "tpm/network/bond_system.hpp"

#include <algorithm>
#include <cmath>

namespace tpm {
namespace {

constexpr std::size_t kPartsKept = 4;
constexpr double kTouch_m = 1e-14;  // a gap that is none: above the rounding of positions

}  // namespace

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

std::shared_ptr<const BondSystem::PartGraph> BondSystem::part_graph(
    const std::vector<bool>& without) const {
  const std::scoped_lock lock(graph_->part_guard);
  auto& kept = graph_->part;
  const auto known = std::find_if(kept.begin(), kept.end(),
                                  [&](const auto& part) { return part.first == without; });
  if (known != kept.end()) {
    std::rotate(known, known + 1, kept.end());
    return kept.back().second;
  }
  std::vector<std::array<std::uint32_t, 2>> edges;
  const auto has_part = [&](std::size_t i) { return !without[end_a_[i]] && !without[end_b_[i]]; };
  for (std::size_t i = 0; i < size(); ++i) {
    if (has_part(i)) edges.push_back({end_a_[i], end_b_[i]});
  }
  PartGraph part{BlockPattern(spheres_, edges), {}};
  part.place.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    if (has_part(i)) part.place[i] = part.pattern.place(end_a_[i], end_b_[i]);
  }
  if (kept.size() == kPartsKept) kept.erase(kept.begin());
  kept.emplace_back(without, std::make_shared<const PartGraph>(std::move(part)));
  return kept.back().second;
}

BondSystem BondSystem::with_tools(std::size_t tools, std::span<const ToolContact> contacts) const {
  BondSystem other = *this;
  if (tools == 0 && contacts.empty() && contacts_.empty()) return other;
  other.spheres_ += tools;
  other.contacts_.assign(contacts.begin(), contacts.end());
  other.graph_ = std::make_shared<LazyGraph>();
  const auto before = static_cast<Eigen::Index>(size());
  const auto added = static_cast<Eigen::Index>(contacts.size());
  other.rest_length_.conservativeResize(before + added);
  other.stiffness_.conservativeResize(before + added);
  other.relaxing_.conservativeResize(before + added);
  other.relaxing_.tail(added).setZero();
  for (const ToolContact& contact : contacts) {
    const auto row = static_cast<Eigen::Index>(other.end_a_.size());
    other.end_a_.push_back(contact.sphere);
    other.end_b_.push_back(contact.tool);
    other.rope_.push_back(false);
    other.rest_length_[row] = contact.reach_m;
    other.stiffness_[row] = contact.stiffness_N_per_m;
  }
  return other;
}

BondSystem::Line BondSystem::line(std::size_t bond, const Positions& position) const {
  const Eigen::Vector3d along = position.col(end_b_[bond]) - position.col(end_a_[bond]);
  const double rest = rest_length_[static_cast<Eigen::Index>(bond)];
  if (bond >= first_contact()) {
    if (const auto& normal = contacts_[bond - first_contact()].normal) {
      return {*normal, along.dot(*normal) - rest, 0.0};
    }
  }
  const double length = along.norm();
  return {along / length, length - rest, 1.0 / length};
}

bool BondSystem::carries(std::size_t bond, double elongation, std::span<const char> closed) const {
  if (rope_[bond]) return elongation >= 0.0;
  if (bond < first_contact()) return true;
  return closed.empty() ? elongation <= kTouch_m : closed[bond - first_contact()] != 0;
}

BondSystem::Pull BondSystem::pull(std::size_t bond, double elongation,
                                  const BondMemory& memory) const {
  if (!carries(bond, elongation, memory.closed)) return {0.0, 0.0};
  const auto i = static_cast<Eigen::Index>(bond);
  const double slope = stiffness_[i] - relaxing_[i] * memory.following;
  return {slope * elongation - relaxing_[i] * memory.offset[i], slope};
}

std::vector<char> BondSystem::closed_contacts(const Positions& position) const {
  std::vector<char> closed;
  for (std::size_t i = first_contact(); i < size(); ++i) {
    closed.push_back(carries(i, line(i, position).elongation, {}) ? 1 : 0);
  }
  return closed;
}

void BondSystem::elongations(const Positions& position, Eigen::VectorXd& elongation) const {
  elongation.resize(rest_length_.size());
  for (std::size_t i = 0; i < size(); ++i) {
    elongation[static_cast<Eigen::Index>(i)] = line(i, position).elongation;
  }
}

void BondSystem::tensions(const Positions& position, const BondMemory& memory,
                          Eigen::VectorXd& tension) const {
  elongations(position, tension);
  for (std::size_t i = 0; i < size(); ++i) {
    double& n = tension[static_cast<Eigen::Index>(i)];
    n = pull(i, n, memory).force;
  }
}

void BondSystem::add_forces(const Positions& position, const BondMemory& memory,
                            Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const Line lies = line(i, position);
    const Eigen::Vector3d f = pull(i, lies.elongation, memory).force * lies.direction;
    force.col(end_a_[i]) += f;
    force.col(end_b_[i]) -= f;
  }
}

Eigen::Matrix3d BondSystem::stiffness_block(std::size_t bond, const Positions& position,
                                            const BondMemory& memory) const {
  const Line lies = line(bond, position);
  const auto [force, slope] = pull(bond, lies.elongation, memory);
  const double across = force * lies.per_length;
  Eigen::Matrix3d block = (slope - across) * lies.direction * lies.direction.transpose();
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
    change[static_cast<Eigen::Index>(i)] =
        line(i, position).direction.dot(displacement.col(end_b_[i]) - displacement.col(end_a_[i]));
  }
}

void BondSystem::add_stiffness_times(const Positions& position, const BondMemory& memory,
                                     const Eigen::Matrix3Xd& displacement,
                                     Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const Line lies = line(i, position);
    const auto [n, slope] = pull(i, lies.elongation, memory);
    const double across = n * lies.per_length;
    const Eigen::Vector3d apart = displacement.col(end_b_[i]) - displacement.col(end_a_[i]);
    const Eigen::Vector3d f =
        across * apart + (slope - across) * lies.direction.dot(apart) * lies.direction;
    force.col(end_b_[i]) += f;
    force.col(end_a_[i]) -= f;
  }
}

double BondSystem::potential_J(const Positions& position, const BondMemory& memory) const {
  double energy = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double l = line(i, position).elongation;
    if (!carries(i, l, memory.closed)) continue;
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
    const double l = line(i, position).elongation;
    if (!carries(i, l, {})) continue;
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
