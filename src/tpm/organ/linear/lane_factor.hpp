#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "tpm/organ/linear/block_ldlt.hpp"
#include "tpm/organ/linear/lanes.hpp"

namespace tpm::organ {

/// Three coordinates of a node, one number per lane, in vectors of the processor (g++ and clang).
struct alignas(kLanes * sizeof(float)) LaneNode {
  using Floats [[gnu::vector_size(kLanes * sizeof(float))]] = float;
  Floats x, y, z;
};

/// A copy of a factorisation in single precision, which solves for all lanes at once: to correct
/// iterates whose residual is found in double precision. solve() allocates nothing.
class LaneFactor {
 public:
  /// @param pattern must live as long as this
  explicit LaneFactor(const BlockPattern& pattern);

  /// @param factor of a matrix on the same pattern, factorised
  void copy(const BlockLdlt& factor);

  /// Replaces the right-hand sides, three columns per node, by the solutions, to about 1e-5 of
  /// them for matrices that are not near singular.
  void solve(LaneMatrix& x);

 private:
  using Block = std::array<float, 9>;  ///< by rows

  const BlockPattern& pattern_;
  /// L front by front, in each row by row: of its own nodes what is left of the diagonal.
  std::vector<Block> lower_;
  std::vector<Block> inverse_;  ///< by place
  std::vector<LaneNode> y_;     ///< by place
};

}  // namespace tpm::organ
