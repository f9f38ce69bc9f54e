#include "tpm/fit/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

std::string percent(double level) {
  return fmt::format("{:.4g} %", 100.0 * level);
}

/// Of a spring-pot, which is a dashpot at 1.
bool is_order_up_to_1(const ParameterResult& p) {
  const bool order = p.parameter.name == "alpha" || p.parameter.name == "beta";
  return order && p.parameter.upper == 1.0;
}

std::string bound_note(const ParameterResult& p) {
  if (p.at_lower_bound) {
    return fmt::format("; the best fit runs to its lower bound {}",
                       in_unit(p.parameter, p.parameter.lower));
  }
  if (is_dashpot(p)) return "; best fit 1: the spring-pot is a dashpot";
  if (p.at_upper_bound) {
    return fmt::format("; the best fit runs to its upper bound {}",
                       in_unit(p.parameter, p.parameter.upper));
  }
  return fmt::format("; best fit {}", in_unit(p.parameter, p.estimate));
}

}  // namespace

bool is_dashpot(const ParameterResult& p) {
  return is_order_up_to_1(p) && p.at_upper_bound;
}

std::string_view verdict_name(Verdict verdict) noexcept {
  static constexpr auto kNames = std::to_array<Word<Verdict>>({
      {Verdict::identified, "identified"},
      {Verdict::lower_only, "one-sided: lower limit only"},
      {Verdict::upper_only, "one-sided: upper limit only"},
      {Verdict::flat, "flat"},
      {Verdict::failed, "profile failed"},
      {Verdict::not_profiled, "not profiled"},
  });
  return word_for(kNames, verdict);
}

std::string in_unit(const FitParameter& parameter, double natural) {
  return with_unit(significant(natural / parameter.unit.to_si, 4), parameter.unit);
}

double size_of(const ParameterResult& p) {
  return size_of(p.estimate, p.lower, p.upper);
}

double size_of(double estimate, const std::optional<double>& lower,
               const std::optional<double>& upper) {
  constexpr double kNearZero = 0.01;  // of the further limit
  const double limit = std::max(std::abs(lower.value_or(0.0)), std::abs(upper.value_or(0.0)));
  return std::abs(estimate) < kNearZero * limit ? limit : estimate;
}

std::string estimate_text(double estimate, double size, const Unit& unit) {
  constexpr double kNothing = 1e-4;  // of the size of the row
  const double shown = std::abs(estimate) < kNothing * std::abs(size) ? 0.0 : estimate;
  return significant(shown / unit.to_si, kEstimateDigits);
}

std::string in_sized_unit(const ParameterResult& p, double natural) {
  const Unit unit = sized_unit(p.parameter.unit, size_of(p));
  return with_unit(significant(natural / unit.to_si, 4), unit);
}

Verdict verdict_of(const ParameterResult& p) {
  if (has_failed(p.profile.below) || has_failed(p.profile.above)) return Verdict::failed;
  if (p.lower && p.upper) return Verdict::identified;
  if (p.lower) return Verdict::lower_only;
  if (p.upper) return Verdict::upper_only;
  return Verdict::flat;
}

