#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tpm/organ/linear/lane_factor.hpp"

// Matrices for tests of the sparse direct solver, and what is computed of them densely.
namespace tpm::test {

using GraphEdge = std::array<std::uint32_t, 2>;

struct BlockGraph {
  std::string name;
  std::size_t nodes;
  std::vector<GraphEdge> edges;
};

/// Places in a box, joined within a distance: the graph of a tissue.
[[nodiscard]] BlockGraph near_places(std::size_t nodes, double neighbours, std::uint64_t seed);
[[nodiscard]] BlockGraph path_graph(std::uint32_t nodes);
/// All with all: one front of many panels.
[[nodiscard]] BlockGraph complete_graph(std::uint32_t nodes);
/// Of every kind, with 1 to 900 nodes.
[[nodiscard]] std::vector<BlockGraph> block_graphs();

/// A block matrix and the same densely.
struct BlocksAndDense {
  organ::BlockMatrix blocks;
  Eigen::MatrixXd dense;
};

/// Random blocks where the graph has edges; `shift` on the diagonal, against rows that sum up to
/// less: positive definite for a shift above 0.
[[nodiscard]] BlocksAndDense random_blocks(const BlockGraph& graph,
                                           const organ::BlockPattern& pattern, double shift,
                                           std::uint64_t seed);
/// Random blocks that the diagonal outweighs, so that its signs are those of the eigenvalues
/// (Gershgorin): `below_zero` nodes with three below 0.
[[nodiscard]] organ::BlockMatrix outweighed_blocks(const BlockGraph& graph,
                                                   const organ::BlockPattern& pattern,
                                                   std::size_t below_zero, std::uint64_t seed);
[[nodiscard]] Eigen::Matrix3Xd random_side(std::size_t nodes, std::uint64_t seed);
/// Moves the diagonal of both.
void shift_diagonal(BlocksAndDense& pair, double by);

/// |A x - b|
[[nodiscard]] double residual(const Eigen::MatrixXd& a, const Eigen::Matrix3Xd& x,
                              const Eigen::Matrix3Xd& b);
[[nodiscard]] double residual(const BlockGraph& graph, const organ::BlockPattern& pattern,
                              const organ::BlockMatrix& a, const Eigen::Matrix3Xd& x,
                              const Eigen::Matrix3Xd& b);

}  // namespace tpm::test
