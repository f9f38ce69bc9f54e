#include "tpm/fit/likelihood/starts.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace tpm::fit {
namespace {

/// Starts that are followed to their end out of those that were looked at.
constexpr std::size_t kFollowed = 5;

/// Minimum of |A x - b| with lower <= x <= upper, from the normal equations: for a handful of
/// columns. Columns of zeros leave x at the bound nearest to 0.
Eigen::VectorXd bounded_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                      const Eigen::VectorXd& b, const Eigen::VectorXd& lower,
                                      const Eigen::VectorXd& upper) {
  return bounded_minimum(a.transpose() * a, a.transpose() * b, lower, upper);
}

/// The start with its linear parameters solved for. Empty if it cannot be evaluated.
std::vector<double> projected(const ResidualFunction& function,
                              std::span<const FitParameter> parameters,
                              const std::vector<std::size_t>& linear, std::vector<double> start,
                              double& deviance) {
  Eigen::VectorXd r;
  RowMatrix jacobian;
  if (!function.evaluate(start, r, &jacobian)) return {};
  const auto n = static_cast<Eigen::Index>(linear.size());
  Eigen::MatrixXd a(r.size(), n);
  Eigen::VectorXd lower(n);
  Eigen::VectorXd upper(n);
  Eigen::VectorXd b = -r;
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t i = linear[static_cast<std::size_t>(k)];
    a.col(k) = jacobian.col(static_cast<Eigen::Index>(i));
    b += a.col(k) * start[i];
    lower[k] = parameters[i].lower;
    upper[k] = parameters[i].upper;
  }
  const Eigen::VectorXd x = bounded_least_squares(a, b, lower, upper);
  deviance = (a * x - b).squaredNorm();
  for (Eigen::Index k = 0; k < n; ++k) start[linear[static_cast<std::size_t>(k)]] = x[k];
  return start;
}

/// Minimum over the free columns while the others keep their x.
Eigen::VectorXd with_free(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right,
                          const std::vector<Eigen::Index>& free, Eigen::VectorXd x) {
  constexpr double kSharingRidge =
      1e-12;  // columns that repeat each other share, instead of a pivot of 0
  Eigen::VectorXd held = x;
  for (const Eigen::Index k : free) held[k] = 0.0;
  const Eigen::VectorXd rest = right - gram * held;
  Eigen::MatrixXd a = gram(free, free);
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  a = scale.asDiagonal() * a * scale.asDiagonal();
  a.diagonal().array() += kSharingRidge;
  const Eigen::VectorXd b = scale.asDiagonal() * rest(free);
  const Eigen::VectorXd y = scale.asDiagonal() * a.ldlt().solve(b);
  for (std::size_t i = 0; i < free.size(); ++i) x[free[i]] = y[static_cast<Eigen::Index>(i)];
  return x;
}

/// Goes from x towards `wanted` as far as the bounds let it; tells whether it arrived. What meets
/// its bound leaves the free columns.
bool go_within(const Eigen::VectorXd& wanted, const Eigen::VectorXd& lower,
               const Eigen::VectorXd& upper, std::vector<Eigen::Index>& free, Eigen::VectorXd& x) {
  double share = 1.0;
  Eigen::Index first = -1;
  for (const Eigen::Index k : free) {
    const double bound = wanted[k] < lower[k] ? lower[k] : upper[k];
    if (wanted[k] >= lower[k] && wanted[k] <= upper[k]) continue;
    const double to_bound = std::clamp((bound - x[k]) / (wanted[k] - x[k]), 0.0, 1.0);
    if (first >= 0 && to_bound >= share) continue;
    share = to_bound;
    first = k;
  }
  if (first < 0) {
    x = wanted;
    return true;
  }
  const double bound = wanted[first] < lower[first] ? lower[first] : upper[first];
  for (const Eigen::Index k : free) {
    x[k] = std::clamp(x[k] + share * (wanted[k] - x[k]), lower[k], upper[k]);
  }
  x[first] = bound;
  std::erase(free, first);
  return false;
}

/// The column at a bound that gains most by leaving it; -1 if there is none.
Eigen::Index most_pulled(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right,
                         const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                         const Eigen::VectorXd& x, const std::vector<Eigen::Index>& free) {
  constexpr double kRounding = 1e-12;
  const Eigen::VectorXd pull = right - gram * x;
  Eigen::Index best = -1;
  double strongest = 0.0;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (!(gram(k, k) > 0.0) || std::find(free.begin(), free.end(), k) != free.end()) continue;
    const double inward = x[k] <= lower[k] ? pull[k] : -pull[k];
    const double noise = std::abs(right[k]) + gram.row(k).cwiseAbs().dot(x.cwiseAbs());
    const double strength = inward / std::sqrt(gram(k, k));
    if (lower[k] == upper[k] || inward <= kRounding * noise || strength <= strongest) continue;
    strongest = strength;
    best = k;
  }
  return best;
}

}  // namespace

Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  const Eigen::Index n = gram.cols();
  Eigen::VectorXd x(n);
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < n; ++k) {
    x[k] = std::clamp(0.0, lower[k], upper[k]);
    if (gram(k, k) > 0.0) free.push_back(k);
  }
  for (Eigen::Index step = 0; step < 10 * n; ++step) {
    while (!free.empty() && !go_within(with_free(gram, right, free, x), lower, upper, free, x)) {
    }
    const Eigen::Index pulled = most_pulled(gram, right, lower, upper, x, free);
    if (pulled < 0) break;
    free.push_back(pulled);
  }
  return x;
}

