#include "tpm/organ/balance/inertial_equation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/organ/balance/tool_impact.hpp"

namespace tpm::organ {
namespace {

using Spheres = Eigen::Map<Eigen::Matrix3Xd>;
using ConstSpheres = Eigen::Map<const Eigen::Matrix3Xd>;

/// The share of the viscous elongations of each law that follows in an implicit step of size gamma.
RelaxationFactor relaxation_factor_over(const BondSystem& bonds, double gamma) {
  std::vector<double> of_law;
  for (const ViscousLaw& law : bonds.laws()) {
    double share = 0.0;
    for (const ViscousLaw::Branch& branch : law.branches) {
      const double ratio = gamma / branch.relaxation_time_s;
      share += branch.share * ratio / (1.0 + ratio);
    }
    of_law.push_back(share);
  }
  return RelaxationFactor(std::move(of_law));
}

constexpr double kTouching_m = 1e-14;  // a gap that is none: above the rounding of positions

/// 1/m of a sphere and a tool that a spring joins, 1/kg: of those that move.
double inverse_mass_per_kg(const DrivenTissue& tissue, const Inertia& inertia,
                           const ToolContact& contact) {
  const auto moves = [&](std::uint32_t column) {
    return tissue.constraints().projector(column).isZero(0.0) ? 0.0 : 1.0 / inertia.mass_kg[column];
  };
  return moves(contact.sphere) + moves(contact.tool);
}

/// c of each contact.
Eigen::VectorXd contact_dashpots(const DrivenTissue& tissue, const Inertia& inertia) {
  const auto& contacts = tissue.bonds().contacts();
  Eigen::VectorXd c(std::ssize(contacts));
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const double per_mass = inverse_mass_per_kg(tissue, inertia, contacts[i]);
    c[static_cast<Eigen::Index>(i)] = per_mass > 0.0
                                          ? 2.0 * inertia.contact_damping_ratio *
                                                std::sqrt(contacts[i].stiffness_N_per_m / per_mass)
                                          : 0.0;
  }
  return c;
}

}  // namespace

InertialEquation::InertialEquation(const DrivenTissue& tissue, const Positions& rest,
                                   Inertia inertia)
    : tissue_(tissue),
      rest_(rest),
      inertia_(std::move(inertia)),
      matrix_(tissue.bonds().pattern()),
      factor_(tissue.bonds().pattern()) {
  const BondSystem& bonds = tissue.bonds();
  size_ = 2 * coordinates();
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const bool relaxes = bonds.relaxing()[static_cast<Eigen::Index>(i)] > 0.0;
    viscous_of_.push_back(relaxes ? size_ : -1);
    if (!relaxes) continue;
    relaxing_.push_back(i);
    size_ += static_cast<Eigen::Index>(branches_of(i).size());
  }
  motion_.viscous.setZero(static_cast<Eigen::Index>(bonds.size()), bonds.most_branches());
  motion_.mean.setZero(static_cast<Eigen::Index>(bonds.size()));
  drag_per_s_ = Vector::Constant(rest_.cols(), inertia_.drag_per_s);
  tissue_mass_kg_ = inertia_.mass_kg;
  for (const ToolContact& contact : bonds.contacts()) {
    drag_per_s_[contact.tool] = tissue_mass_kg_[contact.tool] = 0.0;
  }
  contact_dashpot_N_s_m_ = contact_dashpots(tissue, inertia_);
}

Eigen::Index InertialEquation::size() const {
  return size_;
}

double InertialEquation::driven_mass_kg() const {
  return tissue_.driven_mass_kg(inertia_.mass_kg);
}

double InertialEquation::driven_sphere_mass_kg() const {
  return tissue_.driven_mass_kg(tissue_mass_kg_);
}

void InertialEquation::set_piece(const Knot& from, const Knot& to) {
  from_ = from;
  to_rise_ = to.value - from.value;
  slope_ = (to.value - from.value) / (to.time_s - from.time_s);
}

double InertialEquation::imposed(double time_s) const {
  return from_.value + slope_ * (time_s - from_.time_s);
}

double InertialEquation::imposed_speed() const {
  return tissue_.depth_driven() ? slope_ * tissue_.path().slope(0, within_piece()) : 0.0;
}

Eigen::Matrix3Xd InertialEquation::imposed_velocity() const {
  Eigen::Matrix3Xd velocity = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  tissue_.add_imposed_velocity(within_piece(), slope_, velocity);
  return velocity;
}

