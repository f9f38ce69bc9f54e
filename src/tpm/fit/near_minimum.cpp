// Declared in tpm/fit/likelihood/least_squares.hpp.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/fit/likelihood/surrogate_minimum.hpp"

namespace tpm::fit {
namespace {

constexpr double kFirstDamping = 1e-4;
constexpr double kLeastDamping = 1e-12;
constexpr double kMostDamping = 1e8;
constexpr double kLowerDamping = 0.1;  // the damping, after a step down
constexpr double kRaiseDamping = 8.0;  // after a step up
constexpr double kFarCorrection = 0.3;
constexpr double kRidge = 1e-12;  // keeps linear parameters that the data do not tell apart

/// Residuals and their derivatives by theta at a point of the search.
struct ThetaPoint {
  std::vector<double> natural;
  Eigen::VectorXd theta;
  Eigen::VectorXd r;
  RowMatrix jacobian;
  Eigen::MatrixXd gram;      ///< J' J
  Eigen::VectorXd gradient;  ///< J' r
  double cost = 0.0;
};

/// Gauss-Newton steps leave out the residuals' second derivatives. Where residuals do not vanish
/// and parameters trade off, that is most of the curvature: each step then gains a tenth of the
/// way, or is refused. What is left out is therefore learnt from the gradients.
///
/// Projected Levenberg-Marquardt over the parameters that the residuals are curved in, with those
/// that they are linear in solved for at each point (variable projection).
class NearSearch {
 public:
  NearSearch(const ResidualFunction& function, std::span<const FitParameter> parameters,
             std::span<const double> start, const FixedMask& fixed);

  /// True if the start can be evaluated.
  [[nodiscard]] bool begin();
  /// Goes on until it has converged or cannot go on.
  void run();
  [[nodiscard]] Minimum end() const;

 private:
  [[nodiscard]] bool evaluate(ThetaPoint& point) const;
  double solve_linear(ThetaPoint& point) const;
  [[nodiscard]] std::vector<Eigen::Index> movable() const;
  [[nodiscard]] std::optional<double> damped_step(const std::vector<Eigen::Index>& free);
  [[nodiscard]] Eigen::MatrixXd reduced_gram() const;
  void learn_curvature(const ThetaPoint& before);
  [[nodiscard]] bool try_step(const std::vector<Eigen::Index>& free);

  const ResidualFunction& function_;
  std::span<const FitParameter> parameters_;
  const FixedMask& fixed_;
  std::vector<Eigen::Index> linear_, curved_;
  ThetaPoint here_, next_;
  /// Part of the curvature of half the sum of squares beside J' J: r times second derivatives.
  Eigen::MatrixXd missing_;
  double damping_ = kFirstDamping;
  int iterations_ = 0;
  bool converged_ = false;
};

NearSearch::NearSearch(const ResidualFunction& function, std::span<const FitParameter> parameters,
                       std::span<const double> start, const FixedMask& fixed)
    : function_(function), parameters_(parameters), fixed_(fixed) {
  const auto n = std::ssize(parameters);
  here_.natural.assign(start.begin(), start.end());
  here_.theta.resize(n);
  missing_.setZero(n, n);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const FitParameter& p = parameters[i];
    const bool free = fixed.empty() || !fixed[i];
    if (free) here_.natural[i] = std::clamp(start[i], p.lower, p.upper);
    here_.theta[static_cast<Eigen::Index>(i)] = p.theta(here_.natural[i]);
    if (free) (function.linear_in(i) ? linear_ : curved_).push_back(static_cast<Eigen::Index>(i));
  }
}

bool NearSearch::evaluate(ThetaPoint& point) const {
  if (!function_.evaluate(point.natural, point.r, &point.jacobian)) return false;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    if (parameters_[i].scale == Scale::linear) continue;
    point.jacobian.col(column) *= parameters_[i].natural_slope(point.theta[column]);
  }
  point.cost = point.r.squaredNorm();
  point.gram.noalias() = point.jacobian.transpose() * point.jacobian;
  point.gradient.noalias() = point.jacobian.transpose() * point.r;
  return std::isfinite(point.cost) && point.gram.allFinite();
}

