#include "gradient_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Half decades: where truncation is of second order it falls tenfold from step to step.
constexpr std::array kSteps{3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7};
/// From this step down, what finite differences differ by is rounding or noise, not truncation.
constexpr double kNoiseStep = 1e-4;
/// A residual's derivative is compared with its own size plus this share of the column's largest,
/// so that derivatives that pass through zero do not count as infinitely wrong.
constexpr double kFloorOfColumn = 1e-3;
/// Derivatives below this share of the largest residual drown in rounding.
constexpr double kFloorOfResidual = 1e-9;
/// A derivative that the finite differences know no better than this is undecided.
constexpr double kMostSpread = 0.05;
/// A difference counts as real from this multiple of the spread on.
constexpr double kSpreadFactor = 3.0;

/// Size of a parameter that steps are relative to.
double typical_size(const FitParameter& p, double natural) {
  if (p.scale != Scale::linear) return natural;
  const double width = p.upper - p.lower;
  const double least = std::isfinite(width) ? 1e-2 * width : std::abs(p.start);
  const double size = std::max(std::abs(natural), least);
  return size > 0.0 ? size : 1.0;
}

/// Finite differences of the residuals by one parameter, in units of its size.
class ColumnDifferences {
 public:
  ColumnDifferences(const ResidualFunction& function, const FitParameter& parameter,
                    std::span<const double> natural, std::size_t index,
                    const Eigen::VectorXd& residual)
      : function_(function),
        parameter_(parameter),
        natural_(natural.begin(), natural.end()),
        index_(index),
        residual_(residual) {}

  /// @return empty if a point it needs cannot be evaluated
  std::optional<Eigen::VectorXd> at_step(double relative) const {
    const double here = natural_[index_];
    const double step = relative * typical_size(parameter_, here);
    // The step as it is after rounding.
    const double up = (here + step) - here;
    const double down = here - (here - step);
    const bool room_above = here + up <= parameter_.upper;
    const bool room_below = here - down >= parameter_.lower;
    if (room_above && room_below) {
      const auto above = residual_at(here + up);
      const auto below = residual_at(here - down);
      if (!above || !below) return std::nullopt;
      return (*above - *below) * (step / (up + down)) / relative;
    }
    const double one = room_above ? up : -down;
    const auto near = residual_at(here + one);
    const auto far = residual_at(here + 2.0 * one);
    if (!near || !far) return std::nullopt;
    return (4.0 * *near - *far - 3.0 * residual_) * (step / (2.0 * one)) / relative;
  }

 private:
  std::optional<Eigen::VectorXd> residual_at(double value) const {
    std::vector<double> natural = natural_;
    natural[index_] = value;
    Eigen::VectorXd residual;
    if (!function_.evaluate(natural, residual, nullptr) || !residual.allFinite()) {
      return std::nullopt;
    }
    return residual;
  }

  const ResidualFunction& function_;
  const FitParameter& parameter_;
  std::vector<double> natural_;
  std::size_t index_;
  const Eigen::VectorXd& residual_;
};

/// Finite differences of one residual by one parameter at falling steps.
struct Differences {
  std::vector<double> step, value;
};

/// The finite difference that the vote of the steps prefers, with its error.
struct Vote {
  double value = 0.0, error = std::numeric_limits<double>::infinity(), step = 0.0;
};

/// The error at a step is what the differences still change by from the step before (truncation,
/// of first order at least), plus noise / step; the noise is the largest seen at the small steps.
Vote vote(const Differences& d, double rounding) {
  Vote best;
  double noise = rounding;
  for (std::size_t i = 1; i < d.step.size(); ++i) {
    if (d.step[i - 1] > kNoiseStep) continue;
    noise = std::max(noise, std::abs(d.value[i] - d.value[i - 1]) * d.step[i]);
  }
  for (std::size_t i = 1; i < d.step.size(); ++i) {
    const double error = 0.5 * std::abs(d.value[i] - d.value[i - 1]) + noise / d.step[i];
    if (error < best.error) best = {d.value[i], error, d.step[i]};
  }
  return best;
}

/// Checks every residual's derivative and keeps the one that differs most for what is known of it.
ParameterGradient check_column(const std::vector<Differences>& differences,
                               const Eigen::VectorXd& analytic, const Eigen::VectorXd& residual,
                               double floor, double tolerance) {
  ParameterGradient g;
  const double largest = analytic.size() > 0 ? analytic.cwiseAbs().maxCoeff() : 0.0;
  double worst = -1.0;
  Eigen::Index unknown = 0;
  for (Eigen::Index i = 0; i < analytic.size(); ++i) {
    const double rounding = std::numeric_limits<double>::epsilon() * std::abs(residual[i]);
    const Vote v = vote(differences[static_cast<std::size_t>(i)], rounding);
    const double size =
        std::max(std::abs(analytic[i]), std::abs(v.value)) + kFloorOfColumn * largest + floor;
    const double difference = std::abs(analytic[i] - v.value) / size;
    const double spread = v.error / size;
    if (!(spread <= kMostSpread)) ++unknown;
    const double ratio = difference / std::max(tolerance, kSpreadFactor * spread);
    if (!(ratio > worst)) continue;
    worst = ratio;
    g.difference = difference;
    g.spread = spread;
    g.step = v.step;
    g.residual = i;
  }
  g.verdict = worst > 1.0                     ? GradientVerdict::wrong
              : 2 * unknown > analytic.size() ? GradientVerdict::undecided
                                              : GradientVerdict::agrees;
  return g;
}

