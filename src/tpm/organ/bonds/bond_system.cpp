#include "tpm/organ/bonds/bond_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kPartsKept = 4;
constexpr double kTouch_m = 1e-14;  // a gap that is none: above the rounding of positions

}  // namespace

BondSystem::BondSystem(const Network& network, const MaterialField& materials)
    : spheres_(network.organ.size()),
      rest_length_(static_cast<Eigen::Index>(network.bonds.size())),
      stiffness_(rest_length_.size()),
      relaxing_(rest_length_.size()) {
  const bool ropes = materials.lateral() == LateralBond::tension_only;
  for (const Bond& bond : network.bonds) {
    rest_length_[static_cast<Eigen::Index>(end_a_.size())] = bond.rest_length_m;
    end_a_.push_back(bond.a);
    end_b_.push_back(bond.b);
    rope_.push_back(ropes && bond.kind == BondKind::lateral);
  }
  set_materials(network, materials);
}

BondSystem::BondSystem(const Network& network, const BondMaterial& material)
    : BondSystem(network, MaterialField(material)) {}

std::uint16_t BondSystem::number_of(const ViscousLaw& law) {
  for (std::size_t i = 0; i < laws_.size(); ++i) {
    if (laws_[i].serves(law)) return static_cast<std::uint16_t>(i);
  }
  constexpr std::size_t kMostLaws = 60'000;
  if (laws_.size() == kMostLaws) {
    throw bad_input("material", fmt::format("more than {} different bonds", kMostLaws),
                    "a factor of place in one material, or fewer materials");
  }
  laws_.push_back(law);
  return static_cast<std::uint16_t>(laws_.size() - 1);
}

void BondSystem::number_times() {
  times_s_.clear();
  for (const ViscousLaw& law : laws_) {
    for (const ViscousLaw::Branch& branch : law.branches) {
      times_s_.push_back(branch.relaxation_time_s);
    }
  }
  std::sort(times_s_.begin(), times_s_.end());
  times_s_.erase(std::unique(times_s_.begin(), times_s_.end()), times_s_.end());
  most_branches_ = 1;
  linear_ = true;
  for (ViscousLaw& law : laws_) {
    most_branches_ = std::max(most_branches_, static_cast<Eigen::Index>(law.branches.size()));
    linear_ = linear_ && law.is_linear();
    for (ViscousLaw::Branch& branch : law.branches) {
      const auto found =
          std::lower_bound(times_s_.begin(), times_s_.end(), branch.relaxation_time_s);
      branch.time = static_cast<std::size_t>(found - times_s_.begin());
    }
  }
}

void BondSystem::set_materials(const Network& network, const MaterialField& materials) {
  BondLaws found(network, materials);
  laws_.clear();
  law_.assign(network.bonds.size(), 0);
  // The first material's branches come first: a law that has none can be any law that has.
  laws_.emplace_back(materials.materials.front().radial_law());
  const BondLaw* last = nullptr;
  std::uint16_t last_number = 0;
  for (std::size_t bond = 0; bond < network.bonds.size(); ++bond) {
    const auto i = static_cast<Eigen::Index>(bond);
    const auto [law, factor] = found.of(bond);
    stiffness_[i] = network.bonds[bond].factor * factor * law->instantaneous_N_per_m();
    relaxing_[i] = network.bonds[bond].factor * factor * law->relaxing_N_per_m();
    const bool blend = materials.materials.size() > 1;
    if (law != last || blend) last_number = number_of(ViscousLaw(*law));
    last = law;
    law_[bond] = last_number;
  }
  number_times();
}

BondSystem BondSystem::with_materials(const Network& network,
                                      const MaterialField& materials) const {
  BondSystem other = *this;
  other.set_materials(network, materials);
  return other;
}

double BondSystem::shortest_relaxation_time_s() const {
  return times_s_.empty() ? std::numeric_limits<double>::infinity() : times_s_.front();
}

double BondSystem::longest_relaxation_time_s() const {
  return times_s_.empty() ? 0.0 : times_s_.back();
}

bool BondSystem::relaxes_alike() const {
  const ViscousLaw* first = nullptr;
  for (std::size_t i = 0; i < first_contact(); ++i) {
    if (!(relaxing_[static_cast<Eigen::Index>(i)] > 0.0)) continue;
    const ViscousLaw& law = laws_[law_[i]];
    if (first != nullptr && !relax_alike(*first, law)) return false;
    first = &law;
  }
  return true;
}

double BondSystem::relaxation_time_s() const {
  if (times_s_.size() > 1) {
    throw bad_input("material",
                    fmt::format("has {} relaxation times where one is asked for", times_s_.size()),
                    "a material of one branch");
  }
  return shortest_relaxation_time_s();
}

