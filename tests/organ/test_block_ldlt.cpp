// The sparse direct solver: orders, fronts, factors and solutions against dense ones by Eigen.
#include <tbb/task_arena.h>

#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <numeric>

#include "block_problems.hpp"
#include "tpm/base/dense_algebra.hpp"
#include "tpm/organ/linear/elimination_order.hpp"
#include "tpm/organ/linear/lane_factor.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::organ;

TEST_CASE("an order of elimination names each place once and depends on the graph alone") {
  for (const test::BlockGraph& graph : test::block_graphs()) {
    CAPTURE(graph.name, graph.nodes);
    const std::vector<std::uint32_t> order = elimination_order(graph.nodes, graph.edges);
    std::vector<std::uint32_t> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint32_t> all(graph.nodes);
    std::iota(all.begin(), all.end(), 0U);
    CHECK(sorted == all);
    std::srand(17);  // METIS takes its random numbers from there
    (void)std::rand();
    std::vector<test::GraphEdge> turned = graph.edges;
    std::reverse(turned.begin(), turned.end());
    for (test::GraphEdge& edge : turned) std::swap(edge[0], edge[1]);
    if (graph.nodes > 500) CHECK(elimination_order(graph.nodes, turned) == order);
    CHECK(elimination_order(graph.nodes, graph.edges) == order);
  }
}

TEST_CASE("fronts cover all nodes, and what a front reaches its parent holds") {
  for (const test::BlockGraph& graph : test::block_graphs()) {
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
  for (const test::BlockGraph& graph : test::block_graphs()) {
    CAPTURE(graph.name, graph.nodes);
    const BlockPattern pattern(graph.nodes, graph.edges);
    const test::BlocksAndDense pair = test::random_blocks(graph, pattern, 0.1, seed++);
    const Eigen::Matrix3Xd right = test::random_side(graph.nodes, seed++);
    Eigen::VectorXd dense;  // of the smaller ones: it takes long
    const double size = pair.dense.norm();
    if (graph.nodes <= 450) dense = solve_symmetric(pair.dense, right.reshaped());
    for (const bool portable : {false, true}) {
      BlockLdlt factor(pattern, portable);
      Eigen::Matrix3Xd x;
      for (int again = 0; again < 2; ++again) {  // what the first left behind does not show
        REQUIRE(factor.factorise(pair.blocks));
        CHECK(factor.negative_count() == 0);
        x = right;
        factor.solve(x);
        if (dense.size() > 0) CHECK((x.reshaped() - dense).norm() <= 1e-12 * dense.norm());
        CHECK(test::residual(pair.dense, x, right) <= 1e-13 * size * x.norm());
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
  const test::BlockGraph graph = test::near_places(700, 14, 5);
  const BlockPattern pattern(graph.nodes, graph.edges);
  const BlockPattern other(graph.nodes, graph.edges);
  const test::BlocksAndDense pair = test::random_blocks(graph, pattern, 0.1, 8);
  const test::BlocksAndDense same = test::random_blocks(graph, other, 0.1, 8);
  const test::BlocksAndDense before = test::random_blocks(graph, other, 3.0, 9);
  BlockLdlt a(pattern);
  BlockLdlt b(other);
  REQUIRE(b.factorise(before.blocks));  // memory that another matrix was in
  REQUIRE(a.factorise(pair.blocks));
  REQUIRE(b.factorise(same.blocks));
  Eigen::Matrix3Xd x = test::random_side(graph.nodes, 1);
  Eigen::Matrix3Xd y = x;
  a.solve(x);
  b.solve(y);
  CHECK(x == y);
}

TEST_CASE("a matrix that is factorised on several processors is solved, the same to the bit") {
  const test::BlockGraph graph = test::near_places(1800, 30, 6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  REQUIRE(pattern.factor_products() >= BlockPattern::products_worth_threads());
  const Eigen::Matrix3Xd right = test::random_side(graph.nodes, 11);
  for (const std::size_t below_zero : {0, 50}) {
    const BlockMatrix matrix = test::outweighed_blocks(graph, pattern, below_zero, 12);
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
      CHECK(test::residual(graph, pattern, matrix, x, right) <= 1e-13 * right.norm());
    }
  }
}

TEST_CASE("a pivot without an inverse is reported by whichever thread meets it") {
  const test::BlockGraph graph = test::near_places(1800, 30, 6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  BlockMatrix matrix = test::outweighed_blocks(graph, pattern, 0, 12);
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
  for (const test::BlockGraph& graph : test::block_graphs()) {
    CAPTURE(graph.name, graph.nodes);
    if (graph.nodes > 450) continue;  // for the sake of the dense solver's time
    const BlockPattern pattern(graph.nodes, graph.edges);
    test::BlocksAndDense pair = test::random_blocks(graph, pattern, -2.0, seed++);
    const auto expected =
        static_cast<std::size_t>((ordered_eigenvalues(pair.dense).array() < 0.0).count());
    for (const bool portable : {false, true}) {
      BlockLdlt factor(pattern, portable);
      REQUIRE(factor.factorise(pair.blocks));
      CHECK(factor.negative_count() == expected);
    }
  }
}

TEST_CASE("a matrix counts as indefinite as soon as its lowest eigenvalue is below 0") {
  std::uint64_t seed = 200;
  for (const test::BlockGraph& graph :
       {test::near_places(150, 14, 3), test::near_places(400, 14, 4), test::complete_graph(61)}) {
    CAPTURE(graph.name, graph.nodes);
    const BlockPattern pattern(graph.nodes, graph.edges);
    test::BlocksAndDense pair = test::random_blocks(graph, pattern, 0.1, seed++);
    const Eigen::VectorXd eigenvalues = ordered_eigenvalues(pair.dense);
    const double lowest = eigenvalues[0];
    const double most = eigenvalues[eigenvalues.size() - 1];
    const double little = 1e-11 * most;
    test::shift_diagonal(pair, little - lowest);
    BlockLdlt factor(pattern);
    REQUIRE(factor.factorise(pair.blocks));
    CHECK(factor.negative_count() == 0);
    test::shift_diagonal(pair, -2.0 * little);
    REQUIRE(factor.factorise(pair.blocks));
    CHECK(factor.negative_count() == 1);
  }
}

TEST_CASE("a pivot that has no inverse, or is no number, is reported") {
  const test::BlockGraph graph = test::path_graph(6);
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
  const test::BlockGraph graph = test::path_graph(6);
  const BlockPattern pattern(graph.nodes, graph.edges);
  CHECK(pattern.matrix_blocks() == 5);
  CHECK_NOTHROW(pattern.place(2, 3));
  CHECK(pattern.place(2, 3).index == pattern.place(3, 2).index);
  CHECK(pattern.place(2, 3).transposed != pattern.place(3, 2).transposed);
  CHECK_THROWS_AS(pattern.place(2, 4), std::out_of_range);
  CHECK_THROWS_AS(pattern.place(2, 6), std::out_of_range);
}
