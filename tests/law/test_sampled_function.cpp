#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "expected_values.hpp"
#include "law_answers.hpp"
#include "tpm/law/relaxation/sampled_function.hpp"

using namespace tpm;
using namespace tpm::law;
using test::evenly;

namespace {

/// A function of two parts that counts how often it is asked.
struct Counted {
  double (*first)(double);
  std::size_t most = 0, asked = 0;

  Eigen::MatrixXd operator()(std::span<const double> places) {
    most = std::max(most, places.size());
    asked += places.size();
    Eigen::MatrixXd values(static_cast<Eigen::Index>(places.size()), 2);
    for (std::size_t i = 0; i < places.size(); ++i) {
      values(static_cast<Eigen::Index>(i), 0) = first(places[i]);
      values(static_cast<Eigen::Index>(i), 1) = 3.0 - places[i];
    }
    return values;
  }
};

double largest_error(Counted& function, const std::vector<double>& places, double allowed) {
  const Eigen::MatrixXd values =
      sampled([&](std::span<const double> asked) { return function(asked); }, places, 8,
              Eigen::RowVector2d(allowed, allowed));
  REQUIRE(values.rows() == static_cast<Eigen::Index>(places.size()));
  double worst = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    worst = std::max(worst, std::abs(values(row, 0) - function.first(places[i])));
    worst = std::max(worst, std::abs(values(row, 1) - (3.0 - places[i])));
  }
  return worst;
}

}  // namespace

TEST_CASE("A smooth function is answered at many places from sixteen of its values") {
  Counted smooth{[](double x) { return std::exp(-x) * std::sin(2.0 * x); }};
  CHECK(largest_error(smooth, evenly(0.2, 1.2, 1000), 1e-6) <
        test::allowed_error("sampled_function.smooth"));
  CHECK(smooth.asked == 16);
  CHECK(smooth.most <= 8);
}

TEST_CASE("Layers and kinks are found, and cost no more than a few halvings") {
  Counted layer{[](double x) { return 1.0 - std::exp(-3000.0 * x) + 0.2 * x * x; }};
  CHECK(largest_error(layer, evenly(0.0, 1.0, 20'000), 1e-7) <
        test::allowed_error("sampled_function.layer"));
  CHECK(static_cast<double>(layer.asked) < test::allowed_cost("sampled_function.layer"));
  Counted kinked{[](double x) { return std::abs(x - 0.3711); }};
  CHECK(largest_error(kinked, evenly(0.0, 1.0, 20'000), 1e-7) < 1e-7);
  CHECK(static_cast<double>(kinked.asked) < test::allowed_cost("sampled_function.kink"));
}

TEST_CASE("Few places, or the same place again, are answered by the function itself") {
  Counted few{[](double x) { return std::sqrt(x); }};
  CHECK(largest_error(few, evenly(0.0, 1.0, 30), 1e-3) == 0.0);
  CHECK(few.asked == 30);
  Counted same{[](double x) { return std::cos(x); }};
  CHECK(largest_error(same, std::vector<double>(100, 0.25), 1e-3) == 0.0);
  CHECK(same.most <= 8);
  Counted none{[](double x) { return x; }};
  CHECK(largest_error(none, {}, 1.0) == 0.0);
  CHECK(none.asked == 0);
}

TEST_CASE("Nothing is interpolated where no difference is allowed, or a value is not finite") {
  Counted strict{[](double x) { return std::exp(x); }};
  CHECK(largest_error(strict, evenly(0.0, 1.0, 200), 0.0) == 0.0);
  CHECK(strict.asked >= 200);
  Counted broken{[](double x) { return x > 0.5 ? std::nan("") : x; }};
  const std::vector<double> places = evenly(0.0, 1.0, 200);
  const Eigen::MatrixXd values =
      sampled([&](std::span<const double> asked) { return broken(asked); }, places, 8,
              Eigen::RowVector2d(1.0, 1.0));
  CHECK(std::isnan(values(150, 0)));
  CHECK(values(10, 0) == Approx(places[10]));
  // Places that no number lies between cannot be halved, whichever of them their middle rounds to.
  Counted never{[](double) { return std::nan(""); }};
  for (const double from : {0.3, std::nextafter(0.3, 1.0)}) {
    std::vector<double> next_to(64, from);
    std::fill(next_to.begin() + 32, next_to.end(), std::nextafter(from, 1.0));
    const Eigen::MatrixXd close =
        sampled([&](std::span<const double> asked) { return never(asked); }, next_to, 8,
                Eigen::RowVector2d(1.0, 1.0));
    CHECK(close.col(0).array().isNaN().all());
  }
}
