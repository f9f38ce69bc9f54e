#include "tpm/organ/bonds/stiffness_rows.hpp"

#include <algorithm>
#include <limits>

namespace tpm::organ {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

bool can_move(const Constraints& constraints, std::size_t sphere) {
  return constraints.is_free(sphere) || !constraints.projector(sphere).isZero(0.0);
}

std::size_t place(const BlockRows<3, 3>& matrix, std::uint32_t row, std::uint32_t column) {
  const auto begin = matrix.column.begin();
  const auto at =
      std::lower_bound(begin + static_cast<std::ptrdiff_t>(matrix.begin[row]),
                       begin + static_cast<std::ptrdiff_t>(matrix.begin[row + 1]), column);
  return static_cast<std::size_t>(at - begin);
}

}  // namespace

StiffnessRows::StiffnessRows(const BondSystem& bonds, const Constraints& constraints)
    : bonds_(bonds), constraints_(constraints), off_diagonal_(bonds.size(), Pair{kNone, kNone}) {
  const std::size_t n = bonds.spheres();
  matrix_.columns = n;
  matrix_.begin.assign(n + 1, 1);  // the diagonal
  matrix_.begin[0] = 0;
  const auto kept = [&](std::size_t bond) {
    return can_move(constraints, bonds.end_a()[bond]) && can_move(constraints, bonds.end_b()[bond]);
  };
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    if (!kept(i)) continue;
    ++matrix_.begin[bonds.end_a()[i] + 1];
    ++matrix_.begin[bonds.end_b()[i] + 1];
  }
  for (std::size_t i = 0; i < n; ++i) matrix_.begin[i + 1] += matrix_.begin[i];
  matrix_.column.resize(matrix_.begin[n]);
  matrix_.block.resize(matrix_.begin[n]);
  std::vector<std::size_t> next(matrix_.begin.begin(), matrix_.begin.end() - 1);
  for (std::uint32_t i = 0; i < n; ++i) matrix_.column[next[i]++] = i;
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    if (!kept(i)) continue;
    matrix_.column[next[bonds.end_a()[i]]++] = bonds.end_b()[i];
    matrix_.column[next[bonds.end_b()[i]]++] = bonds.end_a()[i];
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    std::sort(matrix_.column.begin() + static_cast<std::ptrdiff_t>(matrix_.begin[i]),
              matrix_.column.begin() + static_cast<std::ptrdiff_t>(matrix_.begin[i + 1]));
    diagonal_.push_back(place(matrix_, i, i));
  }
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const std::uint32_t a = bonds.end_a()[i];
    const std::uint32_t b = bonds.end_b()[i];
    if (kept(i)) off_diagonal_[i] = {place(matrix_, a, b), place(matrix_, b, a)};
  }
}

const BlockRows<3, 3>& StiffnessRows::assemble(const Positions& position,
                                               const ViscousState& viscous_state) {
  std::fill(matrix_.block.begin(), matrix_.block.end(), Eigen::Matrix3d::Zero());
  for (std::size_t i = 0; i < bonds_.size(); ++i) {
    const Eigen::Matrix3d block = bonds_.stiffness_block(i, position, viscous_state);
    matrix_.block[diagonal_[bonds_.end_a()[i]]] += block;
    matrix_.block[diagonal_[bonds_.end_b()[i]]] += block;
    if (off_diagonal_[i].ab == kNone) continue;
    matrix_.block[off_diagonal_[i].ab] -= block;
    matrix_.block[off_diagonal_[i].ba] -= block;
  }
  constrain();
  return matrix_;
}

void StiffnessRows::constrain() {
  for (std::size_t i = 0; i < matrix_.rows(); ++i) {
    for (std::size_t p = matrix_.begin[i]; p < matrix_.begin[i + 1]; ++p) {
      const std::uint32_t j = matrix_.column[p];
      if (constraints_.is_free(i) && constraints_.is_free(j)) continue;
      Eigen::Matrix3d& block = matrix_.block[p];
      const double trace = block.trace();
      block = (constraints_.projector(i) * block * constraints_.projector(j)).eval();
      if (i != j) continue;
      block +=
          (trace > 0.0 ? trace : 1.0) * (Eigen::Matrix3d::Identity() - constraints_.projector(i));
    }
  }
}

}  // namespace tpm::organ
