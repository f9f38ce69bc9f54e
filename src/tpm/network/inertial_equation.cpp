#include "tpm/network/inertial_equation.hpp"

namespace tpm {
namespace {

using Spheres = Eigen::Map<Eigen::Matrix3Xd>;
using ConstSpheres = Eigen::Map<const Eigen::Matrix3Xd>;

/// The share of the viscous elongations of each law that follows in an implicit step of size gamma.
Following following_over(const BondSystem& bonds, double gamma) {
  std::vector<double> of_law;
  for (const ViscousLaw& law : bonds.laws()) {
    double share = 0.0;
    for (const ViscousLaw::Branch& branch : law.branches) {
      const double ratio = gamma / branch.relaxation_time_s;
      share += branch.share * ratio / (1.0 + ratio);
    }
    of_law.push_back(share);
  }
  return Following(std::move(of_law));
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
}

Eigen::Index InertialEquation::size() const {
  return size_;
}

double InertialEquation::driven_mass_kg() const {
  return tissue_.driven_mass_kg(inertia_.mass_kg);
}

void InertialEquation::set_piece(const Knot& from, const Knot& to) {
  from_ = from;
  slope_ = (to.value - from.value) / (to.time_s - from.time_s);
}

double InertialEquation::imposed(double time_s) const {
  return from_.value + slope_ * (time_s - from_.time_s);
}

double InertialEquation::imposed_speed() const {
  return tissue_.depth_driven() ? slope_ : 0.0;
}

InertialEquation::Vector InertialEquation::pack(const Positions& position,
                                                const Eigen::MatrixXd& viscous) const {
  Vector state = Vector::Zero(size());
  Spheres displacement(state.data(), 3, rest_.cols());
  displacement = position - rest_;
  tissue_.freedom().project(displacement);
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
  tissue_.add_imposed_velocity(imposed_speed(), motion_.velocity);
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

Eigen::Vector3d InertialEquation::along(std::size_t bond, double& length) const {
  const BondSystem& bonds = tissue_.bonds();
  const Eigen::Vector3d apart =
      motion_.position.col(bonds.end_b()[bond]) - motion_.position.col(bonds.end_a()[bond]);
  length = apart.norm();
  return apart / length;
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

void InertialEquation::forces(double time_s, Eigen::Matrix3Xd& force) const {
  tissue_.load(imposed(time_s), force);
  tissue_.bonds().add_forces(motion_.position, {motion_.mean, 0.0}, force);
  add_dashpot_forces(motion_.position, motion_.velocity, force);
}

void InertialEquation::rate(double time_s, const ConstVector& state, Eigen::Ref<Vector> rate) {
  const TissueMotion& now = unpack(time_s, state);
  const Eigen::Index n = rest_.cols();
  forces(time_s, force_);
  Spheres acceleration(rate.data() + coordinates(), 3, n);
  acceleration = force_ * inertia_.mass_kg.cwiseInverse().asDiagonal();
  acceleration -= inertia_.drag_per_s * now.velocity;
  tissue_.freedom().project(acceleration);
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

double InertialEquation::drag_on_driven_sphere_N() const {
  return inertia_.drag_per_s * driven_mass_kg() * imposed_speed();
}

double InertialEquation::response(double time_s, const ConstVector& state) {
  const TissueMotion& now = unpack(time_s, state);
  forces(time_s, force_);
  return tissue_.response(now.position, force_) + drag_on_driven_sphere_N();
}

Eigen::Vector3d InertialEquation::powers_W(double time_s, const ConstVector& state) {
  const double answer = response(time_s, state);  // unpacks
  const TissueMotion& now = motion_;
  const double speed = tissue_.depth_of(now.velocity);
  const double push = tissue_.depth_driven() ? answer : imposed(time_s);
  force_.setZero();
  add_dashpot_forces(now.position, now.velocity, force_);
  const double dashpots = -force_.cwiseProduct(now.velocity).sum();
  const double drag =
      inertia_.drag_per_s * now.velocity.colwise().squaredNorm().dot(inertia_.mass_kg.transpose());
  return {push * speed, tissue_.bonds().dissipation_W(now.position, now.viscous), dashpots + drag};
}

double InertialEquation::kinetic_J(double time_s, const ConstVector& state) {
  return 0.5 *
         unpack(time_s, state).velocity.colwise().squaredNorm().dot(inertia_.mass_kg.transpose());
}

double InertialEquation::stored_J(double time_s, const ConstVector& state) {
  const TissueMotion& now = unpack(time_s, state);
  return tissue_.bonds().stored_energy_J(now.position, now.viscous);
}

bool InertialEquation::factorise(double time_s, const ConstVector& state, double gamma) {
  const BondSystem& bonds = tissue_.bonds();
  const TissueMotion& now = unpack(time_s, state);
  gamma_ = gamma;
  factorised_at_ = now.position;
  bonds.kernel_slopes(now.position, kernel_slope_);
  bonds.followed(now.position, followed_);
  matrix_.set_zero();
  bonds.add_stiffness(now.position,
                      bonds.memory_at(now.mean, followed_, following_over(bonds, gamma)), matrix_);
  for (Eigen::Matrix3d& block : matrix_.diagonal) block *= gamma * gamma;
  for (Eigen::Matrix3d& block : matrix_.below) block *= gamma * gamma;
  for (Eigen::Index i = 0; i < inertia_.dashpot_N_s_m.size(); ++i) {
    const auto bond = static_cast<std::size_t>(i);
    double length = 0.0;
    const Eigen::Vector3d n = along(bond, length);
    const Eigen::Matrix3d block = gamma * inertia_.dashpot_N_s_m[i] * n * n.transpose();
    matrix_.diagonal[bonds.end_a()[bond]] += block;
    matrix_.diagonal[bonds.end_b()[bond]] += block;
    matrix_.below[bonds.place(bond).index] -= block;
  }
  for (std::size_t i = 0; i < matrix_.diagonal.size(); ++i) {
    matrix_.diagonal[i].diagonal().array() +=
        inertia_.mass_kg[static_cast<Eigen::Index>(i)] * (1.0 + gamma * inertia_.drag_per_s);
  }
  tissue_.freedom().constrain(bonds, matrix_);
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
  Eigen::Matrix3Xd right = -gamma_ * force_;
  right += ((1.0 + gamma_ * inertia_.drag_per_s) * u + gamma_ * v) * inertia_.mass_kg.asDiagonal();
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
  tissue_.freedom().project(right);
  factor_.solve(right);
  tissue_.freedom().project(right);
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

}  // namespace tpm
