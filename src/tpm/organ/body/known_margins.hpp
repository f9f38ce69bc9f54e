#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <unordered_map>

#include "tpm/organ/body/surface.hpp"

namespace tpm::organ {

/// Signed distances to a surface that were asked before, so that whether a point lies deep enough
/// is mostly known from one beside it: the distance changes by at most the way between them.
/// Lattices of nearly the same spacing ask for nearly the same points.
class KnownMargins {
 public:
  /// @param spacing about that of the points, m
  KnownMargins(const Surface& surface, double spacing);

  /// Depth of a point inside beyond `least`, m; above 0 or below as it is, and at most as
  /// far from 0.
  [[nodiscard]] double margin(const Eigen::Vector3d& point, double least);

 private:
  struct Asked {
    Eigen::Vector3d point;
    double depth = 0.0;  ///< below the surface, m
  };
  static constexpr std::size_t kGrids = 4;
  using Cells = std::array<std::uint64_t, kGrids>;

  /// The cell of a point in each grid, the coarsest first; each next one is half as wide.
  [[nodiscard]] Cells cells_of(const Eigen::Vector3d& point) const;

  const Surface& surface_;
  Eigen::Vector3d corner_;
  double rounding_;
  double finest_;  ///< cell, m
  /// The last that was asked in each cell of a grid.
  std::array<std::unordered_map<std::uint64_t, Asked>, kGrids> asked_;
};

}  // namespace tpm::organ
