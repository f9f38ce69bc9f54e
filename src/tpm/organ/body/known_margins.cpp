#include "tpm/organ/body/known_margins.hpp"

#include <cmath>

namespace tpm::organ {

namespace {

constexpr double kCoarsest = 2.0;  // cells, in spacings; each next grid is half as wide
constexpr double kRoundingOfSpacing = 1e-9;

}  // namespace

KnownMargins::KnownMargins(const Surface& surface, double spacing)
    : surface_(surface), corner_(surface.bounds().min()), rounding_(kRoundingOfSpacing * spacing) {
  double cell = kCoarsest * spacing;
  for (Grid& grid : grids_) {
    grid.cell = cell;
    cell *= 0.5;
  }
}

std::uint64_t KnownMargins::cell_of(const Grid& grid, const Eigen::Vector3d& point) const {
  constexpr int kBits = 21;
  constexpr std::int64_t kMiddle = std::int64_t{1} << (kBits - 1);
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  std::uint64_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at =
        static_cast<std::int64_t>(std::floor((point[axis] - corner_[axis]) / grid.cell));
    cell = (cell << kBits) | (static_cast<std::uint64_t>(at + kMiddle) & kMask);
  }
  return cell;
}

double KnownMargins::margin(const Eigen::Vector3d& point, double least) {
  for (const Grid& grid : grids_) {
    const auto found = grid.asked.find(cell_of(grid, point));
    if (found == grid.asked.end()) break;  // nor in a finer one
    const double margin = found->second.depth - least;
    const double sure = std::abs(margin) - (found->second.point - point).norm() - rounding_;
    if (sure > 0.0) return std::copysign(sure, margin);
  }
  const Asked asked{point, -surface_.signed_distance(point)};
  for (Grid& grid : grids_) grid.asked.insert_or_assign(cell_of(grid, point), asked);
  return asked.depth - least;
}

}  // namespace tpm::organ
