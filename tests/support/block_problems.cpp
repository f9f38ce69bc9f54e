// Optimised: without that the matrices take longer to make than to solve.
#include "block_problems.hpp"

#include <cmath>
#include <set>

#include "tpm/base/random.hpp"

namespace tpm::test {
using base::Random;
using organ::BlockMatrix;
using organ::BlockPattern;

namespace {

BlockGraph random_edges(std::size_t nodes, std::size_t edges, std::uint64_t seed) {
  Random random(seed);
  BlockGraph graph{"random edges", nodes, {}};
  while (graph.edges.size() < edges) {
    const auto a = static_cast<std::uint32_t>(random.below(nodes));
    const auto b = static_cast<std::uint32_t>(random.below(nodes));
    if (a != b) graph.edges.push_back({a, b});  // now and then a pair that is there already
  }
  return graph;
}

/// One node that all others are joined to: a tool and what it touches.
BlockGraph star_graph(std::uint32_t nodes) {
  BlockGraph graph{"star", nodes, {}};
  for (std::uint32_t i = 0; i < nodes; ++i) {
    if (i != nodes / 2) graph.edges.push_back({nodes / 2, i});
  }
  return graph;
}

Eigen::Matrix3d random_block(Random& random) {
  Eigen::Matrix3d block;
  for (double& x : block.reshaped()) x = random.normal();
  return block;
}

Eigen::Matrix3Xd times(const BlockGraph& graph, const BlockPattern& pattern,
                       const BlockMatrix& matrix, const Eigen::Matrix3Xd& x) {
  Eigen::Matrix3Xd y(3, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    y.col(i) = matrix.diagonal[static_cast<std::size_t>(i)] * x.col(i);
  }
  for (const auto& [a, b] : graph.edges) {
    const BlockPattern::Place place = pattern.place(a, b);
    const Eigen::Matrix3d& stored = matrix.below[place.index];
    const Eigen::Matrix3d block = place.transposed ? Eigen::Matrix3d(stored.transpose()) : stored;
    y.col(a) += block * x.col(b);
    y.col(b) += block.transpose() * x.col(a);
  }
  return y;
}

}  // namespace

BlockGraph near_places(std::size_t nodes, double neighbours, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix3Xd place(3, static_cast<Eigen::Index>(nodes));
  for (double& x : place.reshaped()) x = random.uniform();
  const double reach = std::cbrt(neighbours / (4.19 * static_cast<double>(nodes)));
  BlockGraph graph{"near places", nodes, {}};
  for (std::uint32_t b = 0; b < nodes; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if ((place.col(a) - place.col(b)).norm() < reach) graph.edges.push_back({b, a});
    }
  }
  return graph;
}

BlockGraph path_graph(std::uint32_t nodes) {
  BlockGraph graph{"path", nodes, {}};
  for (std::uint32_t i = 1; i < nodes; ++i) graph.edges.push_back({i - 1, i});
  return graph;
}

BlockGraph complete_graph(std::uint32_t nodes) {
  BlockGraph graph{"complete", nodes, {}};
  for (std::uint32_t b = 0; b < nodes; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) graph.edges.push_back({a, b});
  }
  return graph;
}

std::vector<BlockGraph> block_graphs() {
  return {{"one node", 1, {}},     {"no edges", 5, {}},
          path_graph(2),           path_graph(40),
          star_graph(70),          complete_graph(3),
          complete_graph(17),      complete_graph(61),
          random_edges(30, 90, 1), random_edges(200, 500, 2),
          near_places(150, 14, 3), near_places(400, 14, 4),
          near_places(700, 14, 5), random_edges(620, 900, 6),
          star_graph(600),         near_places(900, 5.0, 7)};
}

BlocksAndDense random_blocks(const BlockGraph& graph, const BlockPattern& pattern, double shift,
                             std::uint64_t seed) {
  Random random(seed);
  const auto n = static_cast<Eigen::Index>(graph.nodes);
  BlocksAndDense pair{BlockMatrix(pattern), Eigen::MatrixXd::Zero(3 * n, 3 * n)};
  const std::set<GraphEdge> once(graph.edges.begin(), graph.edges.end());
  for (const auto& [a, b] : once) {
    if (a > b && once.contains({b, a})) continue;
    const Eigen::Matrix3d block = random_block(random);
    pair.dense.block<3, 3>(3 * Eigen::Index{a}, 3 * Eigen::Index{b}) = block;
    pair.dense.block<3, 3>(3 * Eigen::Index{b}, 3 * Eigen::Index{a}) = block.transpose();
    const BlockPattern::Place place = pattern.place(a, b);
    pair.blocks.below[place.index] = place.transposed ? Eigen::Matrix3d(block.transpose()) : block;
  }
  const Eigen::VectorXd sums = pair.dense.cwiseAbs().rowwise().sum();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Matrix3d part = random_block(random);
    Eigen::Matrix3d block = 0.1 * part * part.transpose() + shift * Eigen::Matrix3d::Identity();
    if (shift > 0.0) block.diagonal() += sums.segment<3>(3 * i);
    pair.blocks.diagonal[static_cast<std::size_t>(i)] = block;
    pair.dense.block<3, 3>(3 * i, 3 * i) = block;
  }
  return pair;
}

Eigen::Matrix3Xd random_side(std::size_t nodes, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix3Xd side(3, static_cast<Eigen::Index>(nodes));
  for (double& x : side.reshaped()) x = random.normal();
  return side;
}

void shift_diagonal(BlocksAndDense& pair, double by) {
  for (Eigen::Matrix3d& block : pair.blocks.diagonal) block.diagonal().array() += by;
  pair.dense.diagonal().array() += by;
}

BlockMatrix outweighed_blocks(const BlockGraph& graph, const BlockPattern& pattern,
                              std::size_t below_zero, std::uint64_t seed) {
  Random random(seed);
  BlockMatrix matrix(pattern);
  std::vector<double> sum(graph.nodes, 0.1);
  for (const auto& [a, b] : graph.edges) {
    const Eigen::Matrix3d block = random_block(random);
    matrix.below[pattern.place(a, b).index] = block;
    sum[a] += block.cwiseAbs().sum();
    sum[b] += block.cwiseAbs().sum();
  }
  for (std::size_t i = 0; i < graph.nodes; ++i) {
    const bool below = i * below_zero / graph.nodes != (i + 1) * below_zero / graph.nodes;
    matrix.diagonal[i] = (below ? -sum[i] : sum[i]) * Eigen::Matrix3d::Identity();
  }
  return matrix;
}

double residual(const Eigen::MatrixXd& a, const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& b) {
  return (a * x.reshaped() - b.reshaped()).norm();
}

double residual(const BlockGraph& graph, const BlockPattern& pattern, const BlockMatrix& a,
                const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& b) {
  return (times(graph, pattern, a, x) - b).norm();
}

}  // namespace tpm::test
