#include "tpm/fit/groups/random_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

void require_estimates(std::span<const SpecimenEstimate> specimens, double level) {
  if (specimens.empty()) throw bad_input("specimens", "none is given", "at least one");
  if (!(level > 0.0 && level < 1.0)) {
    throw bad_input("specimens", fmt::format("a confidence level of {}", shortest(level)),
                    "a number between 0 and 1");
  }
  for (const SpecimenEstimate& s : specimens) {
    if (std::isfinite(s.estimate) && std::isfinite(s.standard_error) && s.standard_error > 0.0) {
      continue;
    }
    throw bad_input(fmt::format("specimen '{}'", s.name),
                    fmt::format("estimate {} with standard error {}", shortest(s.estimate),
                                shortest(s.standard_error)),
                    "a finite estimate and a positive standard error");
  }
}

WeightedMean weighted_mean(std::span<const SpecimenEstimate> specimens, double tau_squared) {
  WeightedMean m;
  for (const SpecimenEstimate& s : specimens) {
    const double variance = s.standard_error * s.standard_error + tau_squared;
    m.weights += 1.0 / variance;
    m.mean += s.estimate / variance;
    m.log_variance += std::log(variance);
  }
  m.mean /= m.weights;
  for (const SpecimenEstimate& s : specimens) {
    const double d = s.estimate - m.mean;
    m.squares += d * d / (s.standard_error * s.standard_error + tau_squared);
  }
  return m;
}

namespace {

using Groups = std::span<const std::vector<SpecimenEstimate>>;

/// -2 ln of the restricted likelihood, without constants.
double restricted_deviance(Groups groups, double tau_squared) {
  double deviance = 0.0;
  for (const auto& group : groups) {
    const WeightedMean m = weighted_mean(group, tau_squared);
    deviance += m.log_variance + std::log(m.weights) + m.squares;
  }
  return deviance;
}

EffectInterval around(double middle, double half_width) {
  return {middle - half_width, middle + half_width};
}

RandomEffects one_specimen(const SpecimenEstimate& s, double level) {
  RandomEffects result;
  result.specimens = 1;
  result.mean = s.estimate;
  result.standard_error = s.standard_error;
  const double z = normal_quantile(0.5 * (1.0 + level));
  result.interval = around(s.estimate, z * s.standard_error);
  result.summary = "one specimen: nothing is known about the spread between specimens";
  return result;
}

std::string effects_words(const RandomEffects& r) {
  const std::string spread =
      r.tau_at_zero ? std::string("no spread between specimens beyond their standard errors")
                    : fmt::format("specimens spread with a standard deviation of {} in theta",
                                  significant(std::sqrt(*r.tau_squared), 3));
  return fmt::format(
      "{} specimens: {} (I^2 = {:.0f} %, {} p = {}){}", r.specimens, spread, 100.0 * *r.i_squared,
      r.repeat_degrees > 0 ? "F test against the repeats" : "Cochran's Q",
      significant(*r.q_p_value, 2), r.new_specimen ? "" : "; too few to predict a new one");
}

std::string repeat_words(const RandomEffects& r) {
  return *r.repeat_variance > 0.0
             ? fmt::format(
                   "; repeats of a specimen differ with a standard deviation of {} in theta",
                   significant(std::sqrt(*r.repeat_variance), 3))
             : std::string("; repeats of a specimen agree within their standard errors");
}

/// Sums over the repeats of all specimens, with weights 1/s^2.
struct RepeatSums {
  double within = 0.0;   ///< sum w (y - mean of the specimen)^2
  double between = 0.0;  ///< sum W (mean of the specimen - mean)^2
  double scale = 0.0;    ///< sum over the specimens of sum w - sum w^2 / sum w
  int degrees = 0;       ///< repeats less specimens
};

using Repeats = std::vector<std::vector<SpecimenEstimate>>;

/// The specimens in the order of their first repeats.
Repeats by_specimen(std::span<const SpecimenEstimate> repeats) {
  const auto specimen_of = [](const SpecimenEstimate& e) {
    return e.specimen.empty() ? e.name : e.specimen;
  };
  Repeats groups;
  for (const SpecimenEstimate& e : repeats) {
    const auto known = std::ranges::find_if(
        groups, [&](const auto& group) { return specimen_of(group.front()) == specimen_of(e); });
    (known == groups.end() ? groups.emplace_back() : *known).push_back(e);
  }
  return groups;
}

RepeatSums repeat_sums(const Repeats& groups, double mean) {
  RepeatSums sums;
  for (const auto& group : groups) {
    const WeightedMean own = weighted_mean(group, 0.0);
    double squared_weights = 0.0;
    for (const SpecimenEstimate& e : group) squared_weights += std::pow(e.standard_error, -4.0);
    sums.within += own.squares;
    sums.between += own.weights * std::pow(own.mean - mean, 2);
    sums.scale += own.weights - squared_weights / own.weights;
    sums.degrees += static_cast<int>(group.size()) - 1;
  }
  return sums;
}

}  // namespace

