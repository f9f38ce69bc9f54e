#include "tpm/contact/servo_stiffness.hpp"

namespace tpm::contact {

ServoStiffness::ServoStiffness(const BondSystem& bonds, const Constraints& constraints)
    : column_(bonds.spheres(), 0) {
  std::vector<std::uint32_t> rank(bonds.spheres(), 0);
  std::vector<char> moves(bonds.spheres(), 0);
  for (std::size_t i = 0; i < bonds.spheres(); ++i) {
    if (constraints.projector(i).isZero(0.0)) continue;
    moves[i] = 1;
    rank[i] = static_cast<std::uint32_t>(free_.size());
    free_.push_back(i);
  }
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    if (moves[from] != 0 && moves[to] != 0) edges_.push_back({rank[from], rank[to]});
  }
  fronts_ = std::make_shared<const EliminationFronts>(free_.size(), edges_);
  auto next = static_cast<std::uint32_t>(free_.size());
  for (std::size_t i = 0; i < bonds.spheres(); ++i) {
    column_[i] = moves[i] != 0 ? fronts_->place()[rank[i]] : next++;
    if (moves[i] == 0 || constraints.is_free(i)) continue;
    partly_.push_back({column_[i], constraints.projector(i).cast<float>()});
  }
}

bool ServoStiffness::factorise(const BondSystem& bonds, const Constraints& constraints,
                               const Positions& position, const ViscousState& viscous_state,
                               bool portable) {
  std::vector<Eigen::Matrix3d> diagonal(column_.size(), Eigen::Matrix3d::Zero());
  std::vector<Eigen::Matrix3d> across;
  for (std::size_t b = 0; b < bonds.size(); ++b) {
    const std::uint32_t from = bonds.end_a()[b];
    const std::uint32_t to = bonds.end_b()[b];
    const Eigen::Matrix3d block = bonds.stiffness_block(b, position, viscous_state);
    diagonal[from] += block;
    diagonal[to] += block;
    if (!moves(from) || !moves(to)) continue;
    across.emplace_back(-constraints.projector(from) * block * constraints.projector(to));
  }
  std::vector<Eigen::Matrix3d> of_free;
  for (const std::size_t i : free_) {
    const Eigen::Matrix3d& p = constraints.projector(i);
    of_free.emplace_back(p * diagonal[i] * p +
                         diagonal[i].trace() * (Eigen::Matrix3d::Identity() - p));
  }
  factor_ = std::make_unique<FrontalFactor>(fronts_, portable);
  return factor_->factorise(of_free, edges_, across);
}

void ServoStiffness::project(float* four_per_sphere) const noexcept {
  for (const Partly& partly : partly_) {
    Eigen::Map<Eigen::Vector3f> v(four_per_sphere + 4 * partly.column);
    v = (partly.projector * v).eval();
  }
}

void ServoStiffness::solve(float* four_per_sphere) noexcept {
  project(four_per_sphere);
  factor_->solve(four_per_sphere);
  project(four_per_sphere);
}

}  // namespace tpm::contact
