#include "tpm/fit/likelihood/least_squares.hpp"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/likelihood/surrogate_minimum.hpp"

namespace tpm::fit {
namespace {

/// Ceres reports refused steps through glog on standard error; the caller hears of them through
/// Minimum::message instead.
void keep_ceres_quiet() {
  static std::once_flag once;
  std::call_once(once, [] { FLAGS_minloglevel = google::GLOG_FATAL; });
}

/// Unit in which the search sees a parameter, a power of 2 so that it adds no rounding: its
/// tolerances are absolute, or compare parameters with each other. 1 where theta has no unit.
double search_unit(const FitParameter& p, double theta) {
  constexpr double kOfBounds = 1e-3;
  if (p.scale != Scale::linear) return 1.0;
  const double width = p.theta_upper() - p.theta_lower();
  const double size = std::max(std::abs(theta), std::isfinite(width) ? kOfBounds * width : 0.0);
  return size > 0.0 ? std::exp2(std::round(std::log2(size))) : 1.0;
}

/// The residuals as a function of the free thetas only, each in its unit.
class FreeThetaCost final : public ceres::CostFunction {
 public:
  FreeThetaCost(const ResidualFunction& function, std::span<const FitParameter> parameters,
                std::vector<std::size_t> free, std::vector<double> units,
                std::vector<double> natural)
      : function_(function),
        parameters_(parameters),
        free_(std::move(free)),
        units_(std::move(units)),
        natural_(std::move(natural)) {
    set_num_residuals(static_cast<int>(function.residual_count()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(free_.size()));
  }

  bool Evaluate(double const* const* theta, double* residuals, double** jacobians) const override {
    std::vector<double> natural = natural_;
    for (std::size_t j = 0; j < free_.size(); ++j) {
      const FitParameter& p = parameters_[free_[j]];
      natural[free_[j]] = std::clamp(p.natural(theta[0][j] * units_[j]), p.lower, p.upper);
    }
    const bool want_jacobian = jacobians != nullptr && jacobians[0] != nullptr;
    Eigen::VectorXd r;
    RowMatrix d;
    if (!function_.evaluate(natural, r, want_jacobian ? &d : nullptr)) return false;
    std::copy(r.data(), r.data() + r.size(), residuals);
    if (!want_jacobian) return true;
    Eigen::Map<RowMatrix> out(jacobians[0], r.size(), static_cast<Eigen::Index>(free_.size()));
    for (std::size_t j = 0; j < free_.size(); ++j) {
      const double slope = parameters_[free_[j]].natural_slope(theta[0][j] * units_[j]) * units_[j];
      out.col(static_cast<Eigen::Index>(j)) = d.col(static_cast<Eigen::Index>(free_[j])) * slope;
    }
    return true;
  }

 private:
  const ResidualFunction& function_;
  std::span<const FitParameter> parameters_;
  std::vector<std::size_t> free_;
  std::vector<double> units_;
  std::vector<double> natural_;
};

ceres::Solver::Options solver_options(FirstStep first_step) {
  ceres::Solver::Options options;
  options.initial_trust_region_radius = first_step == FirstStep::bold ? 1e4 : 10.0;
  options.minimizer_type = ceres::TRUST_REGION;
  options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  options.max_num_iterations = 2000;
  options.max_num_consecutive_invalid_steps = 20;
  options.function_tolerance = 1e-16;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  return options;
}

}  // namespace

const ExchangeOrder& ResidualFunction::exchange_order() const {
  static const ExchangeOrder kNone;
  return kNone;
}

Eigen::VectorXd theta_of(std::span<const FitParameter> parameters,
                         std::span<const double> natural) {
  Eigen::VectorXd theta(std::ssize(parameters));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    theta[static_cast<Eigen::Index>(i)] = parameters[i].theta(natural[i]);
  }
  return theta;
}

Eigen::VectorXd natural_slopes(std::span<const FitParameter> parameters,
                               const Eigen::VectorXd& theta) {
  Eigen::VectorXd slope(theta.size());
  for (Eigen::Index i = 0; i < slope.size(); ++i) {
    slope[i] = parameters[static_cast<std::size_t>(i)].natural_slope(theta[i]);
  }
  return slope;
}

bool KnownPoint::evaluate(const ResidualFunction& function,
                          std::span<const FitParameter> parameters) {
  if (!function.evaluate(natural, residual, &jacobian)) return false;
  theta = theta_of(parameters, natural);
  jacobian = jacobian * natural_slopes(parameters, theta).asDiagonal();
  return std::isfinite(cost()) && jacobian.allFinite();
}

double deviance_at(const ResidualFunction& function, std::span<const double> natural) {
  Eigen::VectorXd r;
  if (!function.evaluate(natural, r, nullptr)) return std::numeric_limits<double>::quiet_NaN();
  return r.squaredNorm() - function.offset();
}

namespace {

/// One Ceres run over the parameters in `free`, from and to `minimum.natural`.
void descend(const ResidualFunction& function, std::span<const FitParameter> parameters,
             const std::vector<std::size_t>& free, FirstStep first_step, Minimum& minimum) {
  std::vector<double> theta;
  std::vector<double> units;
  theta.reserve(free.size());
  units.reserve(free.size());
  for (const std::size_t i : free) {
    const double start = parameters[i].theta(minimum.natural[i]);
    units.push_back(search_unit(parameters[i], start));
    theta.push_back(start / units.back());
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new FreeThetaCost(function, parameters, free, units, minimum.natural),
                           nullptr, theta.data());
  for (std::size_t j = 0; j < free.size(); ++j) {
    const FitParameter& p = parameters[free[j]];
    const int index = static_cast<int>(j);
    if (std::isfinite(p.theta_lower())) {
      problem.SetParameterLowerBound(theta.data(), index, p.theta_lower() / units[j]);
    }
    if (std::isfinite(p.theta_upper())) {
      problem.SetParameterUpperBound(theta.data(), index, p.theta_upper() / units[j]);
    }
  }
  ceres::Solver::Options options = solver_options(first_step);
  // Ceres does not write back the better point when it ends in FAILURE: keep the state current.
  options.update_state_every_iteration = true;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t j = 0; j < free.size(); ++j) {
    const FitParameter& p = parameters[free[j]];
    minimum.natural[free[j]] = std::clamp(p.natural(theta[j] * units[j]), p.lower, p.upper);
  }
  minimum.iterations += static_cast<int>(summary.iterations.size());
  minimum.converged = summary.termination_type == ceres::CONVERGENCE;
  minimum.message = summary.message;
}

/// Candidates that a descent would push through a bound; none if that is undetermined.
FixedMask pressed_against_bound(const ResidualFunction& function,
                                std::span<const FitParameter> parameters,
                                const std::vector<double>& natural, const FixedMask& fixed) {
  FixedMask pressed(parameters.size(), false);
  Eigen::VectorXd r;
  RowMatrix jacobian;
  if (!function.evaluate(natural, r, &jacobian)) return pressed;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const FitParameter& p = parameters[i];
    if (!fixed.empty() && fixed[i]) continue;
    const double slope = p.natural_slope(p.theta(natural[i]));
    const double gradient = jacobian.col(static_cast<Eigen::Index>(i)).dot(r) * slope;
    const bool at_theta_lower = p.reversed() ? p.at_upper(natural[i]) : p.at_lower(natural[i]);
    const bool at_theta_upper = p.reversed() ? p.at_lower(natural[i]) : p.at_upper(natural[i]);
    pressed[i] = (at_theta_lower && gradient > 0.0) || (at_theta_upper && gradient < 0.0);
  }
  return pressed;
}

