#include "tpm/fit/predict/organ_profile.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace tpm::fit {
namespace {

constexpr double kEnough = 1e-3;       // of the threshold: a step that promises less is not taken
constexpr double kLimitWithin = 5e-3;  // of the square root of the threshold
constexpr double kDeeper = 1e-3;       // of the threshold, below the minimum
constexpr int kMostProfileSteps = 15;  // of one constrained fit
constexpr int kMostPoints = 16;        // on one side
constexpr int kMostRetreats = 6;       // from where the model ends
constexpr double kFirstProfileDamping = 1e-3;
constexpr double kMostProfileDamping = 1e6;

class ShortWalk {
 public:
  ShortWalk(const ResidualFunction& function, std::span<const FitParameter> parameters,
            const Minimum& best, std::size_t index, double rise)
      : function_(function), parameters_(parameters), best_(best), index_(index), rise_(rise) {}

  /// @param direction +1 or -1 in theta
  void run(int direction, double half_width, Profile& profile, ProfileEnd& end,
           std::optional<double>& limit) {
    const FitParameter& p = parameters_[index_];
    const double from = p.theta(best_.natural[index_]);
    const double bound = direction > 0 ? p.theta_upper() : p.theta_lower();
    const double room = (bound - from) * direction;
    Place inside{0.0, 0.0, best_.natural}, before = inside;
    std::optional<Place> outside;
    double next = std::min(0.5 * half_width, room);
    int retreats = 0;
    end = ProfileEnd::steps;
    for (int i = 0; i < kMostPoints && room > 0.0; ++i) {
      const auto point = constrained(from + direction * next, predicted(before, inside, next));
      if (!point) {
        ++profile.failures;
        if (++retreats > kMostRetreats) {
          profile.cut_short = true;
          return close(from + direction * inside.way, end, limit);
        }
        next = 0.5 * (inside.way + next);
        continue;
      }
      const double risen = point->cost() - function_.offset() - best_.deviance;
      if (risen < -kDeeper * rise_) {
        profile.better = minimum_at(*point);
        return;
      }
      profile.points.push_back({point->natural[index_], best_.deviance + std::max(risen, 0.0)});
      const Place here{next, std::sqrt(std::max(risen, 0.0) / rise_), point->natural};
      if (std::abs(here.height - 1.0) <= kLimitWithin) {
        return close(from + direction * next, end, limit);
      }
      if (here.height > 1.0) {
        outside = here;
      } else {
        if (next >= room) {
          end = ProfileEnd::bound;
          return;
        }
        before = inside;
        inside = here;
      }
      next = std::min(outside ? between(inside, *outside) : beyond(before, inside), room);
    }
    if (!(room > 0.0)) end = ProfileEnd::bound;
    // Bracketed all the same: the limit lies between the two.
    if (outside) close(from + direction * between(inside, *outside), end, limit);
  }

 private:
  /// A point of the profile: how far it lies from the minimum, and the square root of its rise over
  /// the threshold.
  struct Place {
    double way = 0.0, height = 0.0;
    std::vector<double> natural;
  };

  void close(double theta, ProfileEnd& end, std::optional<double>& limit) const {
    end = ProfileEnd::limit;
    limit = parameters_[index_].natural(theta);
  }

  static double between(const Place& inside, const Place& outside) {
    constexpr double kInner = 0.1;
    const double share = (1.0 - inside.height) / (outside.height - inside.height);
    return inside.way + std::clamp(share, kInner, 1.0 - kInner) * (outside.way - inside.way);
  }

  static double beyond(const Place& before, const Place& inside) {
    constexpr double kMostGrowth = 2.5;
    const double slope = (inside.height - before.height) / (inside.way - before.way);
    const double ahead =
        slope > 0.0 ? inside.way + 1.02 * (1.0 - inside.height) / slope : kMostGrowth * inside.way;
    return std::min(ahead, kMostGrowth * inside.way);
  }