InertialEquation::Vector InertialEquation::pack(const Positions& position,
                                                const Eigen::MatrixXd& viscous) const {
  Vector state = Vector::Zero(size());
  Spheres displacement(state.data(), 3, rest_.cols());
  displacement = position - rest_;
  tissue_.constraints().project(displacement);
  for (const std::size_t bond : relaxing_) {
    const auto count = static_cast<Eigen::Index>(branches_of(bond).size());
    state.segment(viscous_of_[bond], count) =
        viscous.row(static_cast<Eigen::Index>(bond)).head(count).transpose();
  }
  return state;
}

const TissueMotion& InertialEquation::unpack(double time_s, const ConstVector& state) {
  const Eigen::Index n = rest_.cols();
  motion_.position = rest_ + ConstSpheres(state.data(), 3, n);
  motion_.velocity = ConstSpheres(state.data() + coordinates(), 3, n);
  tissue_.impose(motion_.position, imposed(time_s));
  tissue_.add_imposed_velocity(within_piece(), slope_, motion_.velocity);
  for (const std::size_t bond : relaxing_) {
    const auto row = static_cast<Eigen::Index>(bond);
    Eigen::Index j = 0;
    double mean = 0.0;
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      motion_.viscous(row, j) = state[viscous_of_[bond] + j];
      mean += branch.share * motion_.viscous(row, j++);
    }
    motion_.mean[row] = mean;
  }
  return motion_;
}

Eigen::Vector3d InertialEquation::along(std::size_t bond, const Positions& position,
                                        double& length) const {
  const BondSystem& bonds = tissue_.bonds();
  if (bond >= bonds.first_contact()) {
    if (const auto& normal = bonds.contacts()[bond - bonds.first_contact()].normal) {
      length = std::numeric_limits<double>::infinity();
      return *normal;
    }
  }
  const Eigen::Vector3d apart =
      position.col(bonds.end_b()[bond]) - position.col(bonds.end_a()[bond]);
  length = apart.norm();
  return apart / length;
}

InertialEquation::Gap InertialEquation::gap(std::size_t contact) const {
  const BondSystem& bonds = tissue_.bonds();
  const ToolContact& pair = bonds.contacts()[contact];
  double length = 0.0;
  Gap gap;
  gap.normal = along(bonds.first_contact() + contact, motion_.position, length);
  gap.now_m =
      contact_gap_m(pair, motion_.position.col(pair.sphere), motion_.position.col(pair.tool));
  gap.rate_m_s =
      gap.normal.dot(motion_.velocity.col(pair.tool) - motion_.velocity.col(pair.sphere));
  return gap;
}

void InertialEquation::find_pressing() {
  const auto& contacts = tissue_.bonds().contacts();
  pressing_.assign(contacts.size(), 0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Gap measured = gap(i);
    const double pull = contacts[i].stiffness_N_per_m * measured.now_m +
                        contact_dashpot_N_s_m_[static_cast<Eigen::Index>(i)] * measured.rate_m_s;
    pressing_[i] = measured.now_m <= kTouching_m && pull <= 0.0 ? 1 : 0;
  }
}

double InertialEquation::dashpot_N_s_m(std::size_t bond) const {
  const std::size_t first = tissue_.bonds().first_contact();
  if (bond >= first) {
    return pressing_[bond - first] != 0
               ? contact_dashpot_N_s_m_[static_cast<Eigen::Index>(bond - first)]
               : 0.0;
  }
  return inertia_.dashpot_N_s_m.size() > 0 ? inertia_.dashpot_N_s_m[static_cast<Eigen::Index>(bond)]
                                           : 0.0;
}

void InertialEquation::add_contact_dashpot_forces(const Positions& position,
                                                  const Eigen::Matrix3Xd& velocity,
                                                  std::span<const char> pressing,
                                                  Eigen::Matrix3Xd& force) const {
  const BondSystem& bonds = tissue_.bonds();
  for (std::size_t i = 0; i < pressing.size(); ++i) {
    if (pressing[i] == 0) continue;
    const ToolContact& pair = bonds.contacts()[i];
    double length = 0.0;
    const Eigen::Vector3d n = along(bonds.first_contact() + i, position, length);
    const Eigen::Vector3d f = contact_dashpot_N_s_m_[static_cast<Eigen::Index>(i)] *
                              n.dot(velocity.col(pair.tool) - velocity.col(pair.sphere)) * n;
    force.col(pair.sphere) += f;
    force.col(pair.tool) -= f;
  }
}

