// The sparse direct solver: orders, fronts, factors and solutions against dense ones by Eigen.
#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <numeric>
#include <set>

#include "tpm/base/random.hpp"
#include "tpm/organ/linear/elimination_order.hpp"
#include "tpm/organ/linear/lane_factor.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::organ;

namespace {

using Edge = std::array<std::uint32_t, 2>;
using Edges = std::vector<Edge>;

struct Graph {
  std::string name;
  std::size_t nodes;
  Edges edges;
};

/// Places in a box, joined within a distance: the graph of a tissue.
Graph near_places(std::size_t nodes, double neighbours, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix3Xd place(3, static_cast<Eigen::Index>(nodes));
  for (double& x : place.reshaped()) x = random.uniform();
  const double reach = std::cbrt(neighbours / (4.19 * static_cast<double>(nodes)));
  Graph graph{"near places", nodes, {}};
  for (std::uint32_t b = 0; b < nodes; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if ((place.col(a) - place.col(b)).norm() < reach) graph.edges.push_back({b, a});
    }
  }
  return graph;
}

Graph random_edges(std::size_t nodes, std::size_t edges, std::uint64_t seed) {
  Random random(seed);
  Graph graph{"random edges", nodes, {}};
  while (graph.edges.size() < edges) {
    const auto a = static_cast<std::uint32_t>(random.below(nodes));
    const auto b = static_cast<std::uint32_t>(random.below(nodes));
    if (a != b) graph.edges.push_back({a, b});  // now and then a pair that is there already
  }
  return graph;
}

/// One node that all others are joined to: a tool and what it touches.
Graph star(std::uint32_t nodes) {
  Graph graph{"star", nodes, {}};
  for (std::uint32_t i = 0; i < nodes; ++i) {
    if (i != nodes / 2) graph.edges.push_back({nodes / 2, i});
  }
  return graph;
}

Graph path(std::uint32_t nodes) {
  Graph graph{"path", nodes, {}};
  for (std::uint32_t i = 1; i < nodes; ++i) graph.edges.push_back({i - 1, i});
  return graph;
}

/// All with all: one front of many panels.
Graph complete(std::uint32_t nodes) {
  Graph graph{"complete", nodes, {}};
  for (std::uint32_t b = 0; b < nodes; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) graph.edges.push_back({a, b});
  }
  return graph;
}

std::vector<Graph> graphs() {
  return {{"one node", 1, {}},
          {"no edges", 5, {}},
          path(2),
          path(40),
          star(70),
          complete(3),
          complete(17),
          complete(61),
          random_edges(30, 90, 1),
          random_edges(200, 500, 2),
          near_places(150, 14, 3),
          near_places(400, 14, 4),
          near_places(700, 14, 5),
          random_edges(620, 900, 6),
          star(600),
          near_places(900, 5.0, 7)};
}

/// A block matrix and the same densely.
struct Pair {
  BlockMatrix blocks;
  Eigen::MatrixXd dense;
};

Eigen::Matrix3d random_block(Random& random) {
  Eigen::Matrix3d block;
  for (double& x : block.reshaped()) x = random.normal();
  return block;
}

/// Random blocks where the graph has edges; `shift` on the diagonal, against rows that sum up to
/// less: positive definite for a shift above 0.
Pair random_matrix(const Graph& graph, const BlockPattern& pattern, double shift,
                   std::uint64_t seed) {
  Random random(seed);
  const auto n = static_cast<Eigen::Index>(graph.nodes);
  Pair pair{BlockMatrix(pattern), Eigen::MatrixXd::Zero(3 * n, 3 * n)};
  const std::set<Edge> once(graph.edges.begin(), graph.edges.end());
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

/// Moves the diagonal of both.
void shift_diagonal(Pair& pair, double by) {
  for (Eigen::Matrix3d& block : pair.blocks.diagonal) block.diagonal().array() += by;
  pair.dense.diagonal().array() += by;
}

std::size_t negative_eigenvalues(const Eigen::MatrixXd& dense) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(dense, Eigen::EigenvaluesOnly);
  return static_cast<std::size_t>((eigen.eigenvalues().array() < 0.0).count());
}

