#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// Two points nearer to each other than a support radius; first < second.
struct NeighbourPair {
  std::size_t first = 0;
  std::size_t second = 0;
  bool operator==(const NeighbourPair&) const = default;
};

/// All pairs of points at a distance of at most `radius`, sorted by first and then second; found
/// with a grid of cubes in O(n log n) for a bounded number of neighbours.
/// @param points one finite point per column, m
/// @param radius m, finite, above 0; Error(bad_input) otherwise
[[nodiscard]] std::vector<NeighbourPair> pairs_within(const Positions& points, double radius);

/// Pairs of points that move a little between one question and the next: a list that reaches a
/// little farther serves until a point has moved through half of the difference (Verlet 1967).
class NearPairs {
 public:
  /// @param reach m, finite, above 0
  explicit NearPairs(double reach) : reach_(reach) {}

  /// As pairs_within(points, reach), and perhaps some that are farther apart.
  const std::vector<NeighbourPair>& of(const Positions& points);

 private:
  double reach_;
  Positions points_;  ///< when the list was made
  std::vector<NeighbourPair> pairs_;
};

/// For every point the distance to the nearest other one, m. At least two points.
[[nodiscard]] std::vector<double> distances_to_nearest(const Positions& points);

}  // namespace tpm::organ