/// Finite differences of every residual; steps that cannot be evaluated are left out.
std::vector<Differences> all_differences(const ColumnDifferences& column, Eigen::Index residuals) {
  std::vector<Differences> all(static_cast<std::size_t>(residuals));
  for (const double step : kSteps) {
    const std::optional<Eigen::VectorXd> finite = column.at_step(step);
    if (!finite) continue;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].step.push_back(step);
      all[i].value.push_back((*finite)[static_cast<Eigen::Index>(i)]);
    }
  }
  return all;
}

/// Empty if the point cannot be evaluated.
std::optional<GradientPoint> check_point(const ResidualFunction& function,
                                         std::span<const FitParameter> parameters,
                                         const std::vector<double>& natural, double tolerance) {
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  if (!function.evaluate(natural, residual, &jacobian)) return std::nullopt;
  GradientPoint point;
  point.natural = natural;
  point.parameters.reserve(parameters.size());
  const double floor = residual.size() > 0 ? kFloorOfResidual * residual.cwiseAbs().maxCoeff() : 0;
  // Without it a column of zeros would be compared relative to nothing.
  const double least = floor + std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Eigen::VectorXd analytic =
        jacobian.col(static_cast<Eigen::Index>(i)) * typical_size(parameters[i], natural[i]);
    const ColumnDifferences differences(function, parameters[i], natural, i, residual);
    ParameterGradient g = check_column(all_differences(differences, residual.size()), analytic,
                                       residual, least, tolerance);
    g.name = parameters[i].name;
    point.parameters.push_back(std::move(g));
  }
  return point;
}

void count_verdicts(GradientCheck& check) {
  for (const GradientPoint& point : check.points) {
    for (const ParameterGradient& g : point.parameters) {
      if (g.verdict == GradientVerdict::wrong) ++check.wrong;
      if (g.verdict == GradientVerdict::undecided) ++check.undecided;
    }
  }
}

Json number_or_null(double value) {
  return std::isfinite(value) ? Json(rounded(value, 6)) : Json(nullptr);
}

std::string_view gradient_verdict_name(GradientVerdict verdict) noexcept {
  static constexpr auto kNames =
      std::to_array<Word<GradientVerdict>>({{GradientVerdict::agrees, "agrees"},
                                            {GradientVerdict::wrong, "wrong"},
                                            {GradientVerdict::undecided, "undecided"}});
  return word_for(kNames, verdict);
}

}  // namespace

bool GradientCheck::passed() const {
  std::size_t columns = 0;
  for (const GradientPoint& point : points) columns += point.parameters.size();
  return wrong == 0 && 2 * static_cast<std::size_t>(undecided) <= columns;
}

GradientCheck check_gradient(const ResidualFunction& function,
                             std::span<const FitParameter> parameters,
                             const GradientCheckOptions& options) {
  GradientCheck check;
  check.options = options;
  const auto wanted = static_cast<std::size_t>(std::max(options.random_points, 0));
  // Twice as many as wanted in reserve, for points that cannot be evaluated.
  const auto candidates = latin_hypercube_starts(parameters, 1 + 3 * wanted, options.seed);
  check.points.reserve(1 + wanted);
  for (const std::vector<double>& natural : candidates) {
    if (check.points.size() == 1 + wanted) break;
    std::optional<GradientPoint> point =
        check_point(function, parameters, natural, options.tolerance);
    if (point) {
      check.points.push_back(std::move(*point));
    } else if (check.points.empty()) {
      throw Error(ExitCode::numerical, "gradient check", "the nominal point cannot be evaluated");
    } else {
      ++check.unusable;
    }
  }
  if (check.points.size() < 1 + wanted) {
    throw Error(ExitCode::numerical, "gradient check",
                fmt::format("{} of {} random points cannot be evaluated", check.unusable,
                            candidates.size() - 1));
  }
  count_verdicts(check);
  return check;
}

Json to_json(const GradientCheck& check) {
  Json j{{"passed", check.passed()},
         {"seed", check.options.seed},
         {"tolerance", check.options.tolerance},
         {"wrong", check.wrong},
         {"undecided", check.undecided},
         {"unusable_points", check.unusable}};
  Json points = array_json(check.points, [](const GradientPoint& point) {
    Json list = Json::array();
    for (std::size_t i = 0; i < point.parameters.size(); ++i) {
      const ParameterGradient& g = point.parameters[i];
      list.push_back({{"name", g.name},
                      {"value_SI", rounded(point.natural[i], 6)},
                      {"verdict", gradient_verdict_name(g.verdict)},
                      {"relative_difference", number_or_null(g.difference)},
                      {"relative_step", g.step},
                      {"spread_of_differences", number_or_null(g.spread)},
                      {"residual", g.residual}});
    }
    return Json{{"parameters", std::move(list)}};
  });
  j["points"] = std::move(points);
  return j;
}

std::string to_terminal_text(const GradientCheck& check) {
  std::string text =
      fmt::format("{:<8} {:<12} {:>12} {:>11} {:>9} {:>9}  {}\n", "point", "parameter",
                  "value (SI)", "difference", "at step", "spread", "verdict");
  int number = 0;
  for (const GradientPoint& point : check.points) {
    const std::string label = number == 0 ? "nominal" : fmt::format("random {}", number);
    for (std::size_t i = 0; i < point.parameters.size(); ++i) {
      const ParameterGradient& g = point.parameters[i];
      text += fmt::format("{:<8} {:<12} {:>12} {:>11} {:>9} {:>9}  {}\n", label, g.name,
                          significant(point.natural[i], 5), significant(g.difference, 2),
                          significant(g.step, 1), significant(g.spread, 2),
                          gradient_verdict_name(g.verdict));
    }
    ++number;
  }
  text += fmt::format("derivatives {}: {} wrong, {} undecided, seed {}\n",
                      check.passed() ? "agree with finite differences" : "FAIL the check",
                      check.wrong, check.undecided, check.options.seed);
  return text;
}

}  // namespace tpm::fit
