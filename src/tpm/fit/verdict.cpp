#include "tpm/fit/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/core/text.hpp"

namespace tpm {
namespace {

std::string percent(double level) {
  return fmt::format("{:.4g} %", 100.0 * level);
}

std::string bound_note(const ParameterResult& p) {
  if (p.at_lower_bound) {
    return fmt::format("; the best fit runs to its lower bound {}",
                       in_unit(p.parameter, p.parameter.lower));
  }
  if (p.at_upper_bound) {
    return fmt::format("; the best fit runs to its upper bound {}",
                       in_unit(p.parameter, p.parameter.upper));
  }
  return fmt::format("; best fit {}", in_unit(p.parameter, p.estimate));
}

}  // namespace

std::string_view verdict_name(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::identified:
      return "identified";
    case Verdict::lower_only:
      return "one-sided: lower limit only";
    case Verdict::upper_only:
      return "one-sided: upper limit only";
    case Verdict::flat:
      return "flat";
    case Verdict::not_profiled:
      return "not profiled";
  }
  return "";
}

std::string in_unit(const FitParameter& parameter, double natural) {
  const std::string number = significant(natural / parameter.unit.to_si, 4);
  return parameter.unit.symbol.empty() ? number : number + " " + parameter.unit.symbol;
}

Verdict verdict_of(const ParameterResult& p) {
  if (p.lower && p.upper) return Verdict::identified;
  if (p.lower) return Verdict::lower_only;
  if (p.upper) return Verdict::upper_only;
  return Verdict::flat;
}

std::string parameter_words(const ParameterResult& p, double level) {
  const FitParameter& f = p.parameter;
  switch (p.verdict) {
    case Verdict::identified: {
      const std::string interval =
          fmt::format("{} to {}", in_unit(f, *p.lower), in_unit(f, *p.upper));
      return fmt::format("{} = {} is identified: {} interval {}{}", f.name, in_unit(f, p.estimate),
                         percent(level), interval,
                         p.profile.connected ? "" : ", not all of it: separate ranges fit");
    }
    case Verdict::lower_only:
      return fmt::format("{} is at least {} ({} interval, one-sided){}", f.name,
                         in_unit(f, *p.lower), percent(level), bound_note(p));
    case Verdict::upper_only:
      return fmt::format("{} is at most {} ({} interval, one-sided){}", f.name,
                         in_unit(f, *p.upper), percent(level), bound_note(p));
    case Verdict::flat:
      return fmt::format("{} cannot be told from these data: every value from {} to {} fits{}",
                         f.name, in_unit(f, f.lower), in_unit(f, f.upper), bound_note(p));
    case Verdict::not_profiled:
      break;
  }
  return fmt::format("{} = {} (no interval: profiles were switched off)", f.name,
                     in_unit(f, p.estimate));
}

std::string hypothesis_words(const HypothesisResult& result, double level) {
  return fmt::format("{} {} (deviance rises by {}, p = {})", result.hypothesis.name,
                     result.excluded
                         ? fmt::format("is excluded by these data at {}", percent(level))
                         : fmt::format("cannot be excluded by these data at {}", percent(level)),
                     significant(result.rise, 4), significant(result.p_value, 2));
}

std::string weakest_direction_words(const FitResult& result) {
  const Covariance& c = result.covariance;
  if (c.free.size() < 2) return {};
  const Eigen::VectorXd& v = c.weakest_direction;
  const double largest = v.cwiseAbs().maxCoeff();
  std::string parts;
  int named = 0;
  double sign = 0.0;
  for (Eigen::Index k = 0; k < v.size(); ++k) {
    if (std::abs(v[k]) < 0.2 * largest) continue;
    if (sign == 0.0) sign = v[k] < 0.0 ? -1.0 : 1.0;
    const FitParameter& p = result.parameters[c.free[static_cast<std::size_t>(k)]].parameter;
    const bool rises = (v[k] * sign > 0.0) != p.reversed();
    if (named++ > 0) parts += " and ";
    parts += fmt::format("{} {}", p.name, rises ? "up" : "down");
  }
  const std::string strength = fmt::format(
      "singular values {}:{} of the scaled Jacobian", significant(c.singular_values[0], 3),
      significant(c.singular_values[c.singular_values.size() - 1], 3));
  if (!c.full_rank)
    return fmt::format("rank-deficient: the data do not see {} ({})", parts, strength);
  if (named == 1) return fmt::format("the data see least: {} ({})", parts, strength);
  return fmt::format("the data see least: {} together; they trade off ({})", parts, strength);
}

}  // namespace tpm
