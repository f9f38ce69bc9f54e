#include "tpm/fit/starts.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace tpm {
namespace {

/// Starts that are followed to their end out of those that were looked at.
constexpr std::size_t kFollowed = 5;

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

/// The normal equations without bounds; false if they are near singular or the solution is not
/// within the bounds.
bool solve_within(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right,
                  const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Eigen::VectorXd& x) {
  if (!(gram.diagonal().minCoeff() > 0.0)) return false;
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * gram * scale.asDiagonal());
  constexpr double kLeastPivot = 1e-9;
  if (!(ldlt.vectorD().minCoeff() > kLeastPivot)) return false;
  x = scale.asDiagonal() * ldlt.solve(scale.asDiagonal() * right);
  return (x.array() >= lower.array()).all() && (x.array() <= upper.array()).all();
}

}  // namespace

Eigen::VectorXd bounded_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                      const Eigen::VectorXd& b, const Eigen::VectorXd& lower,
                                      const Eigen::VectorXd& upper) {
  const Eigen::Index n = a.cols();
  const Eigen::MatrixXd gram = a.transpose() * a;
  const Eigen::VectorXd right = a.transpose() * b;
  Eigen::VectorXd x(n);
  if (solve_within(gram, right, lower, upper, x)) return x;
  for (Eigen::Index k = 0; k < n; ++k) x[k] = std::clamp(0.0, lower[k], upper[k]);
  constexpr int kMostSweeps = 2000;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double moved = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (!(gram(k, k) > 0.0)) continue;
      const double free = x[k] + (right[k] - gram.row(k).dot(x)) / gram(k, k);
      const double next = std::clamp(free, lower[k], upper[k]);
      moved = std::max(moved, std::abs(next - x[k]) * std::sqrt(gram(k, k)));
      x[k] = next;
    }
    if (moved <= 1e-10 * (b.norm() + std::numeric_limits<double>::min())) break;
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
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::vector<double>> starts;
  for (auto& [deviance, start] : ranked) {
    if (starts.size() >= keep) break;
    starts.push_back(std::move(start));
  }
  if (starts.empty()) starts = latin_hypercube_starts(parameters, 1, seed);
  return starts;
}

namespace {

/// Which estimated parameters the residuals are linear in.
std::vector<bool> linear_parameters(const ExperimentResiduals& function) {
  const FitConfig& config = function.config();
  std::vector<bool> linear;
  linear.reserve(config.parameters.size());
  for (const EstimatedParameter& p : config.parameters) {
    linear.push_back(p.fit.scale == Scale::linear && !p.sets.empty() &&
                     std::all_of(p.sets.begin(), p.sets.end(), [&](const Target& target) {
                       return function.model().linear_in(target.parameter);
                     }));
  }
  return linear;
}

/// Branches can change places without changing the law: starts have them in the order of their
/// times, so that equal laws are seen to be equal.
void sort_branches(const FitConfig& config, std::vector<double>& start) {
  const auto place = [&](const std::string& name) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < config.parameters.size(); ++i) {
      if (config.parameters[i].fit.name == name) return i;
    }
    return std::nullopt;
  };
  const bool series = config.law->form == BranchForm::series;
  std::vector<std::pair<double, double>> branches;  // time, stiffness
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (int i = 1; i <= config.law->branches; ++i) {
    const auto time = place(fmt::format("{}{}", series ? "T" : "tau", i));
    const auto stiffness = place(fmt::format("{}{}", series ? "kc" : "k", i));
    if (!time || !stiffness) return;  // some are fixed: they keep their names
    places.emplace_back(*time, *stiffness);
    branches.emplace_back(start[*time], start[*stiffness]);
  }
  std::sort(branches.begin(), branches.end());
  for (std::size_t i = 0; i < places.size(); ++i) {
    start[places[i].first] = branches[i].first;
    start[places[i].second] = branches[i].second;
  }
}

}  // namespace

StartKind start_kind(const ExperimentResiduals& function) {
  const FitConfig& config = function.config();
  const bool linear_noise = std::all_of(config.data.begin(), config.data.end(), [](const auto& d) {
    return d.noise.kind != NoiseKind::log && d.noise.kind != NoiseKind::relative_to_model &&
           d.noise.shape == ErrorShape::normal && !d.estimates_sigma();
  });
  const std::vector<bool> linear = linear_parameters(function);
  const bool any = std::find(linear.begin(), linear.end(), true) != linear.end();
  return any && linear_noise && config.loss.kind == Loss::none ? StartKind::solved
                                                               : StartKind::anywhere;
}

std::vector<std::vector<double>> fit_starts(const ExperimentResiduals& function,
                                            std::span<const FitParameter> parameters) {
  const FitConfig& config = function.config();
  const std::size_t count = std::max<std::size_t>(config.starts, 1);
  if (start_kind(function) == StartKind::anywhere) {
    return latin_hypercube_starts(parameters, count, config.seed);
  }
  auto starts = projected_starts(function, parameters, linear_parameters(function), count,
                                 kFollowed, config.seed);
  if (config.law) {
    for (auto& start : starts) sort_branches(config, start);
  }
  return starts;
}

}  // namespace tpm
