// Declared in tpm/fit/fit.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/fit/fit.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr Eigen::Index kMostProfiled = 20'000;  // residuals that profiles are walked with

constexpr double kSameDeviance = 1e-5;  // relative: one minimum

bool same_deviance(double a, double b) {
  return std::abs(a - b) <= kSameDeviance * std::max(1.0, std::abs(b));
}

/// All starts, each followed to its end, sorted into distinct minima.
struct MultiStart {
  std::vector<DistinctMinimum> minima;
  int run = 0, failed = 0;
  std::vector<double> end_deviances;  ///< of every start; NaN where it failed
};

void add_to_cluster(std::vector<DistinctMinimum>& minima, const Minimum& m, int starts) {
  for (DistinctMinimum& cluster : minima) {
    if (!same_deviance(m.deviance, cluster.minimum.deviance)) continue;
    cluster.starts += starts;
    for (std::size_t i = 0; i < m.natural.size(); ++i) {
      cluster.low[i] = std::min(cluster.low[i], m.natural[i]);
      cluster.high[i] = std::max(cluster.high[i], m.natural[i]);
    }
    return;
  }
  minima.push_back({m, starts, m.natural, m.natural});
}

/// Both first steps are tried; the deeper end counts.
Minimum minimise_both_ways(const ResidualFunction& function,
                           std::span<const FitParameter> parameters,
                           std::span<const double> start) {
  const Minimum bold = minimise(function, parameters, start);
  const Minimum cautious = minimise(function, parameters, start, {}, FirstStep::cautious);
  const bool deeper = cautious.usable && (!bold.usable || cautious.deviance < bold.deviance);
  return deeper ? cautious : bold;
}

MultiStart run_starts(const ResidualFunction& function, std::span<const FitParameter> parameters,
                      const std::vector<std::vector<double>>& starts, StartKind kind,
                      std::span<const int> led_there) {
  MultiStart result;
  std::vector<std::pair<Minimum, int>> ends;  // with the number of starts that it stands for
  Progress progress("fitting from several starts", starts.size());
  for (const auto& start : starts) {
    Minimum m = kind == StartKind::solved ? minimise_near(function, parameters, start)
                                          : minimise_both_ways(function, parameters, start);
    function.exchange_order().sort(m.natural);
    ++result.run;
    result.end_deviances.push_back(m.usable ? m.deviance
                                            : std::numeric_limits<double>::quiet_NaN());
    if (m.usable) {
      const std::size_t last = result.end_deviances.size() - 1;
      ends.emplace_back(std::move(m), led_there.empty() ? 1 : led_there[last]);
    } else {
      ++result.failed;
    }
    progress.advance();
  }
  if (ends.empty()) {
    throw Error(
        ExitCode::numerical, "fit",
        fmt::format("none of {} starts ended in a point that can be evaluated", starts.size()),
        "another law (--laws), a window without what the law cannot follow (--from-time, --until), "
        "or bounds (\"parameters\" of a configuration) within which the law predicts all readings");
  }
  std::ranges::stable_sort(ends, {}, [](const auto& end) { return end.first.deviance; });
  for (const auto& [m, count] : ends) add_to_cluster(result.minima, m, count);
  return result;
}

std::optional<double> natural_standard_error(const FitResult& result, std::size_t index) {
  const Covariance& c = result.covariance;
  const auto place = std::find(c.free.begin(), c.free.end(), index);
  if (!c.full_rank || place == c.free.end()) return std::nullopt;
  const FitParameter& p = result.parameters[index].parameter;
  return c.theta_sd[place - c.free.begin()] *
         std::abs(p.natural_slope(p.theta(result.best.natural[index])));
}

/// Points below the threshold belong to every interval. A profile that lay in another valley
/// may thus show a point beyond the limit of this one: the furthest on either side.
/// @param rise of the deviance at the limits of this parameter
std::vector<Minimum> beyond_limits(const FitResult& result, std::size_t index, double rise) {
  const Profile& own = result.parameters[index].profile;
  constexpr double kBeyond = 1e-3;  // of the way from the estimate to the limit
  std::vector<Minimum> beyond;
  const double estimate = result.best.natural[index];
  for (const auto& [limit, sign] : {std::pair(own.lower, -1.0), std::pair(own.upper, 1.0)}) {
    if (!limit) continue;
    const Minimum* furthest = nullptr;
    double distance = (1.0 + kBeyond) * (*limit - estimate) * sign;
    for (const ParameterResult& other : result.parameters) {
      for (const Minimum& m : other.profile.inside) {
        if (!(m.deviance - result.best.deviance < rise)) continue;
        const double here = (m.natural[index] - estimate) * sign;
        if (!(here > distance)) continue;
        distance = here;
        furthest = &m;
      }
    }
    if (furthest != nullptr) beyond.push_back(*furthest);
  }
  return beyond;
}

/// Walks the profiles that others reach beyond again, from there, too.
void widen_profiles(const ResidualFunction& function, FitResult& result,
                    std::span<const FitParameter> parameters,
                    const std::vector<Minimum>& candidates, const Threshold& threshold) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double rise = threshold.rise_of(i, result.best.deviance);
    const std::vector<Minimum> beyond = beyond_limits(result, i, rise);
    if (beyond.empty()) continue;
    std::vector<Minimum> starts = candidates;
    starts.insert(starts.end(), beyond.begin(), beyond.end());
    Profile profile =
        profile_likelihood(function, parameters, starts, i, result.covariance, threshold);
    if (profile.better) continue;
    result.parameters[i].lower = profile.lower;
    result.parameters[i].upper = profile.upper;
    result.parameters[i].profile = std::move(profile);
  }
}

