#include "tpm/fit/uncertainty.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

double Threshold::residual_degrees() const {
  return std::max(data_count / inflation - parameter_count, 1.0);
}

double Threshold::variance_factor(double minimum_deviance) const {
  if (scale_known) return 1.0;
  if (noise) return std::max(noise->variance, least_variance);
  if (data_count <= parameter_count) {
    throw bad_input("noise",
                    fmt::format("the scale of the noise is to be estimated from {} data with {} "
                                "parameters",
                                data_count, parameter_count),
                    "more data than parameters, or a known scale");
  }
  return std::max(minimum_deviance / (inflation * residual_degrees()), least_variance);
}

double Threshold::rise(double minimum_deviance, int constrained) const {
  if (scale_known) {
    return inflation * chi_squared_quantile(level, constrained);
  }
  const double factor = inflation * variance_factor(minimum_deviance);
  return factor * constrained * fisher_quantile(level, constrained, residual_degrees());
}

double Threshold::rise_of(std::size_t parameter, double minimum_deviance) const {
  if (!noise || !(noise->of[parameter].variance_ratio > 0.0)) return rise(minimum_deviance);
  const NoiseOfEstimate& own = noise->of[parameter];
  const double students = std::sqrt(fisher_quantile(level, 1.0, own.degrees));
  const double half = students * std::sqrt(own.variance_ratio) + own.bias;
  return half * half;
}

double Threshold::multiplier_of(std::size_t parameter, double minimum_deviance) const {
  if (!noise || !(noise->of[parameter].variance_ratio > 0.0)) return multiplier(minimum_deviance);
  return std::sqrt(rise_of(parameter, minimum_deviance) / noise->of[parameter].variance_ratio);
}

double Threshold::multiplier(double minimum_deviance) const {
  const double variance = inflation * variance_factor(minimum_deviance);
  return std::sqrt(rise(minimum_deviance) / variance);
}

double Threshold::p_value(double rise, double minimum_deviance, int constrained) const {
  rise = std::max(rise, 0.0) / inflation;
  if (scale_known) {
    return chi_squared_tail(rise, constrained);
  }
  return fisher_tail(rise / variance_factor(minimum_deviance) / constrained, constrained,
                     residual_degrees());
}

Eigen::MatrixXd Covariance::theta_covariance() const {
  return theta_sd.asDiagonal() * correlation * theta_sd.asDiagonal();
}

Covariance linear_covariance(const ResidualFunction& function,
                             std::span<const FitParameter> parameters, const Minimum& minimum,
                             const Threshold& threshold) {
  Covariance c;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double value = minimum.natural[i];
    if (!parameters[i].at_lower(value) && !parameters[i].at_upper(value)) c.free.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(c.free.size());
  RowMatrix jacobian;
  if (n == 0 || !function.information_root(minimum.natural, jacobian)) return c;
  // Rows of zeros where there are fewer residuals than parameters: the unseen directions then have
  // their singular value, 0.
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(std::max(jacobian.rows(), n), n);
  Eigen::VectorXd length(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::size_t i = c.free[static_cast<std::size_t>(k)];
    const double slope = parameters[i].natural_slope(parameters[i].theta(minimum.natural[i]));
    j.col(k).head(jacobian.rows()) = jacobian.col(static_cast<Eigen::Index>(i)) * slope;
    length[k] = j.col(k).norm();
    if (length[k] > 0.0) j.col(k) /= length[k];
  }
  // Columns of length 1 make the rank decision independent of units.
  const RightSingular singular = right_singular(j);
  c.singular_values = singular.values;
  const Eigen::MatrixXd& v = singular.vectors;
  Eigen::VectorXd weakest = v.col(n - 1);
  for (Eigen::Index k = 0; k < n; ++k) {
    if (length[k] > 0.0) weakest[k] /= length[k];
  }
  c.weakest_direction = weakest.normalized();
  c.weakest_share = v.col(n - 1);
  constexpr double kRankTolerance = 1e-10;
  c.full_rank = length.minCoeff() > 0.0 && c.singular_values[n - 1] > kRankTolerance;
  if (!c.full_rank) return c;
  Eigen::MatrixXd covariance;
  if (threshold.noise && threshold.noise->free == c.free) {
    Eigen::VectorXd by_theta(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const std::size_t i = c.free[static_cast<std::size_t>(k)];
      by_theta[k] = 1.0 / parameters[i].natural_slope(parameters[i].theta(minimum.natural[i]));
    }
    covariance = by_theta.asDiagonal() * threshold.noise->covariance * by_theta.asDiagonal();
  } else {
    const Eigen::MatrixXd root = v * c.singular_values.cwiseInverse().asDiagonal();
    covariance = length.cwiseInverse().asDiagonal() * (root * root.transpose()) *
                 length.cwiseInverse().asDiagonal();
    if (threshold.estimable()) {
      covariance *= threshold.inflation * threshold.variance_factor(minimum.deviance);
    }
  }
  c.theta_sd = covariance.diagonal().cwiseSqrt();
  c.correlation =
      c.theta_sd.cwiseInverse().asDiagonal() * covariance * c.theta_sd.cwiseInverse().asDiagonal();
  return c;
}