/// The deviance may have a second minimum at 0 or inside, so it is scanned before it is refined.
double restricted_tau_squared(Groups groups) {
  double least = groups[0][0].standard_error;
  double widest = 0.0;
  for (const auto& group : groups) {
    double low = group[0].estimate;
    double high = low;
    for (const SpecimenEstimate& s : group) {
      least = std::min(least, s.standard_error);
      low = std::min(low, s.estimate);
      high = std::max(high, s.estimate);
    }
    widest = std::max(widest, high - low);
  }
  // Below, tau^2 is nothing beside the variances; the spread of the estimates is the most it can
  // be.
  const double from = std::log(1e-9 * least * least);
  const double to = std::log(std::max(widest * widest, least * least));
  const auto deviance = [&](double log_tau_squared) {
    return restricted_deviance(groups, std::exp(log_tau_squared));
  };
  constexpr int kScan = 400;
  const double width = (to - from) / kScan;
  int best = 0;
  for (int i = 1; i <= kScan; ++i) {
    if (deviance(from + i * width) < deviance(from + best * width)) best = i;
  }
  constexpr int kBits = 40;
  const auto [log_tau_squared, minimum] = boost::math::tools::brent_find_minima(
      deviance, from + (best - 1) * width, from + (best + 1) * width, kBits);
  // At the lower end the minimum is at 0 itself.
  if (best == 0 || restricted_deviance(groups, 0.0) <= minimum) return 0.0;
  return std::exp(log_tau_squared);
}

SpecimenMeans specimen_means(std::span<const SpecimenEstimate> repeats) {
  const Repeats groups = by_specimen(repeats);
  const RepeatSums sums = repeat_sums(groups, weighted_mean(repeats, 0.0).mean);
  SpecimenMeans means;
  means.repeat_degrees = sums.degrees;
  if (sums.degrees > 0) {
    means.repeat_variance = std::max(0.0, (sums.within - sums.degrees) / sums.scale);
  }
  for (const auto& group : groups) {
    const WeightedMean own = weighted_mean(group, means.repeat_variance);
    const SpecimenEstimate& first = group.front();
    means.specimens.push_back({first.specimen.empty() ? first.name : first.specimen, own.mean,
                               1.0 / std::sqrt(own.weights)});
  }
  return means;
}

RandomEffects random_effects(std::span<const SpecimenEstimate> specimens, double level) {
  require_estimates(specimens, level);
  if (specimens.size() == 1) return one_specimen(specimens[0], level);
  RandomEffects r;
  r.specimens = specimens.size();
  const auto degrees = static_cast<double>(r.specimens - 1);
  const std::vector<SpecimenEstimate> group(specimens.begin(), specimens.end());
  r.tau_squared = restricted_tau_squared({&group, 1});
  r.tau_at_zero = *r.tau_squared == 0.0;
  const WeightedMean m = weighted_mean(specimens, *r.tau_squared);
  r.mean = m.mean;
  r.standard_error = std::sqrt(std::max(1.0, m.squares / degrees) / m.weights);
  const double t = student_quantile(0.5 * (1.0 + level), degrees);
  r.interval = around(r.mean, t * r.standard_error);
  const double q = weighted_mean(specimens, 0.0).squares;
  r.q = q;
  r.q_p_value = chi_squared_tail(q, degrees);
  r.i_squared = q > 0.0 ? std::max(0.0, (q - degrees) / q) : 0.0;
  if (r.specimens >= 3) {
    r.new_specimen = around(r.mean, t * std::hypot(std::sqrt(*r.tau_squared), r.standard_error));
  }
  r.summary = effects_words(r);
  return r;
}

RandomEffects random_effects_of_repeats(std::span<const SpecimenEstimate> repeats, double level) {
  require_estimates(repeats, level);
  const Repeats groups = by_specimen(repeats);
  const RepeatSums sums = repeat_sums(groups, weighted_mean(repeats, 0.0).mean);
  if (sums.degrees == 0) return random_effects(repeats, level);
  const SpecimenMeans means = specimen_means(repeats);
  RandomEffects r = random_effects(means.specimens, level);
  r.repeat_variance = means.repeat_variance;
  r.repeat_degrees = sums.degrees;
  if (r.specimens > 1) {
    const double f = (sums.between / static_cast<double>(r.specimens - 1)) /
                     (sums.within / static_cast<double>(sums.degrees));
    r.q = f;
    r.q_p_value =
        std::isfinite(f) ? fisher_tail(f, static_cast<double>(r.specimens - 1), sums.degrees) : 0;
    r.summary = effects_words(r);
  }
  r.summary += repeat_words(r);
  return r;
}

}  // namespace tpm::fit
