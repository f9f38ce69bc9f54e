#include "tpm/fit/likelihood/bootstrap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/base/distributions.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/likelihood/correlation.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kJackknifeGroups = 50;

/// A range of consecutive readings.
struct Stretch {
  std::size_t first = 0, length = 0;
};

std::vector<Stretch> recordings_of(const Refittable& fit) {
  std::vector<Stretch> stretches;
  const std::vector<std::size_t> lengths = fit.recording_lengths();
  stretches.reserve(lengths.size());
  std::size_t first = 0;
  for (const std::size_t length : lengths) {
    stretches.push_back({first, length});
    first += length;
  }
  return stretches;
}

/// Draws data sets by one way of resampling.
class Resampler {
 public:
  Resampler(const Refittable& fit, std::size_t parameter_count, const Minimum& minimum,
            const BootstrapOptions& options)
      : fit_(fit),
        natural_(minimum.natural),
        resampling_(options.resampling),
        recordings_(recordings_of(fit)),
        z_(fit.standardised_residuals(minimum.natural)),
        random_(options.seed) {
    if (resampling_ == Resampling::recordings) {
      require_two_recordings();
      return;
    }
    widen(parameter_count);
    if (resampling_ == Resampling::blocks) prepare_blocks(options.block_length);
  }

  [[nodiscard]] std::size_t block_length() const { return block_; }

  [[nodiscard]] std::unique_ptr<ResidualFunction> draw() {
    if (resampling_ == Resampling::recordings) {
      std::vector<std::size_t> readings;
      for (std::size_t i = 0; i < recordings_.size(); ++i) {
        append(recordings_[random_.below(recordings_.size())], readings);
      }
      return fit_.with_readings(readings);
    }
    std::vector<double> z;
    z.reserve(z_.size());
    for (const Stretch& recording : recordings_) fill(recording.length, z);
    return fit_.with_residuals(natural_, z);
  }

  /// Groups of readings that are left out together to see how the estimate depends on them: as
  /// independent of each other as what is drawn.
  [[nodiscard]] std::vector<std::vector<std::size_t>> jackknife_groups() const {
    const std::size_t units =
        resampling_ == Resampling::recordings ? recordings_.size() : z_.size() / block_;
    const std::size_t count = std::min(units, kJackknifeGroups);
    std::vector<std::vector<std::size_t>> groups(count);
    if (resampling_ == Resampling::recordings) {
      for (std::size_t i = 0; i < units; ++i) append(recordings_[i], groups[i % count]);
      return groups;
    }
    // Neighbours stay together under blocks; under independence any division will do.
    for (std::size_t i = 0; i < z_.size(); ++i) groups[i * count / z_.size()].push_back(i);
    return groups;
  }

  [[nodiscard]] std::size_t reading_count() const { return z_.size(); }

 private:
  static void append(const Stretch& stretch, std::vector<std::size_t>& readings) {
    for (std::size_t i = 0; i < stretch.length; ++i) readings.push_back(stretch.first + i);
  }

  void require_two_recordings() const {
    if (recordings_.size() >= 2) return;
    throw bad_input("bootstrap", fmt::format("{} recordings to draw from", recordings_.size()),
                    "at least 2, or resampling of residuals or blocks");
  }

  /// Centres the residuals and gives them back the spread that the parameters took.
  void widen(std::size_t parameter_count) {
    if (z_.size() <= parameter_count) {
      throw bad_input("bootstrap",
                      fmt::format("{} readings for {} parameters", z_.size(), parameter_count),
                      "more readings than parameters");
    }
    const auto n = static_cast<double>(z_.size());
    const double mean = std::accumulate(z_.begin(), z_.end(), 0.0) / n;
    const double factor = std::sqrt(n / (n - static_cast<double>(parameter_count)));
    for (double& z : z_) z = (z - mean) * factor;
  }