void InertialEquation::add_dashpot_forces(const Positions& position,
                                          const Eigen::Matrix3Xd& velocity,
                                          Eigen::Matrix3Xd& force) const {
  const BondSystem& bonds = tissue_.bonds();
  for (Eigen::Index i = 0; i < inertia_.dashpot_N_s_m.size(); ++i) {
    const std::uint32_t a = bonds.end_a()[static_cast<std::size_t>(i)];
    const std::uint32_t b = bonds.end_b()[static_cast<std::size_t>(i)];
    const Eigen::Vector3d apart = position.col(b) - position.col(a);
    const double lengthening = apart.dot(velocity.col(b) - velocity.col(a)) / apart.squaredNorm();
    const Eigen::Vector3d f = inertia_.dashpot_N_s_m[i] * lengthening * apart;
    force.col(a) += f;
    force.col(b) -= f;
  }
}

void InertialEquation::forces(double time_s, Eigen::Matrix3Xd& force) {
  find_pressing();
  tissue_.load(imposed(time_s), force);
  tissue_.bonds().add_forces(motion_.position, {motion_.mean, 0.0, pressing_}, force);
  add_dashpot_forces(motion_.position, motion_.velocity, force);
  add_contact_dashpot_forces(motion_.position, motion_.velocity, pressing_, force);
}

void InertialEquation::rate(double time_s, const ConstVector& state, Eigen::Ref<Vector> rate) {
  const TissueMotion& now = unpack(time_s, state);
  const Eigen::Index n = rest_.cols();
  forces(time_s, force_);
  Spheres acceleration(rate.data() + coordinates(), 3, n);
  acceleration = force_ * inertia_.mass_kg.cwiseInverse().asDiagonal();
  acceleration -= now.velocity * drag_per_s_.asDiagonal();
  tissue_.constraints().project(acceleration);
  rate.head(coordinates()) = state.segment(coordinates(), coordinates());
  tissue_.bonds().followed(now.position, followed_);
  for (const std::size_t bond : relaxing_) {
    Eigen::Index m = viscous_of_[bond];
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      rate[m] = (followed_[static_cast<Eigen::Index>(bond)] - state[m]) / branch.relaxation_time_s;
      ++m;
    }
  }
}

double InertialEquation::drag_N(std::size_t group) const {
  if (!tissue_.depth_driven(group)) return 0.0;
  const Eigen::Matrix3Xd drag =
      imposed_velocity() * (drag_per_s_.cwiseProduct(tissue_mass_kg_)).asDiagonal();
  return -tissue_.response(motion_.position, drag, group);
}

double InertialEquation::drag_on_driven_sphere_N() const {
  return inertia_.drag_per_s * driven_sphere_mass_kg() * imposed_speed();
}

double InertialEquation::response(double time_s, const ConstVector& state, std::size_t group) {
  const TissueMotion& now = unpack(time_s, state);
  if (tissue_.depth_driven(group)) forces(time_s, force_);
  return tissue_.response(now.position, force_, group) +
         (group == 0 ? drag_on_driven_sphere_N() : drag_N(group));
}

void InertialEquation::gaps(double time_s, const ConstVector& state, Eigen::Ref<Vector> gap) {
  const TissueMotion& now = unpack(time_s, state);
  const auto& contacts = tissue_.bonds().contacts();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    gap[static_cast<Eigen::Index>(i)] = contact_gap_m(
        contacts[i], now.position.col(contacts[i].sphere), now.position.col(contacts[i].tool));
  }
}

bool InertialEquation::meets(double time_s, const ConstVector& state) {
  (void)unpack(time_s, state);
  for (std::size_t i = 0; i < tissue_.bonds().contact_count(); ++i) {
    const Gap measured = gap(i);
    if (std::abs(measured.now_m) <= kTouching_m && measured.rate_m_s < 0.0) return true;
  }
  return false;
}