namespace {

/// One side of a profile.
class ProfileWalk {
 public:
  ProfileWalk(const ResidualFunction& function, std::span<const FitParameter> parameters,
              const Minimum& minimum, double best_deviance, std::size_t index, double rise,
              double rounding)
      : function_(function),
        parameters_(parameters),
        minimum_(minimum),
        best_deviance_(best_deviance),
        index_(index),
        rise_(rise),
        rounding_(rounding),
        accuracy_(function.surrogate() == nullptr ? kLimitAccuracy : kCostlyLimitAccuracy),
        fixed_(parameters.size(), false) {
    fixed_[index] = true;
  }

  /// End of the walk; theta of the limit if it is one.
  struct End {
    ProfileEnd how;
    double theta;
  };

  /// @param direction +1 or -1 in theta
  /// @return nothing if a better minimum was met, which is then profile.better
  std::optional<End> run(int direction, double first_step, Profile& profile) {
    const FitParameter& p = parameters_[index_];
    const double bound = direction > 0 ? p.theta_upper() : p.theta_lower();
    double step = first_step;
    last_ = {p.theta(minimum_.natural[index_]), minimum_.deviance - best_deviance_,
             minimum_.natural};
    before_ = last_;
    constexpr int kMostMoves = 400;
    for (int steps = 0; (bound - last_.theta) * direction > 0.0; ++steps) {
      if (!(step > rounding_)) return End{ProfileEnd::rounding, last_.theta};
      if (steps == kMostMoves) return End{ProfileEnd::steps, last_.theta};
      double next = last_.theta + direction * step;
      if ((bound - next) * direction < 1e-3 * step) next = bound;
      const Minimum m = constrained(next, true);
      if (m.usable && !function_.exchange_order().is_sorted(m.natural)) {
        step *= 0.25;  // the search may have gone too far
        if (step > kLeastStep * first_step) continue;
        return End{ProfileEnd::exchange, last_.theta};
      }
      if (!m.usable) {
        ++profile.failures;
        step *= 0.25;
        if (step > kLeastStep * first_step) continue;
        profile.cut_short = true;
        return End{ProfileEnd::limit, last_.theta};
      }
      const double risen_next = m.deviance - best_deviance_;
      if (risen_next < -kBetterBy * (1.0 + best_deviance_)) {
        profile.better = m;
        return std::nullopt;
      }
      if (risen_next > 4.0 * rise_ && last_.risen < 0.5 * rise_ && step > 1e-6 * first_step) {
        step *= 0.25;  // too far to draw a profile from
        continue;
      }
      profile.points.push_back({m.natural[index_], m.deviance});
      if (risen_next < rise_) profile.inside.push_back(m);
      const double gained = risen_next - last_.risen;
      before_ = std::exchange(last_, {next, risen_next, m.natural});
      if (risen_next >= rise_) {
        const double limit = limit_between(before_, last_);
        note_bounds(before_.natural, profile);
        return End{ProfileEnd::limit, limit};
      }
      if (gained < 0.08 * rise_) step *= 2.0;
      if (gained > 0.35 * rise_) step *= 0.5;
    }
    return End{ProfileEnd::bound, bound};
  }

 private:
  static constexpr double kBetterBy = 1e-7;
  static constexpr double kLeastStep = 1e-3;  ///< of the first one, towards where the model ends

  /// A point of the profile.
  struct Place {
    double theta = 0.0;
    double risen = 0.0;
    std::vector<double> natural;
  };

  /// The other parameters where the line (in theta) through the two last points leads.
  std::vector<double> predicted(double theta) const {
    std::vector<double> start = last_.natural;
    const double run = last_.theta - before_.theta;
    const double share = run != 0.0 ? (theta - last_.theta) / run : 0.0;
    for (std::size_t i = 0; i < start.size(); ++i) {
      const FitParameter& p = parameters_[i];
      const double to = p.theta(last_.natural[i]);
      const double moved = share * (to - p.theta(before_.natural[i]));
      if (moved == 0.0 || !std::isfinite(moved)) continue;
      const double there = std::clamp(to + moved, p.theta_lower(), p.theta_upper());
      start[i] = std::clamp(p.natural(there), p.lower, p.upper);
    }
    return start;
  }