/// Returns the length of the change that it makes to the residuals.
double NearSearch::solve_linear(ThetaPoint& point) const {
  if (linear_.empty()) return 0.0;
  const auto n = std::ssize(linear_);
  Eigen::VectorXd lower(n);
  Eigen::VectorXd upper(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index p = linear_[static_cast<std::size_t>(i)];
    lower[i] = parameters_[static_cast<std::size_t>(p)].lower - point.theta[p];
    upper[i] = parameters_[static_cast<std::size_t>(p)].upper - point.theta[p];
  }
  const Eigen::VectorXd x =
      bounded_minimum(point.gram(linear_, linear_), -point.gradient(linear_), lower, upper);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(point.theta.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index p = linear_[static_cast<std::size_t>(i)];
    const FitParameter& q = parameters_[static_cast<std::size_t>(p)];
    change[p] = x[i];
    const double to = point.theta[p] + x[i];
    point.theta[p] = x[i] <= lower[i] ? q.lower : x[i] >= upper[i] ? q.upper : to;
    point.natural[static_cast<std::size_t>(p)] = point.theta[p];
  }
  const Eigen::VectorXd pull = point.gram * change;
  point.r += point.jacobian * change;
  point.gradient += pull;
  point.cost = point.r.squaredNorm();
  return std::sqrt(std::max(change.dot(pull), 0.0));
}

std::vector<Eigen::Index> NearSearch::movable() const {
  std::vector<Eigen::Index> free;
  free.reserve(parameters_.size());
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (!fixed_.empty() && fixed_[i]) continue;
    const auto k = static_cast<Eigen::Index>(i);
    const double theta = here_.theta[k];
    const double pull = here_.gradient[k];
    const bool outward = (theta <= parameters_[i].theta_lower() && pull > 0.0) ||
                         (theta >= parameters_[i].theta_upper() && pull < 0.0);
    if (!outward) free.push_back(k);
  }
  return free;
}

/// Puts next_ a damped step away; nothing where the damping is too weak for a descent. Returns the
/// length of the change that the step makes to the residuals: a step along a direction that the
/// data do not see is short.
std::optional<double> NearSearch::damped_step(const std::vector<Eigen::Index>& free) {
  const Eigen::VectorXd norm2 = here_.gram.diagonal()(free);
  const Eigen::VectorXd scale =
      (norm2.array() > 0.0).select(norm2.array().sqrt().inverse(), 0.0).matrix();
  const Eigen::MatrixXd curvature = here_.gram + missing_;
  Eigen::MatrixXd a = scale.asDiagonal() * curvature(free, free) * scale.asDiagonal();
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    if (scale[i] == 0.0) a(i, i) = 1.0;
    const bool is_linear = std::find(linear_.begin(), linear_.end(),
                                     free[static_cast<std::size_t>(i)]) != linear_.end();
    a(i, i) += is_linear ? kRidge : damping_;
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(a);
  if (a.rows() > 0 && !(ldlt.vectorD().minCoeff() > 0.0)) return std::nullopt;
  const Eigen::VectorXd step =
      scale.asDiagonal() * ldlt.solve(-(scale.asDiagonal() * here_.gradient(free)));
  next_.theta = here_.theta;
  next_.natural = here_.natural;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const Eigen::Index p = free[i];
    const FitParameter& parameter = parameters_[static_cast<std::size_t>(p)];
    next_.theta[p] = std::clamp(here_.theta[p] + step[static_cast<Eigen::Index>(i)],
                                parameter.theta_lower(), parameter.theta_upper());
    next_.natural[static_cast<std::size_t>(p)] =
        std::clamp(parameter.natural(next_.theta[p]), parameter.lower, parameter.upper);
  }
  const Eigen::VectorXd moved = next_.theta - here_.theta;
  const double by_gram = moved.dot(here_.gram * moved);
  return std::sqrt(std::max({by_gram, by_gram + moved.dot(missing_ * moved), 0.0}));
}

/// J' J of the curved parameters while the linear ones follow them, as far as their bounds let
/// them.
Eigen::MatrixXd NearSearch::reduced_gram() const {
  Eigen::MatrixXd reduced = here_.gram(curved_, curved_);
  std::vector<Eigen::Index> inside;
  for (const Eigen::Index p : linear_) {
    const FitParameter& q = parameters_[static_cast<std::size_t>(p)];
    const bool within = here_.theta[p] > q.lower && here_.theta[p] < q.upper;
    if (within && here_.gram(p, p) > 0.0) inside.push_back(p);
  }
  if (inside.empty()) return reduced;
  const Eigen::VectorXd scale = here_.gram.diagonal()(inside).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd block = scale.asDiagonal() * here_.gram(inside, inside) * scale.asDiagonal();
  block.diagonal().array() += kRidge;
  const Eigen::MatrixXd cross = scale.asDiagonal() * here_.gram(inside, curved_);
  reduced -= cross.transpose() * block.ldlt().solve(cross);
  return reduced;
}