/// Profiles of every parameter; on meeting a deeper minimum descends into it and starts again.
void profile_all(const ResidualFunction& function, FitResult& result,
                 std::span<const FitParameter> parameters, Threshold& threshold,
                 const NoiseRule& noise) {
  Progress progress("profiling", parameters.size());
  for (int restart = 0; restart < 10; ++restart) {
    bool deeper = false;
    std::vector<Minimum> candidates{result.best};
    for (const DistinctMinimum& m : result.minima) {
      if (!same_deviance(m.minimum.deviance, result.best.deviance)) candidates.push_back(m.minimum);
    }
    for (std::size_t i = 0; i < parameters.size() && !deeper; ++i) {
      Profile profile =
          profile_likelihood(function, parameters, candidates, i, result.covariance, threshold);
      if (profile.better) {
        result.best = minimise(function, parameters, profile.better->natural);
        function.exchange_order().sort(result.best.natural);
        if (noise) noise(result.best.natural, threshold);
        result.covariance = linear_covariance(function, parameters, result.best, threshold);
        deeper = true;
        continue;
      }
      result.parameters[i].lower = profile.lower;
      result.parameters[i].upper = profile.upper;
      result.parameters[i].profile = std::move(profile);
      progress.advance();
    }
    if (deeper) continue;
    widen_profiles(function, result, parameters, candidates, threshold);
    return;
  }
  throw Error(ExitCode::numerical, "profiles",
              "a deeper minimum was met again and again; expected one that stays: a law of fewer "
              "parameters (--laws), or more starts (--starts 200)");
}

void describe_parameters(FitResult& result, double level, bool profiles) {
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    ParameterResult& p = result.parameters[i];
    p.estimate = result.best.natural[i];
    p.at_lower_bound = p.parameter.at_lower(p.estimate);
    p.at_upper_bound = p.parameter.at_upper(p.estimate);
    p.standard_error = natural_standard_error(result, i);
    p.verdict = profiles ? verdict_of(p) : Verdict::not_profiled;
    p.summary = parameter_words(p, level);
  }
}

}  // namespace

void linear_intervals(FitResult& result, std::span<const FitParameter> parameters,
                      const Threshold& threshold) {
  const Covariance& c = result.covariance;
  if (!c.full_rank) return;
  for (std::size_t k = 0; k < c.free.size(); ++k) {
    const std::size_t i = c.free[k];
    const FitParameter& p = parameters[i];
    const double theta = p.theta(result.best.natural[i]);
    const double wide = threshold.multiplier_of(i, result.best.deviance);
    const double half = wide * c.theta_sd[static_cast<Eigen::Index>(k)];
    const double a = p.natural(std::max(theta - half, p.theta_lower()));
    const double b = p.natural(std::min(theta + half, p.theta_upper()));
    if (theta - half > p.theta_lower())
      (p.reversed() ? result.parameters[i].upper : result.parameters[i].lower) = a;
    if (theta + half < p.theta_upper())
      (p.reversed() ? result.parameters[i].lower : result.parameters[i].upper) = b;
  }
}

FitResult fit_residuals(const ResidualFunction& function, std::vector<FitParameter> parameters,
                        const std::vector<std::vector<double>>& starts, Threshold threshold,
                        bool profiles, StartKind kind, const NoiseRule& noise,
                        std::span<const int> led_there) {
  threshold.parameter_count = static_cast<int>(parameters.size());
  FitResult result;
  MultiStart multi = run_starts(function, parameters, starts, kind, led_there);
  result.starts_run = multi.run;
  result.starts_failed = multi.failed;
  result.waterfall = waterfall(multi.end_deviances);
  result.starts_agreeing = result.waterfall.at_best;
  result.minima = std::move(multi.minima);
  result.best = result.minima.front().minimum;
  if (noise) noise(result.best.natural, threshold);
  result.covariance = linear_covariance(function, parameters, result.best, threshold);
  for (const FitParameter& p : parameters) {
    ParameterResult r;
    r.parameter = p;
    result.parameters.push_back(std::move(r));
  }
  if (profiles && function.residual_count() <= kMostProfiled) {
    profile_all(function, result, parameters, threshold, noise);
  } else if (profiles) {
    // With so many readings the likelihood is a parabola as far as the interval reaches.
    linear_intervals(result, parameters, threshold);
    result.remarks.push_back(
        {"intervals_from_covariance",
         fmt::format("{} readings: the intervals come from the covariance, not from profiles",
                     function.residual_count())});
  }
  result.inflation = threshold.inflation;
  result.noise = threshold.noise;
  result.least_variance = threshold.least_variance;
  result.degrees_of_freedom = threshold.data_count - threshold.parameter_count;
  result.variance_factor = threshold.scale_known || result.degrees_of_freedom > 0
                               ? threshold.variance_factor(result.best.deviance)
                               : 1.0;
  describe_parameters(result, threshold.level, profiles);
  result.weakest_words = weakest_direction_words(result);
  return result;
}

}  // namespace tpm::fit