  /// The other parameters re-optimised, from where the profile leads and, because a profile may
  /// change valleys, from the unconstrained minimum.
  Minimum constrained(double theta, bool both_starts) const {
    const FitParameter& p = parameters_[index_];
    const double value = std::clamp(p.natural(theta), p.lower, p.upper);
    std::vector<double> start = predicted(theta);
    start[index_] = value;
    const ExchangeOrder& order = function_.exchange_order();
    const std::vector<FitParameter> bounded = order.bounds_around(parameters_, index_, value);
    Minimum m = minimise_near(function_, bounded, start, fixed_);
    if (both_starts && (!m.usable || m.deviance > best_deviance_ + rise_)) {
      start = minimum_.natural;
      start[index_] = value;
      const Minimum other = minimise_near(function_, bounded, start, fixed_);
      const bool deeper = other.usable && (!m.usable || other.deviance < m.deviance);
      if (deeper && order.is_sorted(other.natural)) m = other;
    }
    return m;
  }

  /// Notes the other parameters on a bound at the last point within the limit.
  void note_bounds(const std::vector<double>& natural, Profile& profile) const {
    for (std::size_t j = 0; j < natural.size(); ++j) {
      const bool upper = parameters_[j].at_upper(natural[j]);
      if (j == index_ || (!upper && !parameters_[j].at_lower(natural[j]))) continue;
      const LimitingBound bound{j, upper};
      auto& known = profile.limited_by;
      if (std::find(known.begin(), known.end(), bound) == known.end()) known.push_back(bound);
    }
  }

  double limit_between(const Place& inside, const Place& outside) {
    const std::array<Place, 2> ends{inside, outside};
    const double limit = root_between(ends[0], ends[1], false);
    // In another valley the deviance may be lower there: then the limit lies further out.
    std::vector<double> start = minimum_.natural;
    const FitParameter& p = parameters_[index_];
    start[index_] = std::clamp(p.natural(limit), p.lower, p.upper);
    const ExchangeOrder& order = function_.exchange_order();
    const Minimum other = minimise_near(
        function_, order.bounds_around(parameters_, index_, start[index_]), start, fixed_);
    const bool within = other.usable && other.deviance - best_deviance_ <= (1.0 - 1e-5) * rise_;
    if (!within || !order.is_sorted(other.natural)) return limit;
    return root_between(ends[0], ends[1], true);
  }

  /// sqrt(rise) is nearly linear in theta, which the root finder likes.
  double root_between(const Place& inside, const Place& outside, bool both_starts) {
    const double target = std::sqrt(rise_);
    const auto excess_of = [&](double risen) { return std::sqrt(std::max(risen, 0.0)) - target; };
    before_ = inside;
    last_ = outside;
    const auto excess = [&](double theta) {
      const Minimum m = constrained(theta, both_starts);
      if (!m.usable) return std::sqrt(std::numeric_limits<double>::max());
      Place here{theta, m.deviance - best_deviance_, m.natural};
      const double off = excess_of(here.risen);
      (here.risen < rise_ ? before_ : last_) = std::move(here);
      return std::abs(off) <= accuracy_ * target ? 0.0 : off;
    };
    const bool rising = inside.theta < outside.theta;
    const Place& low = rising ? inside : outside;
    const Place& high = rising ? outside : inside;
    const double f_low = excess_of(low.risen);
    const double f_high = excess_of(high.risen);
    if (f_low == 0.0) return low.theta;
    if (f_high == 0.0) return high.theta;
    const double width =
        accuracy_ * std::abs(outside.theta - parameters_[index_].theta(minimum_.natural[index_]));
    std::uintmax_t iterations = 60;
    const auto bracket = boost::math::tools::toms748_solve(
        excess, low.theta, high.theta, f_low, f_high,
        [width](double a, double b) { return std::abs(b - a) <= width; }, iterations);
    return 0.5 * (bracket.first + bracket.second);
  }

  static constexpr double kLimitAccuracy = 1e-7;  ///< of the distance from the minimum
  static constexpr double kCostlyLimitAccuracy = 1e-4;

