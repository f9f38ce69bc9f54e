#include "tpm/fit/conditional.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law.hpp"

namespace tpm::fit {

bool is_nuisance(const FitConfig& config, std::size_t parameter) {
  const EstimatedParameter& p = config.parameters[parameter];
  if (p.sets.empty()) return true;  // of the noise
  if (!config.law) return false;
  const std::vector<LawParameter> table = law_parameters(*config.law);
  return std::all_of(p.sets.begin(), p.sets.end(),
                     [&](const Target& target) { return table[target.parameter].nuisance; });
}

bool is_contact(const FitConfig& config, std::size_t parameter) {
  if (!config.law || config.law->drive != Quantity::indentation_depth) return false;
  const std::vector<LawParameter> table = law_parameters(*config.law);
  return std::ranges::any_of(config.parameters[parameter].sets, [&](const Target& target) {
    return table[target.parameter].name == "contact";
  });
}

bool is_contact_under_load(const FitConfig& config, std::size_t parameter) {
  if (!is_contact(config, parameter)) return false;
  return std::ranges::any_of(config.parameters[parameter].sets, [&](const Target& target) {
    for (std::size_t i = 0; i < config.data.size(); ++i) {
      if (config.data[i].load_imposed && target.applies_to(i)) return true;
    }
    return false;
  });
}

namespace {

constexpr int kReadableDigits = 4;

/// The next bound, or the old one where they differ by no more than rounding.
double moved_bound(double old, double next) {
  constexpr double kRounding = 1e-9;
  return std::abs(next - old) <= kRounding * std::abs(old) ? old : next;
}

/// The next lower bound; the old one where there is no room.
double further_down(const FitParameter& p, double widest) {
  const double next =
      p.scale == Scale::linear ? p.start - 2.0 * (p.start - p.lower) : p.lower / 10.0;
  return moved_bound(p.lower, std::min(p.lower, std::max(rounded(next, kReadableDigits), widest)));
}

double further_up(const FitParameter& p, double widest) {
  const double next =
      p.scale == Scale::linear ? p.start + 2.0 * (p.upper - p.start) : p.upper * 10.0;
  return moved_bound(p.upper, std::max(p.upper, std::min(rounded(next, kReadableDigits), widest)));
}

/// The root of the information just outside the bound of a parameter, which is where it would go: a
/// law may have a kink at the bound itself. At the bound where the model ends there.
bool root_beyond_bound(const FitResult& result, const ResidualFunction& function,
                       LimitingBound bound, RowMatrix& root) {
  constexpr double kBeyond = 1e-6;  // of the width between the bounds
  const FitParameter& p = result.parameters[bound.parameter].parameter;
  std::vector<double> natural = result.best.natural;
  double& held = natural[bound.parameter];
  const bool up = bound.upper != p.reversed();
  const double step = kBeyond * (p.theta_upper() - p.theta_lower());
  held = p.natural(p.theta(bound.upper ? p.upper : p.lower) + (up ? step : -step));
  if (std::isfinite(held) && function.information_root(natural, root)) return true;
  held = bound.upper ? p.upper : p.lower;
  return function.information_root(natural, root);
}

/// Parameters that depend on a held one: |d theta_i / d theta_held| times the width of its bounds,
/// against the standard error of theta_i.
std::vector<bool> dependents(const FitResult& result, const ResidualFunction& function,
                             LimitingBound bound) {
  const std::size_t held = bound.parameter;
  std::vector<bool> depend(result.parameters.size(), true);
  depend[held] = false;
  const Covariance& c = result.covariance;
  RowMatrix jacobian;
  if (!c.full_rank || !root_beyond_bound(result, function, bound, jacobian)) return depend;
  const auto column = [&](std::size_t i) -> Eigen::VectorXd {
    const FitParameter& p = result.parameters[i].parameter;
    return jacobian.col(static_cast<Eigen::Index>(i)) *
           p.natural_slope(p.theta(result.best.natural[i]));
  };
  std::vector<std::size_t> free;
  std::vector<double> sd;
  for (std::size_t k = 0; k < c.free.size(); ++k) {
    if (c.free[k] == held) continue;
    free.push_back(c.free[k]);
    sd.push_back(c.theta_sd[static_cast<Eigen::Index>(k)]);
  }
  const auto n = std::ssize(free);
  Eigen::MatrixXd j(jacobian.rows(), n);
  Eigen::VectorXd length(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    j.col(k) = column(free[static_cast<std::size_t>(k)]);
    length[k] = j.col(k).norm();
    if (!(length[k] > 0.0)) return depend;
    j.col(k) /= length[k];
  }
  const FitParameter& p = result.parameters[held].parameter;
  const double width = p.theta_upper() - p.theta_lower();
  const Eigen::VectorXd moved =
      (least_squares(j, column(held)).col(0).array() / length.array()).matrix() * width;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto place = static_cast<std::size_t>(k);
    depend[free[place]] = !(std::abs(moved[k]) <= sd[place]);
  }
  return depend;
}

void add_condition(ParameterResult& p, const Condition& condition) {
  const bool known = std::ranges::any_of(p.conditional_on, [&](const Condition& c) {
    return c.parameter == condition.parameter && c.upper == condition.upper;
  });
  if (!known) p.conditional_on.push_back(condition);
}

Condition condition_of(const ParameterResult& nuisance, bool upper, bool at_estimate) {
  const FitParameter& p = nuisance.parameter;
  return {p.name, upper, upper ? p.upper : p.lower, at_estimate};
}

/// "contact is on its lower bound -0.93 mm: k1 and exponent hold only there".
std::string bound_flag(const FitResult& result, const ParameterResult& nuisance) {
  const FitParameter& p = nuisance.parameter;
  const bool upper = nuisance.at_upper_bound;
  std::vector<std::string> names;
  for (const ParameterResult& other : result.parameters) {
    for (const Condition& c : other.conditional_on) {
      if (c.at_estimate && c.parameter == p.name) names.push_back(other.parameter.name);
    }
  }
  const std::string where =
      fmt::format("{} is on its {} bound {}", p.name, upper ? "upper" : "lower",
                  in_sized_unit(nuisance, upper ? p.upper : p.lower));
  if (names.empty()) return where + "; no other parameter depends on it";
  return fmt::format("{}: what is said of {} holds only there", where, fmt::join(names, ", "));
}

/// Where the best fit ends on a bound of the contact under an imposed force, the recording does not
/// determine it, nor what depends on it.
/// @return what a reader must know
Remark say_undetermined(FitResult& result, const ParameterResult& contact) {
  const bool upper = contact.at_upper_bound;
  const FitParameter& f = contact.parameter;
  const std::string where = fmt::format("its {} bound {}", upper ? "upper" : "lower",
                                        in_sized_unit(contact, upper ? f.upper : f.lower));
  std::vector<std::string> names;
  for (ParameterResult& p : result.parameters) {
    const bool depends = std::ranges::any_of(p.conditional_on, [&](const Condition& c) {
      return c.at_estimate && c.parameter == f.name;
    });
    if (!depends) continue;
    names.push_back(p.parameter.name);
    if (p.unconfirmed) continue;
    p.unconfirmed = Remark{"contact_undetermined",
                           fmt::format("{} is undetermined (the fit ends on {})", f.name, where)};
    p.summary = parameter_words(p, result.config.level);
  }
  return {
      "contact_undetermined",
      fmt::format("{} is undetermined by this recording: the fit ends on {}, {}{}", f.name, where,
                  upper ? "the shallowest reading under a load"
                        : "the furthest that the instrument can have come from without a load",
                  names.empty() ? std::string("; no other parameter depends on it")
                                : fmt::format("; not identified: {}; --contact holds a known "
                                              "depth",
                                              fmt::join(names, ", ")))};
}

std::string condition_words(const ParameterResult& p, const std::vector<ParameterResult>& all) {
  std::string words;
  for (const Condition& c : p.conditional_on) {
    const auto of = std::ranges::find_if(
        all, [&](const ParameterResult& other) { return other.parameter.name == c.parameter; });
    words += fmt::format("; {} {} at its {} bound {}",
                         c.at_estimate ? "this holds only with" : "its interval ends with",
                         c.parameter, c.upper ? "upper" : "lower", in_sized_unit(*of, c.value));
  }
  return words;
}

/// With as many digits as tell the bounds before and after apart.
std::string widening_words(const ParameterResult& p) {
  constexpr int kFewest = 4, kMost = 17;
  const Unit& unit = p.parameter.unit;
  const auto range = [&](double lower, double upper, int digits) {
    return fmt::format("{} .. {}", with_unit(significant(lower / unit.to_si, digits), unit),
                       with_unit(significant(upper / unit.to_si, digits), unit));
  };
  std::string before, after;
  for (int digits = kFewest; digits <= kMost && before == after; ++digits) {
    before = range(p.first_bounds->lower, p.first_bounds->upper, digits);
    after = range(p.parameter.lower, p.parameter.upper, digits);
  }
  return fmt::format(
      "the automatic bounds of {} were widened from {} to {}: the fit pressed on them",
      p.parameter.name, before, after);
}

}  // namespace

