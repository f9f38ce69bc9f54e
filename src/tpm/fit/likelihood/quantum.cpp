#include "tpm/fit/likelihood/quantum.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {

double quantum_of(std::span<const double> readings) {
  constexpr double kSame = 1e-9;    // of the range: one level, written with rounding
  constexpr double kOnGrid = 0.02;  // of the step
  constexpr double kShareOnGrid = 0.99;
  if (readings.size() < 2) return 0.0;
  std::vector<double> levels(readings.begin(), readings.end());
  std::ranges::sort(levels);
  const double range = levels.back() - levels.front();
  double step = range;
  for (std::size_t i = 1; i < levels.size(); ++i) {
    const double gap = levels[i] - levels[i - 1];
    if (gap > kSame * range) step = std::min(step, gap);
  }
  if (!(step > 0.0)) return 0.0;
  std::size_t on_grid = 0;
  std::size_t gaps = 0;
  for (std::size_t i = 1; i < levels.size(); ++i) {
    const double gap = (levels[i] - levels[i - 1]) / step;
    if (gap * step <= kSame * range) continue;
    ++gaps;
    on_grid += std::abs(gap - std::round(gap)) <= kOnGrid * gap;
  }
  const bool grid = static_cast<double>(on_grid) >= kShareOnGrid * static_cast<double>(gaps);
  return grid ? step : 0.0;
}

double hidden_noise_variance(double degrees) {
  constexpr double kOfHalfStep = 4.0 / 3.0;  // (1/4 + 1/12) q^2 = 4/3 (q/2)^2
  constexpr double kChance = 0.05;
  constexpr double kFew = 0.5;  // few readings do not tell: half a step is the cautious answer
  const double counted = std::max(degrees, 1.0);
  return kOfHalfStep * std::max(chi_squared_quantile(kChance, counted) / counted, kFew);
}

RoundedLevels rounded_levels(std::span<const double> readings) {
  constexpr double kCoarse = 1e-4;     // of the range
  constexpr double kOneLevel = 0.5;    // of the step
  constexpr std::size_t kFewest = 20;  // levels of a motion: fewer may be stairs that were imposed
  constexpr double kOfSeveral = 0.2;   // of these levels
  RoundedLevels rounded;
  if (readings.empty()) return rounded;
  const auto [low, high] = std::ranges::minmax_element(readings);
  const double step = quantum_of(readings);
  if (!(step >= kCoarse * (*high - *low))) return rounded;
  std::vector<RoundedLevel> levels;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const bool next = i == 0 || std::abs(readings[i] - readings[i - 1]) > kOneLevel * step;
    if (next) levels.push_back({i, i});
    levels.back().end = i + 1;
  }
  std::size_t passed = 0, several = 0;
  std::set<long long> different;
  for (const RoundedLevel& level : levels) {
    if (level.held(readings.size())) continue;
    ++passed;
    several += level.size() > 1;
    different.insert(std::llround((readings[level.first] - *low) / step));
  }
  const bool stairs = static_cast<double>(several) >= kOfSeveral * static_cast<double>(passed);
  if (different.size() < kFewest || !stairs) return rounded;
  return {step, std::move(levels)};
}

double computed_variance(const ExperimentResiduals& function) {
  double sum = 0.0;
  int values = 0;
  for (const FitDatum& d : function.data()) {
    if (d.held_out || !d.value) continue;
    ++values;
    if (!(d.sigma > 0.0)) continue;  // an estimated one
    const NoiseKind kind = function.config().data[d.choice].noise.kind;
    const bool of_share = kind == NoiseKind::log || kind == NoiseKind::relative_to_model;
    const double off = kComputedShare * (of_share ? 1.0 : std::abs(*d.value)) / d.sigma;
    sum += off * off;
  }
  return values > 0 ? sum / values : 0.0;
}

}  // namespace tpm::fit