  const ResidualFunction& function_;
  std::span<const FitParameter> parameters_;
  const Minimum& minimum_;
  double best_deviance_;
  std::size_t index_;
  double rise_;
  double rounding_;  ///< shorter steps in theta are no steps
  double accuracy_;  ///< of a limit, in parts of its distance from the minimum
  FixedMask fixed_;
  Place last_, before_;  ///< between which, or beyond which, the next point is looked for
};

/// @param multiplier half width of the linearised interval in standard errors
double first_step(const FitParameter& p, std::size_t index, const Covariance& covariance,
                  double multiplier) {
  const double width = p.theta_upper() - p.theta_lower();
  double step = std::isfinite(width) ? width / 50.0 : 0.1;
  if (!covariance.full_rank) return step;
  const auto place = std::find(covariance.free.begin(), covariance.free.end(), index);
  if (place == covariance.free.end()) return step;
  const double sd = covariance.theta_sd[place - covariance.free.begin()];
  const double from_sd = 0.3 * sd * multiplier;
  return std::isfinite(width) ? std::min(from_sd, width / 10.0) : from_sd;
}

/// Size of a step in theta that is of the order of the parameter itself.
double own_size(const FitParameter& p, double natural) {
  return p.scale == Scale::linear ? std::abs(natural) : 1.0;
}

/// Steps in theta below this one change the residuals by no more than rounding does, whatever the
/// parameter's unit: the residuals are differences of numbers about as large as the largest effect
/// that a parameter has on them.
double rounding_step(const ResidualFunction& function, std::span<const FitParameter> parameters,
                     const Minimum& minimum, std::size_t index) {
  constexpr double kRounding = 1e-13;
  constexpr double kOfBounds = 1e-3;
  const FitParameter& p = parameters[index];
  const double own = own_size(p, minimum.natural[index]);
  const auto length = [&](const RowMatrix& jacobian, std::size_t i) {
    const FitParameter& q = parameters[i];
    return jacobian.col(static_cast<Eigen::Index>(i)).norm() *
           std::abs(q.natural_slope(q.theta(minimum.natural[i])));
  };
  RowMatrix jacobian;
  if (function.information_root(minimum.natural, jacobian) && length(jacobian, index) > 0.0) {
    double effect = 0.0;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const double size = own_size(parameters[i], minimum.natural[i]);
      if (size > 0.0) effect = std::max(effect, size * length(jacobian, i));
    }
    return kRounding * std::max(own, effect / length(jacobian, index));
  }
  // Without an effect of its own: what its bounds say of its size.
  const double width = p.theta_upper() - p.theta_lower();
  return kRounding * std::max(own, std::isfinite(width) ? kOfBounds * width : 0.0);
}

/// A range of natural values, open where a bound was reached.
struct Range {
  std::optional<double> lower, upper;
};

/// Encloses both; tells whether they touch.
bool enclose(Range& all, const Range& other) {
  const bool apart = (all.upper && other.lower && *all.upper < *other.lower) ||
                     (other.upper && all.lower && *other.upper < *all.lower);
  all.lower = all.lower && other.lower ? std::optional<double>(std::min(*all.lower, *other.lower))
                                       : std::nullopt;
  all.upper = all.upper && other.upper ? std::optional<double>(std::max(*all.upper, *other.upper))
                                       : std::nullopt;
  return !apart;
}

}  // namespace

Profile profile_likelihood(const ResidualFunction& function,
                           std::span<const FitParameter> parameters,
                           std::span<const Minimum> minima, std::size_t index,
                           const Covariance& covariance, const Threshold& threshold) {
  const FitParameter& p = parameters[index];
  const double best = minima.front().deviance;
  const double rise = threshold.rise_of(index, best);
  const double step = first_step(p, index, covariance, threshold.multiplier_of(index, best));
  const double rounding = rounding_step(function, parameters, minima.front(), index);
  Profile profile;
  std::optional<Range> all;
  for (const Minimum& minimum : minima) {
    if (minimum.deviance - best >= rise) continue;
    profile.points.push_back({minimum.natural[index], minimum.deviance});
    ProfileWalk walk(function, parameters, minimum, best, index, rise, rounding);
    Range range;
    for (const int direction : {-1, +1}) {
      const auto end = walk.run(direction, step, profile);
      if (!end) return profile;
      const bool is_upper = (direction > 0) != p.reversed();
      ProfileEnd& known = is_upper ? profile.above : profile.below;
      // Of several minima a walk that failed, or went on to the bound, decides.
      known = std::max(known, end->how);
      if (end->how != ProfileEnd::limit) continue;
      (is_upper ? range.upper : range.lower) = p.natural(end->theta);
    }
    if (!all) {
      all = range;
    } else if (!enclose(*all, range)) {
      profile.connected = false;
    }
  }
  profile.lower = all->lower;
  profile.upper = all->upper;
  std::ranges::sort(profile.points, {}, &ProfilePoint::natural);
  return profile;
}

double profile_deviance(const ResidualFunction& function, std::span<const FitParameter> parameters,
                        std::span<const std::vector<double>> starts, std::size_t index,
                        double value) {
  FixedMask fixed(parameters.size(), false);
  fixed[index] = true;
  double least = std::numeric_limits<double>::infinity();
  for (std::vector<double> start : starts) {
    start[index] = value;
    const Minimum m = minimise_near(
        function, function.exchange_order().bounds_around(parameters, index, value), start, fixed);
    if (m.usable) least = std::min(least, m.deviance);
  }
  return least;
}

}  // namespace tpm::fit