  void prepare_blocks(std::size_t wanted) {
    std::vector<std::span<const double>> parts;
    parts.reserve(recordings_.size());
    std::size_t longest = 1;
    for (const Stretch& r : recordings_) {
      parts.push_back(std::span<const double>(z_).subspan(r.first, r.length));
      longest = std::max(longest, r.length);
    }
    block_ = wanted > 0
                 ? wanted
                 : tpm::fit::block_length(residual_correlation(parts).integrated_time, z_.size());
    block_ = std::min(block_, longest);
    for (const Stretch& r : recordings_) {
      for (std::size_t i = 0; i + block_ <= r.length; ++i) block_starts_.push_back(r.first + i);
    }
  }

  /// Appends `count` residuals: single ones, or blocks of which the last is cut.
  void fill(std::size_t count, std::vector<double>& z) {
    const std::size_t end = z.size() + count;
    while (z.size() < end) {
      const std::size_t start = resampling_ == Resampling::blocks
                                    ? block_starts_[random_.below(block_starts_.size())]
                                    : random_.below(z_.size());
      for (std::size_t i = 0; i < block_ && z.size() < end; ++i) z.push_back(z_[start + i]);
    }
  }

  const Refittable& fit_;
  std::vector<double> natural_;
  Resampling resampling_;
  std::vector<Stretch> recordings_;
  std::vector<double> z_;
  Random random_;
  std::size_t block_ = 1;
  std::vector<std::size_t> block_starts_;
};

void require_valid_options(const BootstrapOptions& options) {
  if (options.replicates < 20) {
    throw bad_input("bootstrap", fmt::format("{} replicates", options.replicates), "at least 20");
  }
  if (!(options.level > 0.0 && options.level < 1.0)) {
    throw bad_input("bootstrap", fmt::format("a confidence level of {}", options.level),
                    "a number between 0 and 1");
  }
}

/// Value below which a share p of the distribution lies.
double quantile_of(const std::vector<double>& sorted, double p) {
  const auto n = static_cast<double>(sorted.size());
  const double place = std::clamp((n + 1.0) * p - 1.0, 0.0, n - 1.0);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - std::floor(place)) * (sorted[above] - sorted[below]);
}

/// Skewness of the estimate's influence function, in theta: sum u^3 / (6 (sum u^2)^(3/2)).
double acceleration_of(const std::vector<double>& left_out) {
  if (left_out.size() < 3) return 0.0;
  const double mean =
      std::accumulate(left_out.begin(), left_out.end(), 0.0) / static_cast<double>(left_out.size());
  double squares = 0.0;
  double cubes = 0.0;
  for (const double value : left_out) {
    const double u = mean - value;
    squares += u * u;
    cubes += u * u * u;
  }
  return squares > 0.0 ? cubes / (6.0 * squares * std::sqrt(squares)) : 0.0;
}

std::optional<BootstrapInterval> bca_interval(const std::vector<double>& sorted, double estimate,
                                              double acceleration, double level) {
  const auto below = static_cast<double>(std::lower_bound(sorted.begin(), sorted.end(), estimate) -
                                         sorted.begin());
  const auto up_to = static_cast<double>(std::upper_bound(sorted.begin(), sorted.end(), estimate) -
                                         sorted.begin());
  const double share = 0.5 * (below + up_to) / static_cast<double>(sorted.size());
  if (!(share > 0.0 && share < 1.0)) return std::nullopt;
  const double z0 = normal_quantile(share);
  const auto limit = [&](double p) {
    const double z = z0 + normal_quantile(p);
    return quantile_of(sorted, normal_cdf(z0 + z / (1.0 - acceleration * z)));
  };
  return BootstrapInterval{limit(0.5 * (1.0 - level)), limit(0.5 * (1.0 + level))};
}

/// Ends of refits that could be used, one row per refit.
struct Refits {
  std::vector<std::vector<double>> natural;
  int failed = 0, not_converged = 0;

  void add(const ResidualFunction& function, std::span<const FitParameter> parameters,
           const Minimum& minimum) {
    Minimum m = minimise(function, parameters, minimum.natural);
    function.exchange_order().sort(m.natural);
    if (!m.usable) {
      ++failed;
      return;
    }
    if (!m.converged) ++not_converged;
    natural.push_back(m.natural);
  }

