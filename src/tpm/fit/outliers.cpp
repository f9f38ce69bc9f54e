#include "tpm/fit/outliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/fit/likelihood/quantum.hpp"
#include "tpm/fit/spikes_at_rest.hpp"

namespace tpm::fit {
namespace {

constexpr double kFarFromCurve = 8.0;  // robust standard deviations
constexpr double kNearCurve = 4.0;
constexpr std::size_t kMostTogether = 3;

bool may_have_outliers(const FitConfig& config) {
  if (config.loss.kind != Loss::none) return false;
  return std::ranges::all_of(config.data, [](const DataChoice& d) {
    return d.noise.shape == ErrorShape::normal && !d.estimates_sigma();
  });
}

/// Readings of one recording and their distances from the curve.
struct CurveDistance {
  std::vector<std::size_t> data;
  std::vector<double> time_s, reading, sigma, distance;
};

/// 0 if there is no noise to compare with.
double robust_deviation(const CurveDistance& d) {
  constexpr double kOfMedian = 1.4826;
  constexpr double kNoise = 1e-7;  // of the declared noise: below, it is rounding of numbers
  std::vector<double> sizes;
  for (const double z : d.distance) sizes.push_back(std::abs(z));
  std::ranges::sort(sizes);
  const double own = kOfMedian * sizes[sizes.size() / 2];
  if (!(own > kNoise)) return 0.0;
  // Half of the readings are on the nearest level, and the median sees nothing, as long as noise is
  // below 0.74 steps. The tenth that is farthest from the curve sees it from 0.3 steps on.
  constexpr double kSeenByMedian = 0.74, kOfNineTenths = 1.645;
  const double step = quantum_of(d.reading) / *std::ranges::min_element(d.sigma);
  const double outer = sizes[sizes.size() * 9 / 10] / kOfNineTenths;
  return std::max({own, step / std::sqrt(12.0), std::min(outer, kSeenByMedian * step)});
}

/// Distances that leave those of their neighbours and return. A large spike where readings are few
/// bends the curve, and the readings beside it are then not near the curve either.
std::vector<bool> lone_spikes(const CurveDistance& d) {
  const std::vector<double> clean = without_spikes(d.time_s, d.distance);
  std::vector<bool> spikes(clean.size(), false);
  const auto differs = [&](std::size_t i) { return clean[i] != d.distance[i]; };
  for (std::size_t i = 1; i + 1 < clean.size(); ++i) {
    spikes[i] = differs(i) && !differs(i - 1) && !differs(i + 1);
  }
  return spikes;
}

std::vector<std::size_t> outliers_of(const CurveDistance& d) {
  constexpr std::size_t kFewest = 20;
  if (d.data.size() < kFewest) return {};
  const double sd = robust_deviation(d);
  if (!(sd > 0.0)) return {};
  const auto beyond = [&](std::size_t i, double times) {
    return std::abs(d.distance[i]) > times * sd;
  };
  std::vector<bool> lies_off = lone_spikes(d);
  for (std::size_t i = 0; i < lies_off.size(); ++i) {
    lies_off[i] = lies_off[i] && beyond(i, kFarFromCurve);
  }
  for (std::size_t i = 0; i < d.data.size(); ++i) {
    if (!beyond(i, kFarFromCurve)) continue;
    std::size_t end = i;
    while (end < d.data.size() && beyond(end, kFarFromCurve)) ++end;
    bool one_sign = true;
    for (std::size_t k = i; k < end; ++k)
      one_sign &= (d.distance[k] > 0.0) == (d.distance[i] > 0.0);
    // Several in a row on one side are no scatter but something that lasted, a start-up or a slip:
    // adequacy tells it.
    const bool scattered = end - i == 1 || (end - i <= kMostTogether && !one_sign);
    const bool alone = scattered && (i == 0 || !beyond(i - 1, kNearCurve)) &&
                       (end == d.data.size() || !beyond(end, kNearCurve));
    for (std::size_t k = i; k < end && alone; ++k) lies_off[k] = true;
    i = end;
  }
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < lies_off.size(); ++i) {
    if (lies_off[i]) found.push_back(d.data[i]);
  }
  const bool few = 20 * found.size() <= d.data.size();
  return few ? found : std::vector<std::size_t>();
}

}  // namespace

std::vector<std::size_t> isolated_outliers(const ExperimentResiduals& function,
                                           std::span<const double> natural) {
  std::vector<std::size_t> outliers;
  if (!may_have_outliers(function.config())) return outliers;
  const Eigen::VectorXd answer = function.predict(natural, nullptr);
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    CurveDistance distances;
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = function.data()[i];
      if ((d.held_out && !d.outlier) || !d.value) continue;
      distances.data.push_back(i);
      distances.time_s.push_back(d.time_s);
      distances.reading.push_back(*d.value);
      distances.sigma.push_back(d.sigma);
      distances.distance.push_back(
          function.standardised(i, answer[static_cast<Eigen::Index>(i)], natural));
    }
    const std::vector<std::size_t> found = outliers_of(distances);
    outliers.insert(outliers.end(), found.begin(), found.end());
  }
  std::ranges::sort(outliers);
  return outliers;
}

std::string outlier_words(const ExperimentResiduals& function,
                          std::span<const std::size_t> outliers) {
  constexpr std::size_t kNamed = 5;
  std::string where;
  for (std::size_t k = 0; k < std::min(outliers.size(), kNamed); ++k) {
    where += (k > 0 ? ", " : "") + datum_label(function.data()[outliers[k]]);
  }
  if (outliers.size() > kNamed) where += fmt::format(" and {} more", outliers.size() - kNamed);
  return fmt::format(
      "{} outlier{} ({}): more than {} robust standard deviations from the curve, which the "
      "readings beside are not; left out of the fit (noise of distribution 'student_t' keeps them)",
      outliers.size(), outliers.size() == 1 ? "" : "s", where, kFarFromCurve);
}

}  // namespace tpm::fit