/// Puts pressed parameters exactly on their bound.
void snap_to_bounds(std::span<const FitParameter> parameters, const FixedMask& pressed,
                    std::vector<double>& natural) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!pressed[i]) continue;
    natural[i] = parameters[i].at_lower(natural[i]) ? parameters[i].lower : parameters[i].upper;
  }
}

/// Gauss-Newton steps from the end of a descent: a descent decides by the sum of squares, which is
/// flat to rounding while the parameters still have half their digits to gain. Stops when steps no
/// longer shrink, leave the bounds or raise the sum of squares beyond rounding.
void polish(const ResidualFunction& function, std::span<const FitParameter> parameters,
            const std::vector<std::size_t>& free, std::vector<double>& natural) {
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd r;
  RowMatrix jacobian;
  double last_step = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < 20; ++iteration) {
    if (!function.evaluate(natural, r, &jacobian)) return;
    Eigen::MatrixXd j(r.size(), n);
    Eigen::VectorXd length(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::size_t i = free[static_cast<std::size_t>(k)];
      j.col(k) = jacobian.col(static_cast<Eigen::Index>(i)) *
                 parameters[i].natural_slope(parameters[i].theta(natural[i]));
      length[k] = j.col(k).norm();
      if (!(length[k] > 0.0)) return;
      j.col(k) /= length[k];
    }
    const std::optional<Eigen::MatrixXd> best = unique_least_squares(j, r);
    if (!best) return;
    const Eigen::VectorXd scaled = -best->col(0);
    const double step = scaled.norm();
    if (!(step < 0.5 * last_step) || !(step > 0.0)) return;
    last_step = step;
    std::vector<double> next = natural;
    for (Eigen::Index k = 0; k < n; ++k) {
      const FitParameter& p = parameters[free[static_cast<std::size_t>(k)]];
      double& value = next[free[static_cast<std::size_t>(k)]];
      value = p.natural(p.theta(value) + scaled[k] / length[k]);
      if (!(value >= p.lower && value <= p.upper)) return;
    }
    Eigen::VectorXd r_next;
    const bool usable = function.evaluate(next, r_next, nullptr);
    if (!usable || r_next.squaredNorm() > r.squaredNorm() * (1.0 + 1e-10)) return;
    natural = std::move(next);
  }
}

}  // namespace