  [[nodiscard]] std::vector<double> of_parameter(std::size_t index) const {
    return mapped<double>(natural, [&](const std::vector<double>& row) { return row[index]; });
  }
};

Refits jackknife(const Refittable& fit, std::span<const FitParameter> parameters,
                 const Minimum& minimum, const Resampler& resampler) {
  Refits refits;
  for (const std::vector<std::size_t>& group : resampler.jackknife_groups()) {
    std::vector<bool> left_out(resampler.reading_count(), false);
    for (const std::size_t reading : group) left_out[reading] = true;
    std::vector<std::size_t> kept;
    kept.reserve(left_out.size() - group.size());
    for (std::size_t i = 0; i < left_out.size(); ++i) {
      if (!left_out[i]) kept.push_back(i);
    }
    refits.add(*fit.with_readings(kept), parameters, minimum);
  }
  return refits;
}

BootstrapParameter distribution_of(const FitParameter& parameter, double estimate,
                                   std::vector<double> replicates,
                                   const std::vector<double>& left_out, double level) {
  BootstrapParameter p;
  p.name = parameter.name;
  p.estimate = estimate;
  const auto n = static_cast<double>(replicates.size());
  const double mean = std::accumulate(replicates.begin(), replicates.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : replicates) squares += (value - mean) * (value - mean);
  p.standard_error = std::sqrt(squares / (n - 1.0));
  p.bias = mean - estimate;
  std::vector<double> sorted = replicates;
  std::sort(sorted.begin(), sorted.end());
  p.percentile = {quantile_of(sorted, 0.5 * (1.0 - level)),
                  quantile_of(sorted, 0.5 * (1.0 + level))};
  p.acceleration = acceleration_of(left_out);
  p.bca = bca_interval(sorted, estimate, p.acceleration, level);
  p.replicates = std::move(replicates);
  return p;
}

std::string drawn_words(const BootstrapResult& result) {
  switch (result.options.resampling) {
    case Resampling::residuals:
      return "residuals";
    case Resampling::blocks:
      return fmt::format("blocks of {} neighbouring residuals", result.block_length);
    case Resampling::recordings:
      return "whole recordings";
  }
  return "";
}

std::string bootstrap_words(const BootstrapResult& result) {
  std::string words = fmt::format("{} refits to resampled {}, seed {}", result.options.replicates,
                                  drawn_words(result), result.options.seed);
  if (result.failed > 0)
    words += fmt::format(", {} of them failed and are left out", result.failed);
  if (result.not_converged > 0) words += fmt::format(", {} did not converge", result.not_converged);
  if (result.jackknife_failed > 0) {
    words += fmt::format(", {} jackknife refits failed", result.jackknife_failed);
  }
  return words;
}

}  // namespace

BootstrapResult bootstrap(const Refittable& fit, std::span<const FitParameter> parameters,
                          const Minimum& minimum, const BootstrapOptions& options) {
  require_valid_options(options);
  Resampler resampler(fit, parameters.size(), minimum, options);
  Refits refits;
  Progress progress("refitting resampled data", static_cast<std::size_t>(options.replicates));
  for (int i = 0; i < options.replicates; ++i) {
    refits.add(*resampler.draw(), parameters, minimum);
    progress.advance();
  }
  if (2 * refits.failed > options.replicates) {
    throw Error(ExitCode::numerical, "bootstrap",
                fmt::format("{} of {} refits failed", refits.failed, options.replicates));
  }
  const Refits left_out = jackknife(fit, parameters, minimum, resampler);
  BootstrapResult result;
  result.options = options;
  result.block_length = resampler.block_length();
  result.failed = refits.failed;
  result.not_converged = refits.not_converged;
  result.jackknife_failed = left_out.failed;
  result.parameters.reserve(parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    result.parameters.push_back(distribution_of(parameters[i], minimum.natural[i],
                                                refits.of_parameter(i), left_out.of_parameter(i),
                                                options.level));
  }
  result.summary = bootstrap_words(result);
  return result;
}

}  // namespace tpm::fit