std::vector<std::vector<double>> projected_starts(const ResidualFunction& function,
                                                  std::span<const FitParameter> parameters,
                                                  const std::vector<bool>& linear,
                                                  std::size_t count, std::size_t keep,
                                                  std::uint64_t seed) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    if (linear[i]) places.push_back(i);
  }
  std::vector<std::pair<double, std::vector<double>>> ranked;
  for (auto& start : latin_hypercube_starts(parameters, count, seed)) {
    double deviance = 0.0;
    std::vector<double> solved =
        projected(function, parameters, places, std::move(start), deviance);
    if (!solved.empty() && std::isfinite(deviance))
      ranked.emplace_back(deviance, std::move(solved));
  }
  std::ranges::stable_sort(ranked, [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::vector<double>> starts;
  for (auto& [deviance, start] : ranked) {
    if (starts.size() >= keep) break;
    starts.push_back(std::move(start));
  }
  if (starts.empty()) starts = latin_hypercube_starts(parameters, 1, seed);
  return starts;
}

namespace {

/// Estimated parameters in which the residuals are linear.
std::vector<bool> linear_parameters(const ExperimentResiduals& function) {
  std::vector<bool> linear(function.config().parameters.size());
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = function.linear_in(i);
  return linear;
}

/// Sum of squares; infinite where a start cannot be evaluated.
double squares_at(const ResidualFunction& function, const std::vector<double>& start) {
  Eigen::VectorXd residual;
  const bool usable = function.evaluate(start, residual, nullptr);
  const double squares = usable ? residual.squaredNorm() : std::numeric_limits<double>::infinity();
  return std::isfinite(squares) ? squares : std::numeric_limits<double>::infinity();
}

/// Points of a Latin hypercube that come nearer to the data than every given start, nearest first:
/// none, unless the search that gave those went astray.
std::vector<std::vector<double>> nearer_starts(const ResidualFunction& function,
                                               std::span<const FitParameter> parameters,
                                               const std::vector<std::vector<double>>& given,
                                               std::size_t count, std::uint64_t seed) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& start : given) least = std::min(least, squares_at(function, start));
  std::vector<std::pair<double, std::vector<double>>> ranked;
  for (auto& start : latin_hypercube_starts(parameters, count, seed)) {
    const double squares = squares_at(function, start);
    if (squares < least) ranked.emplace_back(squares, std::move(start));
  }
  std::ranges::stable_sort(ranked, [](const auto& a, const auto& b) { return a.first < b.first; });
  if (ranked.size() > kFollowed) ranked.resize(kFollowed);
  std::vector<std::vector<double>> starts;
  for (auto& [squares, start] : ranked) starts.push_back(std::move(start));
  return starts;
}

}  // namespace

StartKind start_kind(const ExperimentResiduals& function) {
  const std::vector<bool> linear = linear_parameters(function);
  const bool any = std::find(linear.begin(), linear.end(), true) != linear.end();
  return any || !function.config().given_starts.empty() ? StartKind::solved : StartKind::anywhere;
}

std::vector<std::vector<double>> fit_starts(const ExperimentResiduals& function,
                                            std::span<const FitParameter> parameters) {
  const FitConfig& config = function.config();
  const std::size_t count = std::max<std::size_t>(config.starts, 1);
  if (start_kind(function) == StartKind::anywhere) {
    return latin_hypercube_starts(parameters, count, config.seed);
  }
  std::vector<std::vector<double>> starts = config.given_starts;
  const std::vector<bool> linear = linear_parameters(function);
  if (std::ranges::find(linear, false) == linear.end()) {
    // One minimum, which the first start is solved for.
    return projected_starts(function, parameters, linear, 1, 1, config.seed);
  }
  if (std::ranges::find(linear, true) != linear.end()) {
    std::ranges::move(projected_starts(function, parameters, linear, count, kFollowed, config.seed),
                      std::back_inserter(starts));
  } else {
    std::ranges::move(nearer_starts(function, parameters, starts, count, config.seed),
                      std::back_inserter(starts));
  }
  // Sorted, so that equal laws are seen to be equal.
  for (auto& start : starts) function.exchange_order().sort(start);
  return starts;
}

std::vector<std::vector<double>> further_starts(const ExperimentResiduals& function,
                                                std::span<const FitParameter> parameters) {
  constexpr std::size_t kTimes = 4;
  const FitConfig& config = function.config();
  const std::vector<bool> linear = linear_parameters(function);
  if (std::ranges::find(linear, true) == linear.end()) return {};
  const std::size_t count = kTimes * std::max<std::size_t>(config.starts, 1);
  auto starts =
      projected_starts(function, parameters, linear, count, kTimes * kFollowed, config.seed + 1);
  for (auto& start : starts) function.exchange_order().sort(start);
  return starts;
}

}  // namespace tpm::fit