InertialEquation::Vector InertialEquation::contact_pushes_N(double time_s,
                                                            const ConstVector& state) {
  (void)unpack(time_s, state);
  find_pressing();
  const auto& contacts = tissue_.bonds().contacts();
  Vector push = Vector::Zero(std::ssize(contacts));
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (pressing_[i] == 0) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const Gap measured = gap(i);
    push[row] = -contacts[i].stiffness_N_per_m * measured.now_m -
                contact_dashpot_N_s_m_[row] * measured.rate_m_s;
  }
  return push;
}

double InertialEquation::settling_time_s() const {
  constexpr double kSettled = 20.0;  // (1 + 20) exp(-20) = 4e-8
  double longest_s = 0.0;
  for (const ToolContact& contact : tissue_.bonds().contacts()) {
    const double per_mass = inverse_mass_per_kg(tissue_, inertia_, contact);
    if (!(per_mass > 0.0)) continue;
    longest_s = std::max(longest_s, kSettled / std::sqrt(contact.stiffness_N_per_m * per_mass));
  }
  return longest_s;
}

ToolImpact InertialEquation::strike(double time_s, Eigen::Ref<Vector> state) {
  const double before_J = kinetic_J(time_s, state);  // unpacks
  const auto& contacts = tissue_.bonds().contacts();
  std::vector<TouchingPair> pairs;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Gap measured = gap(i);
    if (measured.now_m <= kTouching_m)
      pairs.push_back({contacts[i].sphere, contacts[i].tool, measured.normal});
  }
  Eigen::Matrix3Xd velocity = motion_.velocity;
  const Vector impulse = inelastic_impact(pairs, tissue_.constraints(), inertia_.mass_kg, velocity);
  Eigen::Matrix3Xd on_tools = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    on_tools.col(pairs[i].tool) += impulse[static_cast<Eigen::Index>(i)] * pairs[i].normal;
  }
  Spheres free_velocity(state.data() + coordinates(), 3, rest_.cols());
  free_velocity = velocity;
  tissue_.constraints().project(free_velocity);
  ToolImpact impact;
  impact.on_tissue_N_s = tissue_.push_on_tissue(on_tools);
  impact.work_J = tissue_.power_on_tissue(on_tools, within_piece(), slope_);
  impact.lost_J = impact.work_J + before_J - kinetic_J(time_s, state);
  return impact;
}

Eigen::Vector4d InertialEquation::powers_W(double time_s, const ConstVector& state) {
  const double answer = response(time_s, state);  // unpacks
  const TissueMotion& now = motion_;
  double work = 0.0;
  for (std::size_t g = 0; g < tissue_.groups(); ++g) {
    const double of_group = g == 0 ? answer : tissue_.response(now.position, force_, g) + drag_N(g);
    work += tissue_.depth_of(now.velocity, g) *
            (tissue_.depth_driven(g) ? of_group : tissue_.path().value(g, imposed(time_s)));
  }
  force_.setZero();
  add_dashpot_forces(now.position, now.velocity, force_);
  const double dashpots = -force_.cwiseProduct(now.velocity).sum();
  const double drag = now.velocity.colwise().squaredNorm().dot(
      inertia_.mass_kg.cwiseProduct(drag_per_s_).transpose());
  // A contact takes N dl/dt and keeps k l dl/dt of it, l < 0 its gap; N is 0 where it would pull.
  double contacts = 0.0;
  for (std::size_t i = 0; i < pressing_.size(); ++i) {
    const Gap measured = gap(i);
    if (measured.now_m > kTouching_m) continue;
    contacts += pressing_[i] != 0 ? contact_dashpot_N_s_m_[static_cast<Eigen::Index>(i)] *
                                        measured.rate_m_s * measured.rate_m_s
                                  : -tissue_.bonds().contacts()[i].stiffness_N_per_m *
                                        measured.now_m * measured.rate_m_s;
  }
  return {work, tissue_.bonds().dissipation_W(now.position, now.viscous), dashpots + drag,
          contacts};
}

double InertialEquation::kinetic_J(double time_s, const ConstVector& state) {
  return 0.5 *
         unpack(time_s, state).velocity.colwise().squaredNorm().dot(inertia_.mass_kg.transpose());
}

double InertialEquation::stored_J(double time_s, const ConstVector& state) {
  const TissueMotion& now = unpack(time_s, state);
  return tissue_.bonds().stored_energy_J(now.position, now.viscous) +
         tissue_.dead_energy_J(now.position);
}