namespace {

/// Why a profile failed, and what is known all the same.
std::string failure_words(const ParameterResult& p, double level) {
  const FitParameter& f = p.parameter;
  const Profile& profile = p.profile;
  const bool below = has_failed(profile.below);
  const bool above = has_failed(profile.above);
  const char* side = below && above ? "on both sides" : below ? "below the best value" : "above it";
  const bool rounding =
      profile.below == ProfileEnd::rounding || profile.above == ProfileEnd::rounding;
  std::string words = fmt::format(
      "{} = {}: its profile failed {} ({}), which does not mean that it is unknown", f.name,
      in_sized_unit(p, p.estimate), side,
      rounding ? "an interval as narrow as the rounding of numbers: the data are met exactly"
               : "the walk reached neither a limit nor a bound");
  if (p.lower)
    words += fmt::format("; lower {} limit {}", percent(level), in_sized_unit(p, *p.lower));
  if (p.upper)
    words += fmt::format("; upper {} limit {}", percent(level), in_sized_unit(p, *p.upper));
  words += p.standard_error
               ? fmt::format("; linearised standard error {}", in_sized_unit(p, *p.standard_error))
               : std::string("; no linearised standard error either");
  return words;
}

/// True if the walk ended where two parts of the law change places.
bool exchanges(const ParameterResult& p, bool upper) {
  return (upper ? p.profile.above : p.profile.below) == ProfileEnd::exchange;
}

std::string exchange_words(const ParameterResult& p) {
  const bool below = exchanges(p, false);
  const bool above = exchanges(p, true);
  if (!below && !above) return {};
  return fmt::format(
      "; {} values it changes places with another part of the law before a limit is reached: the "
      "data do not tell the two apart",
      below && above ? "towards smaller and larger"
      : below        ? "towards smaller"
                     : "towards larger");
}

/// Both answers, where no rest tells a drift.
std::string drift_note(const ParameterResult& p) {
  if (!p.with_drift) return {};
  return fmt::format(" with a drift of the zero or without ({} with one)",
                     in_sized_unit(p, p.with_drift->estimate));
}

std::string range_words(const ParameterResult& p, double level) {
  const FitParameter& f = p.parameter;
  switch (p.verdict) {
    case Verdict::identified: {
      const std::string interval =
          fmt::format("{} to {}", in_sized_unit(p, *p.lower), in_sized_unit(p, *p.upper));
      if (p.not_separable) {
        return fmt::format(
            "{} = {} is not identified: {}: not separable; {} interval without {} {}", f.name,
            in_sized_unit(p, p.estimate), p.not_separable->text, percent(level),
            p.not_separable->code == kDriftOrBranch     ? "drift"
            : p.not_separable->code == kPlateauOrBranch ? "such a branch"
            : p.not_separable->code == kPlateauOrFloor  ? "such a floor"
            : p.not_separable->code == kZeroOrContact   ? "such a cut"
                                                        : "such a loading",
            interval);
      }
      if (p.unconfirmed) {
        return fmt::format("{} = {} is not identified: {}; {} interval of this minimum {}", f.name,
                           in_sized_unit(p, p.estimate), p.unconfirmed->text, percent(level),
                           interval);
      }
      return fmt::format("{} = {} is identified: {} interval {}{}{}", f.name,
                         in_sized_unit(p, p.estimate), percent(level), interval, drift_note(p),
                         p.profile.connected ? "" : ", not all of it: separate ranges fit");
    }
    case Verdict::lower_only:
      return fmt::format("{} is at least {} ({} interval, one-sided){}{}", f.name,
                         in_sized_unit(p, *p.lower), percent(level), drift_note(p), bound_note(p));
    case Verdict::upper_only:
      return fmt::format("{} is at most {} ({} interval, one-sided){}{}", f.name,
                         in_sized_unit(p, *p.upper), percent(level), drift_note(p), bound_note(p));
    case Verdict::flat:
      if (exchanges(p, false) || exchanges(p, true)) {
        return fmt::format("{} is undetermined by these data{}", f.name, bound_note(p));
      }
      return fmt::format("{} is undetermined by these data: every value from {} to {} fits{}",
                         f.name, in_unit(f, f.lower), in_unit(f, f.upper), bound_note(p));
    case Verdict::failed:
      return failure_words(p, level);
    case Verdict::not_profiled:
      break;
  }
  return fmt::format("{} = {} (no interval: profiles were switched off)", f.name,
                     in_sized_unit(p, p.estimate));
}

}  // namespace

std::string parameter_words(const ParameterResult& p, double level) {
  return range_words(p, level) + exchange_words(p) +
         (p.profile.cut_short ? "; a limit is where the model can no longer be evaluated" : "");
}

std::string verdict_text(const ParameterResult& p) {
  if (p.not_separable) {
    return fmt::format("not identified: {}: not separable", p.not_separable->text);
  }
  if (p.unconfirmed) return "not identified: " + p.unconfirmed->text;
  std::string text(verdict_name(p.verdict));
  for (std::size_t i = 0; i < p.conditional_on.size(); ++i) {
    const Condition& c = p.conditional_on[i];
    text += fmt::format("{} {} at its {} bound", i == 0 ? ", conditional on" : " and", c.parameter,
                        c.upper ? "upper" : "lower");
  }
  if (is_dashpot(p)) {
    text += "; 1: a dashpot";
  } else if (p.verdict == Verdict::lower_only && is_order_up_to_1(p)) {
    text += "; not told from 1, a dashpot";
  }
  if (p.only_if_described) text += "; only if the law described the data";
  if (p.nuisance && (p.at_lower_bound || p.at_upper_bound)) {
    text += fmt::format("; on its {} bound", p.at_lower_bound ? "lower" : "upper");
  }
  return text;
}

std::string limit_text(const ParameterResult& p, bool upper) {
  return limit_text(p, upper, p.parameter.unit);
}

std::string limit_text(const ParameterResult& p, bool upper, const Unit& unit) {
  const std::optional<double>& limit = upper ? p.upper : p.lower;
  if (limit) return significant(*limit / unit.to_si, kIntervalDigits);
  return has_failed(upper ? p.profile.above : p.profile.below) ? "failed" : "open";
}

std::string hypothesis_words(const HypothesisResult& result, double level) {
  return fmt::format("{} {} (deviance rises by {}, p = {})", result.hypothesis.name,
                     result.excluded
                         ? fmt::format("is excluded by these data at {}", percent(level))
                         : fmt::format("cannot be excluded by these data at {}", percent(level)),
                     significant(result.rise, 4), significant(result.p_value, 2));
}