Minimum minimise(const ResidualFunction& function, std::span<const FitParameter> parameters,
                 std::span<const double> start, const FixedMask& fixed, FirstStep first_step) {
  if (const ResidualFunction* surrogate = function.surrogate()) {
    return minimise_by_surrogate(function, *surrogate, parameters, start, fixed);
  }
  keep_ceres_quiet();
  Minimum minimum;
  minimum.natural.assign(start.begin(), start.end());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!fixed.empty() && fixed[i]) continue;
    minimum.natural[i] = std::clamp(minimum.natural[i], parameters[i].lower, parameters[i].upper);
  }
  // Ceres cuts each step at the bounds, which makes the other parameters creep while one of them
  // presses against its bound. So the pressed ones are fixed and the rest is solved again, until
  // the set of pressed parameters stays the same.
  FixedMask held(parameters.size(), false);
  std::vector<std::size_t> free;
  constexpr int kMostRounds = 12;
  for (int round = 0; round < kMostRounds; ++round) {
    free.clear();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (!held[i] && (fixed.empty() || !fixed[i])) free.push_back(i);
    }
    if (free.empty()) {
      minimum.converged = true;
      minimum.message = "nothing to estimate, or every parameter at a bound";
    } else {
      descend(function, parameters, free, first_step, minimum);
    }
    const FixedMask pressed = pressed_against_bound(function, parameters, minimum.natural, fixed);
    snap_to_bounds(parameters, pressed, minimum.natural);
    if (pressed == held) break;
    held = pressed;
    if (round + 1 == kMostRounds) minimum.converged = false;
  }
  if (minimum.converged && !free.empty()) polish(function, parameters, free, minimum.natural);
  minimum.deviance = deviance_at(function, minimum.natural);
  minimum.usable = std::isfinite(minimum.deviance);
  return minimum;
}

std::vector<std::vector<double>> latin_hypercube_starts(std::span<const FitParameter> parameters,
                                                        std::size_t count, std::uint64_t seed) {
  std::vector<std::vector<double>> starts(count, std::vector<double>(parameters.size()));
  if (count == 0) return starts;
  Random random(seed);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const FitParameter& p = parameters[i];
    starts[0][i] = p.start;
    std::vector<std::size_t> stratum(count - 1);
    std::iota(stratum.begin(), stratum.end(), std::size_t{0});
    for (std::size_t k = stratum.size(); k > 1; --k) {
      std::swap(stratum[k - 1], stratum[random.below(k)]);
    }
    for (std::size_t k = 1; k < count; ++k) {
      const double share =
          (static_cast<double>(stratum[k - 1]) + random.uniform()) / static_cast<double>(count - 1);
      // An unbounded linear parameter is searched around its start.
      const double low =
          std::isfinite(p.lower) ? p.lower : p.start - 10.0 * (std::abs(p.start) + 1.0);
      const double high =
          std::isfinite(p.upper) ? p.upper : p.start + 10.0 * (std::abs(p.start) + 1.0);
      starts[k][i] =
          p.scale == Scale::linear ? low + share * (high - low) : low * std::pow(high / low, share);
      starts[k][i] = std::clamp(starts[k][i], p.lower, p.upper);
    }
  }
  return starts;
}

}  // namespace tpm::fit