Eigen::VectorXd BondSystem::stiffness_when(const RelaxationFactor& relaxation_factor) const {
  Eigen::VectorXd stiffness = stiffness_;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    stiffness[row] -= relaxation_factor(law_[i]) * relaxing_[row];
  }
  return stiffness;
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
    other.law_.push_back(0);
    other.rest_length_[row] = contact.reach_m;
    other.stiffness_[row] = contact.stiffness_N_per_m;
  }
  return other;
}

BondSystem BondSystem::without_tools() const {
  BondSystem other = *this;
  const std::size_t bonds = first_contact();
  for (const ToolContact& contact : contacts_) {
    other.spheres_ = std::min<std::size_t>(other.spheres_, contact.tool);
  }
  other.contacts_.clear();
  other.end_a_.resize(bonds);
  other.end_b_.resize(bonds);
  other.rope_.resize(bonds);
  for (Eigen::VectorXd* numbers : {&other.rest_length_, &other.stiffness_, &other.relaxing_}) {
    numbers->conservativeResize(static_cast<Eigen::Index>(bonds));
  }
  other.graph_ = std::make_shared<LazyGraph>();
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
                                  const ViscousState& viscous_state) const {
  if (!carries(bond, elongation, viscous_state.closed)) return {0.0, 0.0};
  const auto i = static_cast<Eigen::Index>(bond);
  const double k = stiffness_[i];
  const double g = relaxing_[i];
  if (linear_ || bond >= first_contact()) {
    const double slope = k - g * viscous_state.relaxation_factor(law_[bond]);
    return {slope * elongation - g * viscous_state.offset[i], slope};
  }
  const ViscousLaw& law = laws_[law_[bond]];
  const double now = 1.0 - viscous_state.relaxation_factor(law_[bond]);
  return {(k - g) * law.equilibrium(elongation) +
              g * (now * law.kernel.value(elongation) - viscous_state.offset[i]),
          (k - g) * law.equilibrium_slope(elongation) + g * now * law.kernel.slope(elongation)};
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
  for (std::size_t i = 0; i < first_contact(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    elongation[row] =
        (position.col(end_b_[i]) - position.col(end_a_[i])).norm() - rest_length_[row];
  }
  for (std::size_t i = first_contact(); i < size(); ++i) {
    elongation[static_cast<Eigen::Index>(i)] = line(i, position).elongation;
  }
}

void BondSystem::followed(const Positions& position, Eigen::VectorXd& followed) const {
  elongations(position, followed);
  if (linear_) return;
  for (std::size_t i = 0; i < first_contact(); ++i) {
    double& v = followed[static_cast<Eigen::Index>(i)];
    v = laws_[law_[i]].kernel.value(v);
  }
}

Eigen::VectorXd BondSystem::mean_viscous(const Eigen::MatrixXd& viscous) const {
  require_branches(viscous);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(viscous.rows());
  for (std::size_t i = 0; i < first_contact(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : laws_[law_[i]].branches) {
      mean[row] += branch.share * viscous(row, j++);
    }
  }
  return mean;
}

ViscousState BondSystem::viscous_state_at(const Eigen::VectorXd& y, const Eigen::VectorXd& followed,
                                          RelaxationFactor relaxation_factor,
                                          std::span<const char> closed) const {
  ViscousState viscous_state{y, std::move(relaxation_factor), closed};
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    viscous_state.offset[row] -= viscous_state.relaxation_factor(law_[i]) * followed[row];
  }
  return viscous_state;
}

void BondSystem::tensions(const Positions& position, const ViscousState& viscous_state,
                          Eigen::VectorXd& tension) const {
  elongations(position, tension);
  for (std::size_t i = 0; i < size(); ++i) {
    double& n = tension[static_cast<Eigen::Index>(i)];
    n = pull(i, n, viscous_state).force;
  }
}

void BondSystem::add_forces(const Positions& position, const ViscousState& viscous_state,
                            Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const Line placed = line(i, position);
    const Eigen::Vector3d f = pull(i, placed.elongation, viscous_state).force * placed.direction;
    force.col(end_a_[i]) += f;
    force.col(end_b_[i]) -= f;
  }
}

Eigen::Matrix3d BondSystem::stiffness_block(std::size_t bond, const Positions& position,
                                            const ViscousState& viscous_state) const {
  const Line placed = line(bond, position);
  const auto [force, slope] = pull(bond, placed.elongation, viscous_state);
  const double across = force * placed.per_length;
  Eigen::Matrix3d block = (slope - across) * placed.direction * placed.direction.transpose();
  block.diagonal().array() += across;
  return block;
}

