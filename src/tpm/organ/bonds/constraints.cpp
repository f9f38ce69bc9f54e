#include "tpm/organ/bonds/constraints.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::organ {

Constraints::Constraints(std::size_t spheres)
    : state_(spheres, State::free), projector_(spheres, Eigen::Matrix3d::Identity()) {}

Constraints Constraints::extended(std::size_t more) const {
  Constraints all = *this;
  all.state_.resize(size() + more, State::free);
  all.projector_.resize(size() + more, Eigen::Matrix3d::Identity());
  return all;
}

Constraints Constraints::first(std::size_t spheres) const {
  Constraints some(spheres);
  std::copy_n(state_.begin(), spheres, some.state_.begin());
  std::copy_n(projector_.begin(), spheres, some.projector_.begin());
  return some;
}

void Constraints::fix(std::size_t sphere) {
  state_.at(sphere) = State::fixed;
  projector_[sphere].setZero();
}

void Constraints::slide(std::size_t sphere, const Eigen::Vector3d& direction) {
  state_.at(sphere) = State::partly;
  projector_[sphere] = direction * direction.transpose();
}

void Constraints::impose(std::size_t sphere, const Eigen::Vector3d& direction) {
  Eigen::Matrix3d& p = projector_.at(sphere);
  const Eigen::Vector3d free = p * direction;
  const double part = free.norm();
  if (part > 0.0) p -= free * free.transpose() / (part * part);
  // Rounding of a direction that is gone would become a soft one.
  const bool held = p.trace() < 0.5;
  if (held) p.setZero();
  state_[sphere] = held ? State::fixed : State::partly;
}

std::size_t Constraints::count() const {
  double sum = 0.0;
  for (const Eigen::Matrix3d& p : projector_) sum += p.trace();
  return static_cast<std::size_t>(std::lround(sum));
}

void Constraints::project(Eigen::Ref<Eigen::Matrix3Xd> vectors) const {
  for (std::size_t i = 0; i < size(); ++i) {
    if (state_[i] == State::free) continue;
    const auto column = static_cast<Eigen::Index>(i);
    vectors.col(column) = (projector_[i] * vectors.col(column)).eval();
  }
}

void Constraints::project(LaneMatrix& vectors) const {
  for (std::size_t i = 0; i < size(); ++i) {
    if (state_[i] == State::free) continue;
    auto of_sphere = vectors.middleCols<3>(3 * static_cast<Eigen::Index>(i));
    if (state_[i] == State::fixed) {
      of_sphere.setZero();
    } else {
      of_sphere = (of_sphere * projector_[i]).eval();
    }
  }
}

void Constraints::constrain(const BondSystem& bonds, BlockMatrix& matrix) const {
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const std::uint32_t a = bonds.end_a()[i];
    const std::uint32_t b = bonds.end_b()[i];
    if (is_free(a) && is_free(b)) continue;
    const auto [index, transposed] = bonds.place(i);
    const std::uint32_t row = transposed ? b : a;
    const std::uint32_t column = transposed ? a : b;
    Eigen::Matrix3d& block = matrix.below[index];
    block = (projector_[row] * block * projector_[column]).eval();
  }
  for (std::size_t i = 0; i < size(); ++i) {
    if (is_free(i)) continue;
    Eigen::Matrix3d& block = matrix.diagonal[i];
    const double scale = block.trace() > 0.0 ? block.trace() : 1.0;
    block = (projector_[i] * block * projector_[i]).eval() +
            scale * (Eigen::Matrix3d::Identity() - projector_[i]);
  }
}

}  // namespace tpm::organ
