#include "tpm/fit/select/reading_scatter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/adequacy.hpp"

namespace tpm::fit {
namespace {

constexpr double kLevelOfScatter = 0.01;

/// One reading of a curve: its size, the residual, and the residual in its noise.
struct ScatteredReading {
  double at = 0.0, size = 0.0, residual = 0.0, standardised = 0.0;
};

/// The readings of each quantity in the order of time or frequency; none of other data.
std::vector<std::vector<ScatteredReading>> reading_curves(const FitResult& fit) {
  std::map<Quantity, std::vector<ScatteredReading>> curves;
  if (!fit.recordings.empty() || fit.config.data.size() != 1) return {};
  for (const FittedDatum& d : fit.data) {
    if (d.datum.held_out || !d.datum.value) continue;
    if (!d.datum.frequency_Hz && !std::isfinite(d.datum.time_s)) return {};
    curves[d.datum.quantity].push_back({d.datum.frequency_Hz.value_or(d.datum.time_s),
                                        std::abs(*d.datum.value), d.predicted - *d.datum.value,
                                        d.standardised});
  }
  std::vector<std::vector<ScatteredReading>> list;
  for (auto& [quantity, readings] : curves) {
    std::ranges::stable_sort(readings, {}, &ScatteredReading::at);
    list.push_back(std::move(readings));
  }
  return list;
}

void state_not_described(FitResult& fit, const FunctionScatter& scatter, const std::string& other) {
  LawAdequacy adequacy;
  adequacy.verdict = described_name(Described::not_described);
  adequacy.residual_over_noise = scatter.residual_over_scatter;
  adequacy.summary = fmt::format(
      "{} these readings: the residuals follow each other, {} times the scatter of neighbouring "
      "readings{}",
      other.empty() ? "no law tried describes"
                    : fmt::format("{} does not describe", law_name(fit.config.law.value())),
      times_text(scatter.residual_over_scatter),
      other.empty() ? std::string() : fmt::format("; {} does", other));
  fit.adequacy = std::move(adequacy);
  for (ParameterResult& p : fit.parameters) {
    p.only_if_described = true;
    p.summary += "; this supposes that the law describes the data, which it does not";
  }
}

bool follow_each_other(const std::optional<FunctionScatter>& scatter) {
  return scatter && scatter->p_value < kLevelOfScatter;
}

/// Twice the log likelihood of second differences of the residuals, less a constant.
double likelihood_of_floor(const std::vector<std::pair<double, double>>& differences,
                           double floor) {
  double squares = 0.0, logs = 0.0;
  for (const auto& [size, off] : differences) {
    const double sigma = floor + size;
    squares += off * off / (sigma * sigma);
    logs += std::log(sigma);
  }
  return -2.0 * logs - static_cast<double>(differences.size()) * std::log(squares);
}

}  // namespace

std::optional<FunctionScatter> reading_scatter(const FitResult& fit) {
  constexpr double kFewestPairs = 8.0, kRounding = 1e-6;
  double pairs = 0.0, count = 0.0, squares = 0.0, products = 0.0, differences = 0.0;
  double share = 0.0;  // of its size, the largest residual
  for (const auto& curve : reading_curves(fit)) {
    double largest = 0.0;
    for (const ScatteredReading& r : curve) largest = std::max(largest, r.size);
    for (std::size_t i = 0; i < curve.size(); ++i) {
      const double z = curve[i].standardised;
      squares += z * z;
      count += 1.0;
      // No instrument reads more decades at once.
      const double size = std::max(curve[i].size, kRounding * largest);
      if (size > 0.0) share = std::max(share, std::abs(curve[i].residual) / size);
      if (i == 0) continue;
      const double before = curve[i - 1].standardised;
      products += before * z;
      differences += (z - before) * (z - before);
      pairs += 1.0;
    }
  }
  const double degrees = count - static_cast<double>(fit.parameters.size());
  const bool enough = pairs >= kFewestPairs && degrees >= 1.0 && share > kRounding;
  if (!enough || !(squares > 0.0 && differences > 0.0)) return std::nullopt;
  FunctionScatter scatter;
  scatter.residual_over_scatter = std::sqrt(squares / degrees / (0.5 * differences / pairs));
  const double z = products / squares * std::sqrt(pairs);
  const double both = chi_squared_tail(z * z, 1.0);
  scatter.p_value = z > 0.0 ? 0.5 * both : 1.0 - 0.5 * both;
  return scatter;
}

void state_scatter(Selection& s) {
  Candidate& chosen = s.candidates[s.recommended];
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) return;
  const auto scatter = reading_scatter(chosen.fit);
  if (!follow_each_other(scatter)) return;
  std::string other;
  for (const Candidate& c : s.candidates) {
    if (c.failed || &c == &chosen || !other.empty()) continue;
    const auto its = reading_scatter(c.fit);
    if (its && !follow_each_other(its)) other = law_name(c.law);
  }
  state_not_described(chosen.fit, *scatter, other);
  chosen.identified = false;
  chosen.reason = "does not describe the data";
}

void state_scatter(FitResult& fit) {
  if (!fit.config.choice || fit.adequacy) return;
  const auto scatter = reading_scatter(fit);
  if (follow_each_other(scatter)) state_not_described(fit, *scatter, {});
}