bool widen_pressed_bounds(const FitResult& result, const FitConfig& config,
                          std::vector<FitParameter>& parameters) {
  bool moved = false;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::optional<WidestBounds>& widest = config.parameters[i].widest;
    if (!widest) continue;
    FitParameter& p = parameters[i];
    const double value = result.best.natural[i];
    const bool below = p.at_lower(value), above = p.at_upper(value);
    const double lower = below ? further_down(p, widest->lower) : p.lower;
    const double upper = above ? further_up(p, widest->upper) : p.upper;
    moved = moved || lower < p.lower || upper > p.upper;
    p.lower = lower;
    p.upper = upper;
  }
  return moved;
}

void mark_not_separable(FitResult& result) {
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    ParameterResult& p = result.parameters[i];
    p.not_separable = result.config.parameters[i].not_separable;
    if (p.not_separable) p.summary = parameter_words(p, result.config.level);
  }
}

void mark_conditions(FitResult& result, const ResidualFunction& function) {
  std::vector<ParameterResult>& all = result.parameters;
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].nuisance = is_nuisance(result.config, i);
    // A rise lies between its samples: that is no limit which anybody assumed.
    if (result.config.parameters[i].rise) all[i].at_lower_bound = all[i].at_upper_bound = false;
  }
  for (std::size_t held = 0; held < all.size(); ++held) {
    const ParameterResult& nuisance = all[held];
    if (!nuisance.nuisance || !(nuisance.at_lower_bound || nuisance.at_upper_bound)) continue;
    const std::vector<bool> depend = dependents(result, function, {held, nuisance.at_upper_bound});
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (depend[i]) add_condition(all[i], condition_of(nuisance, nuisance.at_upper_bound, true));
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const LimitingBound& bound : all[i].profile.limited_by) {
      const ParameterResult& nuisance = all[bound.parameter];
      if (result.config.parameters[bound.parameter].rise) continue;
      if (!nuisance.nuisance || !dependents(result, function, bound)[i]) continue;
      add_condition(all[i], condition_of(nuisance, bound.upper, false));
    }
  }
  std::vector<std::optional<Remark>> undetermined(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!is_contact_under_load(result.config, i)) continue;
    if (all[i].at_lower_bound || all[i].at_upper_bound) {
      undetermined[i] = say_undetermined(result, all[i]);
    }
  }
  for (ParameterResult& p : all) p.summary += condition_words(p, all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ParameterResult& p = all[i];
    if (p.first_bounds) {
      result.remarks.push_back({"bounds_widened", widening_words(p)});
    }
    if (undetermined[i]) {
      result.remarks.push_back(*std::move(undetermined[i]));
    } else if (p.nuisance && (p.at_lower_bound || p.at_upper_bound)) {
      result.remarks.push_back({"nuisance_at_bound", bound_flag(result, p)});
    }
  }
}

}  // namespace tpm::fit