namespace {

/// Components of a direction that differ by less than this share count as equal, or as a small
/// whole number apart.
constexpr double kEqual = 0.1;

bool nearly(double a, double b) {
  return std::abs(a - b) <= kEqual * std::max(std::abs(a), std::abs(b));
}

bool all_on_scale(std::span<const FitParameter> named, Scale scale) {
  return std::ranges::all_of(named, [scale](const FitParameter& p) { return p.scale == scale; });
}

bool all_equal(std::span<const double> steps) {
  return std::all_of(steps.begin(), steps.end(), [&](double s) { return nearly(s, steps[0]); });
}

std::string power(const std::string& name, int exponent) {
  return exponent == 1 ? name : fmt::format("{}^{}", name, exponent);
}

/// p^m q^n stays the same along steps of ln p and ln q with m dp + n dq = 0: the smallest whole
/// numbers up to 3 that fit.
std::string known_power(const FitParameter& p, const FitParameter& q, double dp, double dq) {
  for (int m = 1; m <= 3; ++m) {
    for (int n = 1; n <= 3; ++n) {
      if (!nearly(m * std::abs(dp), n * std::abs(dq))) continue;
      const bool opposite = dp * dq < 0.0;
      const char* whose = m == 1 && n == 1 ? "their" : "the";
      return fmt::format("{} {} {}{}{}", whose, opposite ? "product" : "ratio", power(p.name, m),
                         opposite ? " " : " / ", power(q.name, n));
    }
  }
  return {};
}

std::string known_sum(const FitParameter& p, const FitParameter& q, double dp, double dq) {
  if (p.unit.dimension != q.unit.dimension || !nearly(std::abs(dp), std::abs(dq))) return {};
  return dp * dq < 0.0 ? fmt::format("their sum {} + {}", p.name, q.name)
                       : fmt::format("their difference {} - {}", p.name, q.name);
}

std::string joined(std::span<const FitParameter> named) {
  std::string text;
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (i > 0) text += i + 1 == named.size() ? " and " : ", ";
    text += named[i].name;
  }
  return text;
}

/// The parameters that move along the weakest direction, with their steps.
struct NamedDirection {
  std::vector<FitParameter> parameters;
  std::vector<double> steps;
};

NamedDirection named_direction(const FitResult& result) {
  const Covariance& c = result.covariance;
  const Eigen::VectorXd& v = c.weakest_direction;
  // Steps of parameters with a unit cannot be compared; their effects on the residuals can.
  const bool pure = std::ranges::all_of(
      c.free, [&](std::size_t i) { return result.parameters[i].parameter.scale != Scale::linear; });
  const Eigen::VectorXd& weight = pure || c.weakest_share.size() != v.size() ? v : c.weakest_share;
  // Contributions below this share of the largest are not listed.
  const double least = 0.2 * weight.cwiseAbs().maxCoeff();
  NamedDirection named;
  for (Eigen::Index k = 0; k < v.size(); ++k) {
    if (std::abs(weight[k]) < least) continue;
    named.parameters.push_back(result.parameters[c.free[static_cast<std::size_t>(k)]].parameter);
    named.steps.push_back(v[k]);
  }
  return named;
}

/// "E up and eta1 down", the first one up unless its theta runs against it.
std::string movement_words(const NamedDirection& named) {
  std::string parts;
  const double sign = named.steps[0] < 0.0 ? -1.0 : 1.0;
  for (std::size_t i = 0; i < named.steps.size(); ++i) {
    const bool rises = (named.steps[i] * sign > 0.0) != named.parameters[i].reversed();
    if (i > 0) parts += " and ";
    parts += fmt::format("{} {}", named.parameters[i].name, rises ? "up" : "down");
  }
  return parts;
}

}  // namespace

std::string known_combination(std::span<const FitParameter> named, std::span<const double> steps) {
  if (named.size() < 2) return {};
  const bool two = named.size() == 2;
  if (all_on_scale(named, Scale::log)) {
    if (two) return known_power(named[0], named[1], steps[0], steps[1]);
    return all_equal(steps) ? "the ratios of " + joined(named) : std::string();
  }
  if (two && all_on_scale(named, Scale::linear)) {
    return known_sum(named[0], named[1], steps[0], steps[1]);
  }
  return {};
}

std::string weakest_direction_words(const FitResult& result) {
  const Covariance& c = result.covariance;
  if (c.free.size() < 2 || c.weakest_direction.size() == 0) return {};
  const NamedDirection named = named_direction(result);
  const double strongest = c.singular_values[0];
  const double weakest = c.singular_values[c.singular_values.size() - 1];
  const std::string strength = fmt::format("singular values {}:{} of the scaled Jacobian",
                                           significant(strongest, 3), significant(weakest, 3));
  const std::string known = known_combination(named.parameters, named.steps);
  if (!known.empty() && !c.full_rank) {
    return fmt::format("rank-deficient: {} trade off: only {} can be known ({})",
                       joined(named.parameters), known, strength);
  }
  // A mild imbalance is no trade-off: both are known, one of them less well.
  if (!known.empty() && weakest < 0.1 * strongest) {
    return fmt::format("{} trade off: {} is known much better than they are ({})",
                       joined(named.parameters), known, strength);
  }
  const std::string parts = movement_words(named);
  if (!c.full_rank)
    return fmt::format("rank-deficient: the data do not see {} ({})", parts, strength);
  if (named.steps.size() == 1)
    return fmt::format("least determined by the data: {} ({})", parts, strength);
  return fmt::format("least determined by the data: {} together; they trade off ({})", parts,
                     strength);
}

}  // namespace tpm::fit
