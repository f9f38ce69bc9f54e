#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "expected_values.hpp"
#include "sensitivity_problems.hpp"
#include "tpm/base/grid_convergence.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/point_set.hpp"
#include "tpm/base/sensitivity.hpp"
#include "tpmkit/error.hpp"

namespace tpm::base {
namespace {

using Catch::Matchers::WithinAbs;

/// How many of the first `count` points fall into each of the boxes of 2^a by 2^b over dimensions
/// i and j; the largest and the smallest number.
std::pair<int, int> filling(const CubePoints& set, std::uint64_t count, int i, int j, int a,
                            int b) {
  std::vector<int> box(std::size_t{1} << (a + b), 0);
  for (std::uint64_t p = 0; p < count; ++p) {
    const auto x = static_cast<std::size_t>(std::ldexp(set.coordinate(p, i), a));
    const auto y = static_cast<std::size_t>(std::ldexp(set.coordinate(p, j), b));
    ++box[(x << b) + y];
  }
  const auto [least, most] = std::minmax_element(box.begin(), box.end());
  return {*least, *most};
}

/// Of the mean of exp(x1 + x2 + x3) over `count` points: root mean square error over seeds.
double error_of_mean(const std::function<std::unique_ptr<CubePoints>(std::uint64_t)>& make,
                     std::uint64_t count) {
  const double exact = std::pow(std::numbers::e - 1.0, 3);
  double squares = 0.0;
  constexpr std::uint64_t kSeeds = 20;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto set = make(seed);
    double sum = 0.0;
    for (std::uint64_t p = 0; p < count; ++p)
      sum += std::exp(set->coordinate(p, 0) + set->coordinate(p, 1) + set->coordinate(p, 2));
    squares += std::pow(sum / static_cast<double>(count) - exact, 2) / kSeeds;
  }
  return std::sqrt(squares);
}

TEST_CASE("Sobol points are those of SciPy") {
  // scipy.stats.qmc.Sobol(40, scramble=False).random(1024)[777][[0, 7, 19, 39]]
  const auto set = plain_sobol_points(40);
  CHECK_THAT(set->coordinate(777, 0), test::expected("sobol.point_777_coordinate_0"));
  CHECK_THAT(set->coordinate(777, 7), test::expected("sobol.point_777_coordinate_7"));
  CHECK_THAT(set->coordinate(777, 19), test::expected("sobol.point_777_coordinate_19"));
  CHECK_THAT(set->coordinate(777, 39), test::expected("sobol.point_777_coordinate_39"));
  CHECK(set->coordinate(0, 3) == 0.0);
  CHECK(set->coordinate(1, 39) == 0.5);
}

TEST_CASE("Scrambling keeps the even filling of the cube, in every elementary box") {
  for (const std::uint64_t seed : {0ULL, 1ULL, 77ULL}) {
    const auto set = sobol_points(4, seed);
    for (int a = 0; a <= 10; ++a)
      CHECK(filling(*set, 1024, 0, 1, a, 10 - a) == std::pair<int, int>(1, 1));
    for (int j = 0; j < 4; ++j) CHECK(filling(*set, 1024, j, 0, 10, 0).first == 1);
  }
  CHECK(sobol_points(2, 0)->coordinate(5, 1) != sobol_points(2, 1)->coordinate(5, 1));
  CHECK(sobol_points(2, 0)->coordinate(5, 1) == sobol_points(9, 0)->coordinate(5, 1));
}

TEST_CASE("A Latin hypercube has one point in each interval of each dimension") {
  for (const std::uint64_t count : {1ULL, 2ULL, 3ULL, 1000ULL, 4097ULL}) {
    const auto set = latin_hypercube(count, 5);
    for (const int dimension : {0, 1, 7}) {
      std::vector<int> interval(count, 0);
      for (std::uint64_t p = 0; p < count; ++p) {
        const double x = set->coordinate(p, dimension);
        REQUIRE((x >= 0.0 && x < 1.0));
        ++interval[static_cast<std::size_t>(x * static_cast<double>(count))];
      }
      CHECK(std::count(interval.begin(), interval.end(), 1) == static_cast<std::ptrdiff_t>(count));
    }
  }
}

TEST_CASE("Means over points err as the theory of each kind says") {
  const auto order = [](const std::function<std::unique_ptr<CubePoints>(std::uint64_t)>& make) {
    return std::log2(error_of_mean(make, 256) / error_of_mean(make, 4096)) / 4.0;
  };
  const auto sobol = [](std::uint64_t seed) { return sobol_points(3, seed); };
  CHECK_THAT(order([](std::uint64_t seed) { return random_points(seed); }), WithinAbs(0.5, 0.25));
  CHECK(order(sobol) > 1.2);  // 1.5 and a power of a logarithm for what is smooth (Owen 1997)
  const auto latin = [](std::uint64_t seed) { return latin_hypercube(1024, seed); };
  CHECK(error_of_mean(latin, 1024) < 0.5 * error_of_mean(random_points, 1024));
  CHECK(error_of_mean(sobol, 1024) < 0.1 * error_of_mean(latin, 1024));
}

TEST_CASE("Random points are uniform and uncorrelated between neighbours") {
  const auto set = random_points(0);
  constexpr std::uint64_t kCount = 20000;
  double mean = 0.0, next = 0.0, across = 0.0;
  for (std::uint64_t p = 0; p < kCount; ++p) {
    const double x = set->coordinate(p, 0) - 0.5;
    mean += x / kCount;
    next += 12.0 * x * (set->coordinate(p + 1, 0) - 0.5) / kCount;
    across += 12.0 * x * (set->coordinate(p, 1) - 0.5) / kCount;
  }
  const double sigma = 1.0 / std::sqrt(static_cast<double>(kCount));
  CHECK(std::abs(mean) < 4.0 * sigma / std::sqrt(12.0));
  CHECK(std::abs(next) < 4.0 * sigma);
  CHECK(std::abs(across) < 4.0 * sigma);
}

TEST_CASE("Sobol indices of Ishigami's and the G-function") {
  for (const SensitivityProblem& problem : {ishigami(), g_function()}) {
    INFO(problem.name);
    const SensitivityDesign design{problem.inputs, 1024, 8, 3};
    const SensitivityResult found = sobol_indices(design, outputs_of(problem, design));
    CHECK_THAT(found.standard_deviation,
               WithinAbs(std::sqrt(problem.variance), 3e-3 * std::sqrt(problem.variance)));
    for (std::size_t i = 0; i < problem.first_order.size(); ++i) {
      CHECK_THAT(found.inputs[i].first_order.value, WithinAbs(problem.first_order[i], 0.01));
      CHECK_THAT(found.inputs[i].total.value, WithinAbs(problem.total[i], 0.01));
      CHECK(found.inputs[i].total.high - found.inputs[i].total.low < 0.05);
    }
  }
}

TEST_CASE("Points without a finite output are left out and counted") {
  const SensitivityProblem problem = ishigami();
  const SensitivityDesign design{3, 256, 4, 0};
  std::vector<double> outputs = outputs_of(problem, design);
  outputs[7] = std::nan("");
  outputs[11] = INFINITY;
  outputs[2000] = std::nan("");
  const SensitivityResult found = sobol_indices(design, outputs);
  CHECK(found.left_out == 3);
  CHECK_THAT(found.inputs[0].total.value, WithinAbs(problem.total[0], 0.05));
  CHECK(sobol_indices(design, std::vector<double>(design.cells(), 2.5)).inputs.empty());
}

TEST_CASE("Three grids tell order, limit and error of a solution") {
  const std::vector<double> h{0.4, 0.2, 0.09};
  for (const double p : {0.5, 1.0, 2.0, 4.0}) {
    std::vector<double> f;
    f.reserve(h.size());
    for (const double size : h) f.push_back(3.0 - 2.0 * std::pow(size, p));
    const GridConvergence g = grid_convergence(h, f);
    CHECK(g.behaviour == GridConvergence::Behaviour::monotone);
    CHECK_THAT(g.order, WithinAbs(p, 1e-9));
    CHECK_THAT(g.extrapolated, WithinAbs(3.0, 1e-9));
    CHECK_THAT(g.index, WithinAbs(1.25 * (3.0 - f[2]), 1e-9));
  }
  using Behaviour = GridConvergence::Behaviour;
  CHECK(grid_convergence(h, std::vector<double>{1.0, 1.5, 1.25}).behaviour ==
        Behaviour::oscillating);
  CHECK(grid_convergence(h, std::vector<double>{1.0, 1.1, 1.5}).behaviour == Behaviour::diverging);
  CHECK(grid_convergence(h, std::vector<double>{1.0, 1.0, 1.0}).behaviour == Behaviour::exact);
  CHECK_THROWS_AS(grid_convergence(h, std::vector<double>{1.0, 2.0}), Error);
  CHECK_THROWS_AS(grid_convergence(std::vector<double>{0.1, 0.2, 0.3}, h), Error);
}

TEST_CASE("A design out of range is refused in one line") {
  CHECK_THROWS_AS(sensitivity_points({0, 16, 4, 0}), Error);
  CHECK_THROWS_AS(sensitivity_points({3, 100, 4, 0}), Error);
  CHECK_THROWS_AS(sensitivity_points({3, 16, 1, 0}), Error);
  CHECK_THROWS_AS(sobol_indices({3, 16, 2, 0}, std::vector<double>(7)), Error);
  CHECK_THROWS_AS(plain_sobol_points(3668), Error);
  CHECK_THROWS_AS(latin_hypercube(0, 0), Error);
}

}  // namespace
}  // namespace tpm::base