  /// The parameters where the line through two places leads.
  [[nodiscard]] std::vector<double> predicted(const Place& before, const Place& inside,
                                              double way) const {
    std::vector<double> natural = inside.natural;
    if (!(inside.way > before.way)) return natural;
    const double share = (way - inside.way) / (inside.way - before.way);
    for (std::size_t i = 0; i < natural.size(); ++i) {
      const FitParameter& p = parameters_[i];
      const double to = p.theta(inside.natural[i]);
      const double theta = to + share * (to - p.theta(before.natural[i]));
      natural[i] = p.natural(std::clamp(theta, p.theta_lower(), p.theta_upper()));
    }
    return natural;
  }

  /// A damped Gauss-Newton step within the bounds, the profiled parameter fixed.
  [[nodiscard]] KnownPoint step_from(const KnownPoint& here, double damping) const {
    const Eigen::VectorXd gradient = here.jacobian.transpose() * here.residual;
    std::vector<Eigen::Index> free;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const FitParameter& p = parameters_[i];
      const bool outward = (here.theta[k] <= p.theta_lower() && gradient[k] > 0.0) ||
                           (here.theta[k] >= p.theta_upper() && gradient[k] < 0.0);
      if (i != index_ && !outward) free.push_back(k);
    }
    const Eigen::MatrixXd j = here.jacobian(Eigen::all, free);
    Eigen::VectorXd length = j.colwise().norm().transpose();
    length = (length.array() > 0.0).select(length, 1.0);
    const Eigen::MatrixXd unit = j * length.cwiseInverse().asDiagonal();
    constexpr double kRidge = 1e-10;
    Eigen::MatrixXd gram = unit.transpose() * unit;
    gram.diagonal().array() += damping + kRidge;
    const Eigen::VectorXd step =
        -length.cwiseInverse().cwiseProduct(gram.ldlt().solve(unit.transpose() * here.residual));
    KnownPoint next;
    next.natural = here.natural;
    next.theta = here.theta;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto k = static_cast<std::size_t>(free[i]);
      const FitParameter& p = parameters_[k];
      next.theta[free[i]] = std::clamp(here.theta[free[i]] + step[static_cast<Eigen::Index>(i)],
                                       p.theta_lower(), p.theta_upper());
      next.natural[k] = std::clamp(p.natural(next.theta[free[i]]), p.lower, p.upper);
    }
    return next;
  }

  /// The others fitted again; nothing where the model cannot be evaluated.
  [[nodiscard]] std::optional<KnownPoint> constrained(double theta,
                                                      std::vector<double> start) const {
    const FitParameter& p = parameters_[index_];
    KnownPoint here;
    here.natural = std::move(start);
    here.natural[index_] = std::clamp(p.natural(theta), p.lower, p.upper);
    if (!here.evaluate(function_, parameters_)) return std::nullopt;
    double damping = 0.0;
    for (int i = 0; i < kMostProfileSteps && damping <= kMostProfileDamping; ++i) {
      KnownPoint next = step_from(here, damping);
      const double promised =
          here.cost() - (here.residual + here.jacobian * (next.theta - here.theta)).squaredNorm();
      if (promised <= kEnough * rise_ && damping <= kFirstProfileDamping) break;
      if (next.evaluate(function_, parameters_) && next.cost() < here.cost()) {
        here = std::move(next);
        damping = damping > kFirstProfileDamping ? 0.1 * damping : 0.0;
      } else {
        damping = std::max(10.0 * damping, kFirstProfileDamping);
      }
    }
    return here;
  }

  [[nodiscard]] Minimum minimum_at(const KnownPoint& point) const {
    Minimum m;
    m.natural = point.natural;
    m.deviance = point.cost() - function_.offset();
    m.usable = true;
    return m;
  }

  const ResidualFunction& function_;
  std::span<const FitParameter> parameters_;
  const Minimum& best_;
  std::size_t index_;
  double rise_;
};

}  // namespace

Profile short_profile(const ResidualFunction& function, std::span<const FitParameter> parameters,
                      const Minimum& best, std::size_t index, double half_width, double rise) {
  Profile profile;
  ShortWalk walk(function, parameters, best, index, rise);
  profile.points.push_back({best.natural[index], best.deviance});
  walk.run(-1, half_width, profile, profile.below, profile.lower);
  if (!profile.better) walk.run(+1, half_width, profile, profile.above, profile.upper);
  std::ranges::sort(profile.points, {}, &ProfilePoint::natural);
  return profile;
}

}  // namespace tpm::fit