/// Random blocks that the diagonal outweighs, so that its signs are those of the eigenvalues
/// (Gershgorin): `below_zero` nodes with three below 0.
BlockMatrix outweighed_matrix(const Graph& graph, const BlockPattern& pattern,
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

Eigen::Matrix3Xd times(const Graph& graph, const BlockPattern& pattern, const BlockMatrix& matrix,
                       const Eigen::Matrix3Xd& x) {
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

TEST_CASE("an order of elimination names each place once and depends on the graph alone") {
  for (const Graph& graph : graphs()) {
    CAPTURE(graph.name, graph.nodes);
    const std::vector<std::uint32_t> order = elimination_order(graph.nodes, graph.edges);
    std::vector<std::uint32_t> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> all(graph.nodes);
    std::iota(all.begin(), all.end(), 0U);
    CHECK(sorted == all);
    std::srand(17);  // METIS takes its random numbers from there
    (void)std::rand();
    Edges turned = graph.edges;
    std::reverse(turned.begin(), turned.end());
    for (Edge& edge : turned) std::swap(edge[0], edge[1]);
    if (graph.nodes > 500) CHECK(elimination_order(graph.nodes, turned) == order);
    CHECK(elimination_order(graph.nodes, graph.edges) == order);
  }
}

TEST_CASE("fronts cover all nodes, and what a front reaches its parent holds") {
  for (const Graph& graph : graphs()) {
    CAPTURE(graph.name, graph.nodes);
    const EliminationFronts fronts(graph.nodes, graph.edges);
    std::uint32_t next = 0;
    for (std::uint32_t f = 0; f < fronts.fronts().size(); ++f) {
      const auto& front = fronts.fronts()[f];
      REQUIRE(front.first == next);
      REQUIRE(front.own > 0);
      next += front.own;
      const auto rows = fronts.row(front);
      CHECK(std::is_sorted(rows.begin(), rows.end()));
      if (rows.empty()) {
        CHECK(front.parent == f);
        continue;
      }
      REQUIRE(front.parent > f);
      const auto& parent = fronts.fronts()[front.parent];
      CHECK(front.depth == parent.depth + 1);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::uint32_t at = fronts.row_in_parent(front)[i];
        const std::uint32_t place =
            at < parent.own ? parent.first + at : fronts.row(parent)[at - parent.own];
        CHECK(place == rows[i]);
      }
    }
    CHECK(next == graph.nodes);
    for (const auto& [a, b] : graph.edges) {
      const auto [low, high] = std::minmax(fronts.place()[a], fronts.place()[b]);
      const auto holds = [low = low, high = high, &fronts](const auto& front) {
        if (low < front.first || low >= front.first + front.own) return false;
        const auto rows = fronts.row(front);
        return high < front.first + front.own || std::binary_search(rows.begin(), rows.end(), high);
      };
      CHECK(std::any_of(fronts.fronts().begin(), fronts.fronts().end(), holds));
    }
  }
}

TEST_CASE("solutions of positive definite matrices are those of a dense factorisation") {
  std::uint64_t seed = 1;
  for (const Graph& graph : graphs()) {
    CAPTURE(graph.name, graph.nodes);
    const BlockPattern pattern(graph.nodes, graph.edges);
    const Pair pair = random_matrix(graph, pattern, 0.1, seed++);
    const Eigen::Matrix3Xd right = random_side(graph.nodes, seed++);
    Eigen::VectorXd dense;  // of the smaller ones: it takes long
    if (graph.nodes <= 450) dense = pair.dense.ldlt().solve(right.reshaped());
    for (const bool portable : {false, true}) {
      BlockLdlt factor(pattern, portable);
      Eigen::Matrix3Xd x;
      for (int again = 0; again < 2; ++again) {  // what the first left behind does not show
        REQUIRE(factor.factorise(pair.blocks));
        CHECK(factor.negative_count() == 0);
        x = right;
        factor.solve(x);
        if (dense.size() > 0) CHECK((x.reshaped() - dense).norm() <= 1e-12 * dense.norm());
        CHECK((pair.dense * x.reshaped() - right.reshaped()).norm() <=
              1e-13 * pair.dense.norm() * x.norm());
      }
      LaneFactor lanes(pattern);
      lanes.copy(factor);
      LaneMatrix together(kLanes, 3 * right.cols());
      for (int lane = 0; lane < kLanes; ++lane) together.row(lane) = (lane - 3) * right.reshaped();
      lanes.solve(together);
      for (int lane = 0; lane < kLanes; ++lane) {
        const Eigen::VectorXd of_lane = together.row(lane).transpose();
        CHECK((of_lane - (lane - 3) * x.reshaped()).norm() <= 1e-5 * 5.0 * x.norm());
      }
    }
  }
}

TEST_CASE("two factorisations of one matrix are the same to the bit") {
  const Graph graph = near_places(700, 14, 5);
  const BlockPattern pattern(graph.nodes, graph.edges);
  const BlockPattern other(graph.nodes, graph.edges);
  const Pair pair = random_matrix(graph, pattern, 0.1, 8);
  const Pair same = random_matrix(graph, other, 0.1, 8);
  const Pair before = random_matrix(graph, other, 3.0, 9);
  BlockLdlt a(pattern);
  BlockLdlt b(other);
  REQUIRE(b.factorise(before.blocks));  // memory that another matrix was in
  REQUIRE(a.factorise(pair.blocks));
  REQUIRE(b.factorise(same.blocks));
  Eigen::Matrix3Xd x = random_side(graph.nodes, 1);
  Eigen::Matrix3Xd y = x;
  a.solve(x);
  b.solve(y);
  CHECK(x == y);
}

TEST_CASE("a matrix that is factorised on several processors is solved, the same to the bit") {
  const Graph graph = near_places(1800, 30, 6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  REQUIRE(pattern.factor_products() >= BlockPattern::products_worth_threads());
  const Eigen::Matrix3Xd right = random_side(graph.nodes, 11);
  for (const std::size_t below_zero : {0, 50}) {
    const BlockMatrix matrix = outweighed_matrix(graph, pattern, below_zero, 12);
    Eigen::Matrix3Xd by_one = right;
    for (const int threads : {1, 2}) {
      CAPTURE(below_zero, threads);
      BlockLdlt factor(pattern);
      bool done = false;
      tbb::task_arena(threads).execute([&] { done = factor.factorise(matrix); });
      REQUIRE(done);
      CHECK(factor.negative_count() == 3 * below_zero);
      Eigen::Matrix3Xd x = right;
      factor.solve(x);
      if (threads == 1) by_one = x;
      CHECK(x == by_one);
      CHECK((times(graph, pattern, matrix, x) - right).norm() <= 1e-13 * right.norm());
    }
  }
}

TEST_CASE("a pivot without an inverse is reported by whichever thread meets it") {
  const Graph graph = near_places(1800, 30, 6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  BlockMatrix matrix = outweighed_matrix(graph, pattern, 0, 12);
  BlockLdlt factor(pattern);
  for (std::size_t node = 0; node < graph.nodes; node += 300) {
    const double kept = std::exchange(matrix.diagonal[node](2, 2), std::nan(""));
    CHECK_FALSE(factor.factorise(matrix));
    matrix.diagonal[node](2, 2) = kept;
  }
  CHECK(factor.factorise(matrix));
}

TEST_CASE("negative eigenvalues are counted as a dense solver counts them") {
  std::uint64_t seed = 100;
  for (const Graph& graph : graphs()) {
    CAPTURE(graph.name, graph.nodes);
    if (graph.nodes > 450) continue;  // for the sake of the dense solver's time
    const BlockPattern pattern(graph.nodes, graph.edges);
    Pair pair = random_matrix(graph, pattern, -2.0, seed++);
    const std::size_t expected = negative_eigenvalues(pair.dense);
    for (const bool portable : {false, true}) {
      BlockLdlt factor(pattern, portable);
      REQUIRE(factor.factorise(pair.blocks));
      CHECK(factor.negative_count() == expected);
    }
  }
}

TEST_CASE("a matrix counts as indefinite as soon as its lowest eigenvalue is below 0") {
  std::uint64_t seed = 200;
  for (const Graph& graph : {near_places(150, 14, 3), near_places(400, 14, 4), complete(61)}) {
    CAPTURE(graph.name, graph.nodes);
    const BlockPattern pattern(graph.nodes, graph.edges);
    Pair pair = random_matrix(graph, pattern, 0.1, seed++);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(pair.dense, Eigen::EigenvaluesOnly);
    const double lowest = eigen.eigenvalues()[0];
    const double most = eigen.eigenvalues()[pair.dense.rows() - 1];
    const double little = 1e-11 * most;
    shift_diagonal(pair, little - lowest);
    BlockLdlt factor(pattern);
    REQUIRE(factor.factorise(pair.blocks));
    CHECK(factor.negative_count() == 0);
    shift_diagonal(pair, -2.0 * little);
    REQUIRE(factor.factorise(pair.blocks));
    CHECK(factor.negative_count() == 1);
  }
}

TEST_CASE("a pivot that has no inverse, or is no number, is reported") {
  const Graph graph = path(6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  BlockLdlt factor(pattern);
  BlockMatrix matrix(pattern);
  CHECK_FALSE(factor.factorise(matrix));
  for (Eigen::Matrix3d& block : matrix.diagonal) block.setIdentity();
  CHECK(factor.factorise(matrix));
  matrix.diagonal[3](1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(factor.factorise(matrix));
}

TEST_CASE("only neighbours have a place in a block matrix") {
  const Graph graph = path(6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  CHECK(pattern.matrix_blocks() == 5);
  CHECK_NOTHROW(pattern.place(2, 3));
  CHECK(pattern.place(2, 3).index == pattern.place(3, 2).index);
  CHECK(pattern.place(2, 3).transposed != pattern.place(3, 2).transposed);
  CHECK_THROWS_AS(pattern.place(2, 4), std::out_of_range);
  CHECK_THROWS_AS(pattern.place(2, 6), std::out_of_range);
}