/// A symmetric update of rank one, so that the gradient's change over the step is told; before it
/// what was learnt elsewhere is shortened where it tells too much (Dennis, Gay, Welsch 1981).
void NearSearch::learn_curvature(const ThetaPoint& before) {
  constexpr double kUndefined = 1e-8;
  if (curved_.empty()) return;
  const Eigen::VectorXd step = here_.theta(curved_) - before.theta(curved_);
  const Eigen::VectorXd change = here_.gradient(curved_) - before.gradient(curved_);
  const Eigen::VectorXd wanted = change - reduced_gram() * step;
  Eigen::MatrixXd known = missing_(curved_, curved_);
  const double told = std::abs(step.dot(known * step));
  const double seen = std::abs(step.dot(wanted));
  if (told > seen) known *= seen / told;
  const Eigen::VectorXd off = wanted - known * step;
  const double along = off.dot(step);
  // Each parameter in units of what it does to the residuals: the test knows no units.
  Eigen::VectorXd length = here_.gram.diagonal()(curved_).cwiseSqrt();
  length = (length.array() > 0.0).select(length.array(), 1.0).matrix();
  const double off_norm = off.cwiseQuotient(length).norm();
  if (std::abs(along) > kUndefined * off_norm * step.cwiseProduct(length).norm()) {
    known += off * off.transpose() / along;
  }
  missing_(curved_, curved_) = known;
}

/// One step from here_; tells whether the search has moved or has ended.
bool NearSearch::try_step(const std::vector<Eigen::Index>& free) {
  constexpr double kSmallStep = 1e-4;  // of sigma: 1e-8 of the deviance's natural unit
  const auto length = damped_step(free);
  if (!length) {
    damping_ = std::max(damping_ * kRaiseDamping, kFirstDamping);
    return false;
  }
  ++iterations_;
  const double sigma = std::sqrt(here_.cost / static_cast<double>(here_.r.size()));
  const bool evaluated = evaluate(next_);
  const double corrected = evaluated ? solve_linear(next_) : 0.0;
  const bool accepted = evaluated && next_.cost <= here_.cost;
  converged_ = *length <= kSmallStep * sigma && damping_ < 1e-2;
  damping_ =
      accepted ? std::max(damping_ * kLowerDamping, kLeastDamping) : damping_ * kRaiseDamping;
  if (!accepted) return converged_;
  std::swap(here_, next_);
  if (converged_) return true;
  // The derivatives were taken before the linear parameters were solved for.
  if (corrected > kFarCorrection * *length && !evaluate(here_)) return true;
  learn_curvature(next_);
  return true;
}

bool NearSearch::begin() {
  if (!evaluate(here_)) return false;
  if (!(solve_linear(here_) > 0.0)) return true;
  return evaluate(here_);
}

void NearSearch::run() {
  constexpr int kMostIterations = 200;
  while (!converged_ && iterations_ < kMostIterations && damping_ < kMostDamping) {
    const auto free = movable();
    while (damping_ < kMostDamping && !try_step(free)) {
    }
  }
  // However short the step, the sum of squares no longer falls: rounding has the last word.
  converged_ = converged_ || damping_ >= kMostDamping;
}

Minimum NearSearch::end() const {
  Minimum minimum;
  minimum.natural = here_.natural;
  minimum.deviance = here_.cost - function_.offset();
  minimum.usable = std::isfinite(here_.cost);
  minimum.converged = converged_;
  minimum.iterations = iterations_;
  minimum.message =
      converged_ ? "projected Levenberg-Marquardt: no step changes the residuals by 1e-4 sigma"
                 : "projected Levenberg-Marquardt: out of iterations in a flat valley";
  return minimum;
}

}  // namespace

Minimum minimise_near(const ResidualFunction& function, std::span<const FitParameter> parameters,
                      std::span<const double> start, const FixedMask& fixed) {
  if (const ResidualFunction* surrogate = function.surrogate()) {
    return minimise_by_surrogate(function, *surrogate, parameters, start, fixed);
  }
  NearSearch search(function, parameters, start, fixed);
  if (!search.begin()) return minimise(function, parameters, start, fixed);
  search.run();
  return search.end();
}

}  // namespace tpm::fit