bool InertialEquation::factorise(double time_s, const ConstVector& state, double gamma) {
  const BondSystem& bonds = tissue_.bonds();
  const TissueMotion& now = unpack(time_s, state);
  gamma_ = gamma;
  factorised_at_ = now.position;
  bonds.kernel_slopes(now.position, kernel_slope_);
  bonds.followed(now.position, followed_);
  find_pressing();
  factorised_pressing_ = pressing_;
  matrix_.set_zero();
  bonds.add_stiffness(
      now.position,
      bonds.viscous_state_at(now.mean, followed_, relaxation_factor_over(bonds, gamma),
                             factorised_pressing_),
      matrix_);
  for (Eigen::Matrix3d& block : matrix_.diagonal) block *= gamma * gamma;
  for (Eigen::Matrix3d& block : matrix_.below) block *= gamma * gamma;
  const bool bonds_damped = inertia_.dashpot_N_s_m.size() > 0;
  for (std::size_t bond = bonds_damped ? 0 : bonds.first_contact(); bond < bonds.size(); ++bond) {
    const double dashpot = dashpot_N_s_m(bond);
    if (dashpot == 0.0) continue;
    double length = 0.0;
    const Eigen::Vector3d n = along(bond, now.position, length);
    const Eigen::Matrix3d block = gamma * dashpot * n * n.transpose();
    matrix_.diagonal[bonds.end_a()[bond]] += block;
    matrix_.diagonal[bonds.end_b()[bond]] += block;
    matrix_.below[bonds.place(bond).index] -= block;
  }
  for (std::size_t i = 0; i < matrix_.diagonal.size(); ++i) {
    matrix_.diagonal[i].diagonal().array() +=
        inertia_.mass_kg[static_cast<Eigen::Index>(i)] *
        (1.0 + gamma * drag_per_s_[static_cast<Eigen::Index>(i)]);
  }
  tissue_.constraints().constrain(bonds, matrix_);
  return factor_.factorise(matrix_);
}

void InertialEquation::solve(Eigen::Ref<Vector> x) {
  // (1 - gamma J)(du, dv, dm_j) = (ru, rv, r_j), V' the slope of the kernel, B that of l by u:
  //   du = ru + gamma dv,   dm_j = (r_j + gamma/tau_j V' B du)/(1 + gamma/tau_j),
  //   [M (1 + gamma alpha) + gamma C + gamma^2 K] du
  //     = [M (1 + gamma alpha) + gamma C] ru + gamma M rv
  //       + gamma^2 B' g sum_j gamma_j r_j/(1 + gamma/tau_j).
  const BondSystem& bonds = tissue_.bonds();
  const Eigen::Index n = rest_.cols();
  Spheres u(x.data(), 3, n);
  Spheres v(x.data() + coordinates(), 3, n);
  force_.setZero(3, n);
  add_dashpot_forces(factorised_at_, u, force_);  // -C ru
  add_contact_dashpot_forces(factorised_at_, u, factorised_pressing_, force_);
  Eigen::Matrix3Xd right = -gamma_ * force_;
  right += (u + gamma_ * (u * drag_per_s_.asDiagonal() + v)) * inertia_.mass_kg.asDiagonal();
  for (const std::size_t bond : relaxing_) {
    const std::uint32_t a = bonds.end_a()[bond];
    const std::uint32_t b = bonds.end_b()[bond];
    double known = 0.0;
    Eigen::Index m = viscous_of_[bond];
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      known += branch.share * x[m++] / (1.0 + gamma_ / branch.relaxation_time_s);
    }
    const double pull = gamma_ * gamma_ * bonds.relaxing()[static_cast<Eigen::Index>(bond)] * known;
    const Eigen::Vector3d f = pull * (factorised_at_.col(b) - factorised_at_.col(a)).normalized();
    right.col(a) -= f;
    right.col(b) += f;
  }
  tissue_.constraints().project(right);
  factor_.solve(right);
  tissue_.constraints().project(right);
  v = (right - u) / gamma_;
  u = right;
  bonds.elongation_changes(factorised_at_, right, followed_);
  for (const std::size_t bond : relaxing_) {
    const auto row = static_cast<Eigen::Index>(bond);
    const double change = kernel_slope_[row] * followed_[row];
    Eigen::Index m = viscous_of_[bond];
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      const double ratio = gamma_ / branch.relaxation_time_s;
      x[m] = (x[m] + ratio * change) / (1.0 + ratio);
      ++m;
    }
  }
}

}  // namespace tpm::organ