namespace {

/// Second differences of the residuals along each curve, beside the sizes of their readings.
struct ScatterOfSizes {
  std::vector<std::pair<double, double>> differences;  // size of a reading, second difference
  double largest = 0.0;                                ///< reading
};

/// None below 16 readings of a curve, and for readings without scatter.
std::optional<ScatterOfSizes> scatter_of_sizes(const FitResult& fit) {
  constexpr std::size_t kFewest = 16;
  constexpr double kSixths = 6.0;  // variance of a second difference, in those of a reading
  ScatterOfSizes scatter;
  for (const auto& curve : reading_curves(fit)) {
    if (curve.size() < kFewest) return std::nullopt;
    for (std::size_t i = 0; i < curve.size(); ++i) {
      scatter.largest = std::max(scatter.largest, curve[i].size);
      if (i == 0 || i + 1 == curve.size()) continue;
      const double off = curve[i - 1].residual - 2.0 * curve[i].residual + curve[i + 1].residual;
      const double size = (curve[i - 1].size + curve[i].size + curve[i + 1].size) / 3.0;
      scatter.differences.emplace_back(size, off / std::sqrt(kSixths));
    }
  }
  constexpr double kExact = 1e-6;
  const bool scattered = std::ranges::any_of(
      scatter.differences, [&](const auto& d) { return std::abs(d.second) > kExact * d.first; });
  return scattered ? std::optional(std::move(scatter)) : std::nullopt;
}

constexpr double kNeighbours = 2.0;  // second differences share readings: half as many count

/// Floors a / b that are tried, with their likelihoods.
std::vector<std::pair<double, double>> likelihoods_of_floors(const ScatterOfSizes& scatter) {
  constexpr int kSteps = 81;
  constexpr double kDecades = 8.0;
  std::vector<std::pair<double, double>> tried;
  for (int i = 0; i < kSteps; ++i) {
    const double floor =
        scatter.largest * std::pow(10.0, -0.75 * kDecades + kDecades * i / (kSteps - 1));
    tried.emplace_back(floor, likelihood_of_floor(scatter.differences, floor));
  }
  return tried;
}

}  // namespace

std::optional<double> scatter_floor(const FitResult& fit) {
  const NoiseKind kind = fit.config.data.front().noise.kind;
  if (kind != NoiseKind::relative_to_datum && kind != NoiseKind::absolute) return std::nullopt;
  if (fit.config.data.front().noise.angle_rad) return std::nullopt;
  const auto scatter = scatter_of_sizes(fit);
  if (!scatter) return std::nullopt;
  const auto tried = likelihoods_of_floors(*scatter);
  const auto best = std::ranges::max_element(tried, {}, &std::pair<double, double>::second);
  const double assumed = (kind == NoiseKind::absolute ? tried.back() : tried.front()).second;
  // On a bound of the parameter the statistic is half a chi-square.
  if (chi_squared_tail(std::max(best->second - assumed, 0.0) / kNeighbours, 1.0) >=
      2.0 * kLevelOfScatter) {
    return std::nullopt;
  }
  return best->first;
}

Remark MagnitudeAndPhase::remark() const {
  return {"noise_of_magnitude_and_phase",
          fmt::format("magnitude and phase were measured, and scatter by {} % and {} deg: each "
                      "counts by its own scatter",
                      significant(100.0 * magnitude, 2),
                      significant(phase_rad * 180.0 / std::numbers::pi, 2))};
}

std::optional<MagnitudeAndPhase> scatter_of_magnitude_and_phase(const FitResult& fit) {
  constexpr std::size_t kFewest = 16;
  constexpr double kExact = 1e-6;
  if (!fit.config.data.front().noise.angle_rad) return std::nullopt;
  const auto curves = reading_curves(fit);  // storage, loss
  if (curves.size() != 2 || curves[0].size() != curves[1].size() || curves[0].size() < kFewest) {
    return std::nullopt;
  }
  const std::size_t n = curves[0].size();
  double magnitude = 0.0, phase = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const ScatteredReading& storage = curves[0][i];
    const ScatteredReading& loss = curves[1][i];
    const std::complex<double> measured(storage.size, loss.size);
    const auto off =
        std::log((measured + std::complex(storage.residual, loss.residual)) / measured);
    magnitude += off.real() * off.real();
    phase += off.imag() * off.imag();
  }
  const double degrees = static_cast<double>(n) - 0.5 * static_cast<double>(fit.parameters.size());
  MagnitudeAndPhase scatter{std::sqrt(magnitude / degrees), std::sqrt(phase / degrees)};
  const bool scattered = scatter.magnitude > kExact && scatter.phase_rad > kExact;
  return scattered ? std::optional(scatter) : std::nullopt;
}

std::optional<double> most_scatter_of_small(const FitResult& fit) {
  constexpr double kLevel = 0.05;
  const auto scatter = scatter_of_sizes(fit);
  if (!scatter) return std::nullopt;
  const auto tried = likelihoods_of_floors(*scatter);
  const double best =
      std::ranges::max_element(tried, {}, &std::pair<double, double>::second)->second;
  double most = 0.0;
  for (const auto& [floor, likelihood] : tried) {
    if (chi_squared_tail((best - likelihood) / kNeighbours, 1.0) < kLevel) continue;
    double squares = 0.0;
    for (const auto& [size, off] : scatter->differences) {
      squares += off * off / ((floor + size) * (floor + size));
    }
    const double share = std::sqrt(squares / static_cast<double>(scatter->differences.size()));
    most = std::max(most, share * floor);
  }
  return most;
}

}  // namespace tpm::fit
