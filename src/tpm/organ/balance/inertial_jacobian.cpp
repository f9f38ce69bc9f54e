// Declared in tpm/organ/balance/inertial_equation.hpp.
// The sparse Jacobian of the equations of motion.
#include "tpm/organ/balance/inertial_equation.hpp"

namespace tpm::organ {
namespace {

using Triplets = std::vector<Eigen::Triplet<double, std::int64_t>>;

void add_block(Triplets& entries, Eigen::Index row, Eigen::Index column,
               const Eigen::Matrix3d& block) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) entries.emplace_back(row + i, column + j, block(i, j));
  }
}

}  // namespace

void InertialEquation::add_bond_entries(Triplets& entries, std::size_t bond,
                                        const BlockMatrix& stiffness) const {
  const BondSystem& bonds = tissue_.bonds();
  const auto row = static_cast<Eigen::Index>(bond);
  const std::uint32_t a = bonds.end_a()[bond];
  const std::uint32_t b = bonds.end_b()[bond];
  double length = 0.0;
  const Eigen::Vector3d n = along(bond, motion_.position, length);
  Eigen::Matrix3d across = stiffness.below[bonds.place(bond).index];  // d f / d x of the other end
  across *= -1.0;
  // The same entries whether a contact presses or not.
  const bool damped = inertia_.dashpot_N_s_m.size() > 0 || bond >= bonds.first_contact();
  Eigen::Matrix3d damping = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d turning = Eigen::Matrix3d::Zero();
  if (damped) {
    const double c = dashpot_N_s_m(bond);
    const Eigen::Vector3d apart = motion_.velocity.col(b) - motion_.velocity.col(a);
    const double lengthening = n.dot(apart);
    damping = c * n * n.transpose();
    turning = c / length *
              (n * (apart - lengthening * n).transpose() +
               lengthening * (Eigen::Matrix3d::Identity() - n * n.transpose()));
  }
  const auto end = [&](std::uint32_t here, std::uint32_t there, double sign) {
    const Eigen::Matrix3d p = tissue_.constraints().projector(here) / inertia_.mass_kg[here];
    const Eigen::Index u = 3 * Eigen::Index{here};
    const Eigen::Index u_there = 3 * Eigen::Index{there};
    const Eigen::Index v = coordinates() + u;
    add_block(entries, v, u_there, p * (across + turning));
    if (damped) {
      add_block(entries, v, u, -(p * turning));
      add_block(entries, v, coordinates() + u_there, p * damping);
      add_block(entries, v, v, -(p * damping));
    }
    Eigen::Index m = viscous_of_[bond];
    if (m < 0) return;
    const Eigen::Vector3d pull = sign * bonds.relaxing()[row] * (p * n);
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      for (Eigen::Index i = 0; i < 3; ++i) {
        entries.emplace_back(v + i, m, -branch.share * pull[i]);
        entries.emplace_back(m, u + i,
                             -sign * kernel_slope_[row] * n[i] / branch.relaxation_time_s);
      }
      ++m;
    }
  };
  end(a, b, 1.0);
  end(b, a, -1.0);
}

InertialEquation::Sparse InertialEquation::jacobian(double time_s, const ConstVector& state) {
  const BondSystem& bonds = tissue_.bonds();
  const TissueMotion& now = unpack(time_s, state);
  BlockMatrix stiffness(bonds.pattern());
  find_pressing();
  bonds.add_stiffness(now.position, {now.mean, 0.0, pressing_}, stiffness);
  bonds.kernel_slopes(now.position, kernel_slope_);
  Triplets entries;
  for (Eigen::Index i = 0; i < coordinates(); ++i) {
    entries.emplace_back(i, i, 0.0);
    entries.emplace_back(i, coordinates() + i, 1.0);
  }
  for (Eigen::Index i = 0; i < rest_.cols(); ++i) {
    const auto sphere = static_cast<std::size_t>(i);
    const Eigen::Matrix3d& p = tissue_.constraints().projector(sphere);
    const Eigen::Index v = coordinates() + 3 * i;
    add_block(entries, v, 3 * i, p / -inertia_.mass_kg[i] * stiffness.diagonal[sphere]);
    add_block(entries, v, v, -drag_per_s_[i] * p);
  }
  for (std::size_t bond = 0; bond < bonds.size(); ++bond) {
    add_bond_entries(entries, bond, stiffness);
    Eigen::Index m = viscous_of_[bond];
    if (m < 0) continue;
    for (const ViscousLaw::Branch& branch : branches_of(bond)) {
      entries.emplace_back(m, m, -1.0 / branch.relaxation_time_s);
      ++m;
    }
  }
  Sparse matrix(size(), size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace tpm::organ
