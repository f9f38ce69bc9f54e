#include "tpm/organ/body/known_margins.hpp"

#include <cmath>

namespace tpm::organ {

namespace {

constexpr double kCoarsest = 2.0;  // cells, in spacings; each next grid is half as wide
constexpr double kRoundingOfSpacing = 1e-9;

}  // namespace

KnownMargins::KnownMargins(const Surface& surface, double spacing)
    : surface_(surface),
      corner_(surface.bounds().min()),
      rounding_(kRoundingOfSpacing * spacing),
      finest_(kCoarsest * spacing / static_cast<double>(1 << (kGrids - 1))) {}

KnownMargins::Cells KnownMargins::cells_of(const Eigen::Vector3d& point) const {
  constexpr int kBits = 21;
  constexpr std::int64_t kMiddle = std::int64_t{1} << (kBits - 1);
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  Cells cells{};
  for (int axis = 0; axis < 3; ++axis) {
    auto at = static_cast<std::int64_t>(std::floor((point[axis] - corner_[axis]) / finest_));
    for (std::size_t grid = kGrids; grid-- > 0; at >>= 1) {
      cells[grid] = (cells[grid] << kBits) | (static_cast<std::uint64_t>(at + kMiddle) & kMask);
    }
  }
  return cells;
}

double KnownMargins::margin(const Eigen::Vector3d& point, double least) {
  const Cells cells = cells_of(point);
  for (std::size_t grid = 0; grid < kGrids; ++grid) {
    const auto found = asked_[grid].find(cells[grid]);
    if (found == asked_[grid].end()) break;  // nor in a finer one
    const double margin = found->second.depth - least;
    const double sure = std::abs(margin) - (found->second.point - point).norm() - rounding_;
    if (sure > 0.0) return std::copysign(sure, margin);
  }
  const Asked asked{point, -surface_.signed_distance(point)};
  for (std::size_t grid = 0; grid < kGrids; ++grid)
    asked_[grid].insert_or_assign(cells[grid], asked);
  return asked.depth - least;
}

}  // namespace tpm::organ