void BondSystem::add_stiffness(const Positions& position, const ViscousState& viscous_state,
                               BlockMatrix& matrix) const {
  const Graph& on = graph();
  for (std::size_t i = 0; i < size(); ++i) {
    const Eigen::Matrix3d block = stiffness_block(i, position, viscous_state);
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

void BondSystem::kernel_slopes(const Positions& position, Eigen::VectorXd& slope) const {
  slope.setOnes(rest_length_.size());
  if (linear_) return;
  for (std::size_t i = 0; i < first_contact(); ++i) {
    slope[static_cast<Eigen::Index>(i)] = laws_[law_[i]].kernel.slope(line(i, position).elongation);
  }
}

void BondSystem::add_stiffness_times(const Positions& position, const ViscousState& viscous_state,
                                     const Eigen::Matrix3Xd& displacement,
                                     Eigen::Matrix3Xd& force) const {
  for (std::size_t i = 0; i < size(); ++i) {
    const Eigen::Vector3d apart = displacement.col(end_b_[i]) - displacement.col(end_a_[i]);
    if (apart.isZero(0.0)) continue;
    const Line placed = line(i, position);
    const auto [n, slope] = pull(i, placed.elongation, viscous_state);
    const double across = n * placed.per_length;
    const Eigen::Vector3d f =
        across * apart + (slope - across) * placed.direction.dot(apart) * placed.direction;
    force.col(end_b_[i]) += f;
    force.col(end_a_[i]) -= f;
  }
}

double BondSystem::potential_J(const Positions& position, const ViscousState& viscous_state) const {
  Eigen::VectorXd elongation;
  elongations(position, elongation);
  double energy = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double l = elongation[row];
    if (!carries(i, l, viscous_state.closed)) continue;
    const double k = stiffness_[row];
    const double g = relaxing_[row];
    const double relaxation_factor = viscous_state.relaxation_factor(law_[i]);
    if (linear_ || i >= first_contact()) {
      energy += l * (0.5 * (k - g * relaxation_factor) * l - g * viscous_state.offset[row]);
      continue;
    }
    const ViscousLaw& law = laws_[law_[i]];
    energy +=
        (k - g) * law.equilibrium_integral(l) +
        g * ((1.0 - relaxation_factor) * law.kernel.integral(l) - viscous_state.offset[row] * l);
  }
  return energy;
}

void BondSystem::require_branches(const Eigen::Ref<const Eigen::MatrixXd>& viscous) const {
  if (viscous.rows() == rest_length_.size() && viscous.cols() == most_branches_) return;
  throw bad_input("bonds",
                  fmt::format("{} by {} viscous elongations", viscous.rows(), viscous.cols()),
                  fmt::format("{} bonds by {} branches", rest_length_.size(), most_branches_));
}

double BondSystem::stored_energy_J(const Positions& position,
                                   const Eigen::Ref<const Eigen::MatrixXd>& viscous) const {
  require_branches(viscous);
  Eigen::VectorXd elongation;
  elongations(position, elongation);
  double energy = 0.0;
  for (std::size_t i = 0; i < size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double l = elongation[row];
    if (!carries(i, l, {})) continue;
    const double g = relaxing_[row];
    if (i >= first_contact()) {
      energy += 0.5 * stiffness_[row] * l * l;
      continue;
    }
    const ViscousLaw& law = laws_[law_[i]];
    energy += (stiffness_[row] - g) * (linear_ ? 0.5 * l * l : law.equilibrium_integral(l));
    if (!(g > 0.0)) continue;
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : law.branches) {
      const double m = viscous(row, j++);
      energy += g * branch.share * (linear_ ? 0.5 * (l - m) * (l - m) : law.kernel.gap(l, m));
    }
  }
  return energy;
}

double BondSystem::dissipation_W(const Positions& position,
                                 const Eigen::Ref<const Eigen::MatrixXd>& viscous) const {
  require_branches(viscous);
  Eigen::VectorXd elongation;
  elongations(position, elongation);
  double power = 0.0;
  for (std::size_t i = 0; i < first_contact(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (!(relaxing_[row] > 0.0)) continue;
    const ViscousLaw& law = laws_[law_[i]];
    const double l = elongation[row];
    Eigen::Index j = 0;
    for (const ViscousLaw::Branch& branch : law.branches) {
      const double m = viscous(row, j++);
      power += relaxing_[row] * branch.share * (l - law.kernel.inverse(m)) *
               (law.kernel.value(l) - m) / branch.relaxation_time_s;
    }
  }
  return power;
}

void require_one_linear_branch(const BondSystem& bonds, std::string_view who) {
  require_material(bonds, who, {});
}

}  // namespace tpm::organ
