#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

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

  /// Numbers by cell, in one vector: a cell that is taken is looked for in the slots after its own.
  class Table {
   public:
    /// That of a cell, or none.
    [[nodiscard]] const std::uint32_t* find(std::uint64_t cell) const;
    void set(std::uint64_t cell, std::uint32_t number);

   private:
    struct Slot {
      std::uint64_t cell = kNoCell;
      std::uint32_t number = 0;
    };
    static constexpr std::uint64_t kNoCell = ~std::uint64_t{0};  // cells have 63 bits

    /// Where a cell stands, or would.
    [[nodiscard]] std::size_t slot_of(std::uint64_t cell) const;
    void grow();

    std::vector<Slot> slots_;  ///< a power of two of them, at most half of them taken
    std::size_t taken_ = 0;
    int shift_ = 0;
  };
  using Cells = std::array<std::uint64_t, kGrids>;

  /// The cell of a point in each grid, the coarsest first; each next one is half as wide.
  [[nodiscard]] Cells cells_of(const Eigen::Vector3d& point) const;

  const Surface& surface_;
  Eigen::Vector3d corner_;
  double rounding_;
  double finest_;  ///< cell, m
  std::vector<Asked> asked_;
  std::array<Table, kGrids> last_;  ///< the last that was asked in each cell of a grid
};

}  // namespace tpm::organ
