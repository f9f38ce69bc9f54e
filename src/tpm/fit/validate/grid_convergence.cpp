#include "tpm/fit/validate/grid_convergence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpmkit/error.hpp"

namespace tpm::fit {

GridConvergenceEstimate grid_convergence(const std::vector<double>& values, double ratio,
                                         double largest_order) {
  const bool finite = std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
  if (values.size() < 2 || !(ratio > 1.0) || !finite) {
    throw bad_input("grid convergence",
                    fmt::format("{} values at a ratio of {}", values.size(), ratio),
                    "two or more finite values and a ratio above 1");
  }
  constexpr double kSafe = 1.25, kUnsafe = 3.0, kCoverage = 2.0;
  GridConvergenceEstimate g;
  const auto [least, most] = std::ranges::minmax(values);
  g.expanded = kUnsafe * (most - least);
  if (values.size() >= 3) {
    const double fine = values[1] - values[0], coarse = values[2] - values[1];
    g.monotone = fine != 0.0 && coarse / fine > 1.0;
    if (g.monotone) {
      g.order = std::log(coarse / fine) / std::log(ratio);
      const double p = std::min(g.order, largest_order);
      g.expanded = kSafe * std::abs(fine) / (std::pow(ratio, p) - 1.0);
    }
  }
  g.u = g.expanded / kCoverage;
  return g;
}

Eigen::RowVectorXd root_of(const std::vector<double>& values) {
  if (values.size() < 2) return {};
  Eigen::RowVectorXd root = Eigen::RowVectorXd::Map(values.data(), std::ssize(values));
  root.array() -= root.mean();
  return root / std::sqrt(static_cast<double>(values.size() - 1));
}

}  // namespace tpm::fit
