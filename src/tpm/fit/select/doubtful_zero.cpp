#include "tpm/fit/select/doubtful_zero.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/distributions.hpp"
#include "tpm/base/median.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/conditional.hpp"
#include "tpm/fit/likelihood/quantum.hpp"
#include "tpm/fit/select/doubtful_contact.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// Standard deviation of the noise of neighbouring residuals; 0 if there are too few.
double scatter_of_neighbours(const std::vector<double>& residuals) {
  constexpr std::size_t kFewest = 8;
  constexpr double kDeviationOfMedian = 1.4826;  // of a normal distribution
  if (residuals.size() < kFewest) return 0.0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < residuals.size(); ++i)
    steps.push_back(std::abs(residuals[i] - residuals[i - 1]));
  return kDeviationOfMedian * median(std::move(steps)) / std::sqrt(2.0);
}

/// Readings under load scatter by more than rounding makes, and near the rest as well as far from
/// it.
bool scatters_under_load(const RecordingFit& r, double rest) {
  constexpr double kLow = 0.3;       // of the peak: near the rest
  constexpr double kAlike = 0.5;     // of the scatter farther from it
  constexpr double kRounding = 3.0;  // steps
  constexpr double kSeen = 1e-4;     // of the peak: less is no noise, but an approximation
  std::vector<double> readings, low, high;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (!r.fitted[i] || !std::isfinite(r.predicted[i]) || !(r.observed[i] > rest)) continue;
    readings.push_back(r.observed[i]);
    const bool near = r.observed[i] - rest < kLow * (r.peak - rest);
    (near ? low : high).push_back(r.observed[i] - r.predicted[i]);
  }
  const double noise = scatter_of_neighbours(high);
  const double of_low = scatter_of_neighbours(low);
  const bool grows = of_low > 0.0 && of_low < kAlike * noise;
  return noise > std::max(kRounding * quantum_of(readings), kSeen * r.peak) && !grows;
}

/// "all 190 readings at rest are 0 N, ..."; empty if the rest was not cut off.
std::string cut_words(const RecordingFit& r, const PreparedRecording& prepared) {
  constexpr std::size_t kFewest = 20;
  const std::vector<double>& readings = prepared.recording.response;
  const std::size_t resting = std::min(samples_at_rest(prepared.phases), readings.size());
  if (prepared.load_imposed || resting < kFewest) return {};
  const double level = readings.front();
  const auto is_level = [level](double reading) { return reading == level; };
  if (!std::all_of(readings.begin(), readings.begin() + static_cast<std::ptrdiff_t>(resting),
                   is_level) ||
      *std::ranges::min_element(readings) < level || !scatters_under_load(r, level)) {
    return {};
  }
  const Unit unit = shown_unit(quantity_dimension(prepared.recording.response_quantity));
  return fmt::format(
      "{}: all {} readings at rest are {}, although those under load scatter: what lies below is "
      "not shown (an amplifier without negative values, or a display that suppresses small ones), "
      "and neither the zero nor the depth of contact is known; record the rest with its noise, or "
      "state both: --zero, --contact",
      prepared.name, resting, with_unit(significant(level / unit.to_si, 4), unit));
}

/// "no reading at rest is below 0, ..."; empty if the rest is as far from 0 as its noise has it.
std::string folded_words(const PreparedRecording& prepared) {
  constexpr std::size_t kFewest = 50;
  constexpr double kChance = 1e-6;
  constexpr double kFine = 0.3;  // of the noise: rounding that leaves its distribution as it is
  const std::span<const double> all = prepared.recording.response;
  const std::span<const double> rest =
      all.first(std::min(samples_at_rest(prepared.phases), all.size()));
  if (prepared.load_imposed || rest.size() < kFewest) return {};
  if (std::ranges::any_of(rest, [](double reading) { return reading < 0.0; })) return {};
  const auto n = static_cast<double>(rest.size());
  double mean = 0.0, square = 0.0, product = 0.0;
  for (const double reading : rest) mean += reading / n;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    square += (rest[i] - mean) * (rest[i] - mean);
    if (i > 0) product += (rest[i] - mean) * (rest[i - 1] - mean);
  }
  const double sd = std::sqrt(square / (n - 1.0));
  if (!(sd > 0.0) || quantum_of(rest) > kFine * sd) return {};
  const double correlation = std::max(product / square, 0.0);
  const double independent = n * (1.0 - correlation) / (1.0 + correlation);
  if (independent * std::log(normal_cdf(mean / sd)) > std::log(kChance)) return {};
  const Unit unit = shown_unit(quantity_dimension(prepared.recording.response_quantity));
  return fmt::format(
      "{}: no reading at rest is below 0, although they scatter by {} about {}: negative values "
      "are not shown, or lost their sign; zero and contact are off by up to as much",
      prepared.name, with_unit(significant(sd / unit.to_si, 3), unit),
      with_unit(significant(mean / unit.to_si, 3), unit));
}

/// @param folded the zero is off by less than its noise: coefficients hardly notice
bool depends_on_zero(const FitResult& fit, std::size_t i, bool folded) {
  const ParameterResult& p = fit.parameters[i];
  if (p.nuisance) return is_contact(fit.config, i) || p.parameter.name.starts_with("offset");
  const Dimension dimension = p.parameter.unit.dimension;
  return !folded && (dimension == Dimension::stiffness || p.parameter.name == "exponent" ||
                     p.parameter.name == "tension_share");
}

/// What is needed of the recordings of a configuration.
std::vector<PreparedRecording> found_phases(const FitResult& fit,
                                            const std::vector<DataSet>& data) {
  std::vector<PreparedRecording> recordings(data.size());
  for (const RecordingFit& r : fit.recordings) {
    const auto* recording = std::get_if<Recording>(&data[r.choice]);
    const DataChoice& choice = fit.config.data[r.choice];
    if (recording == nullptr || is_step_response(recording->response_quantity)) continue;
    PreparedRecording& one = recordings[r.choice];
    one.name = choice.dataset;
    one.load_imposed = choice.load_imposed;
    if (choice.load_imposed) continue;
    PhaseOptions options;
    options.contact_response = choice.contact_response;
    one.recording = *recording;
    one.phases = find_phases(*recording, options);
  }
  return recordings;
}

void doubt_zero(FitResult& fit, std::span<const PreparedRecording> recordings) {
  bool cut = false, folded = false;
  for (const RecordingFit& r : fit.recordings) {
    if (r.choice >= recordings.size()) continue;
    if (r.drive_quantity != Quantity::indentation_depth) continue;
    std::string words = cut_words(r, recordings[r.choice]);
    cut = cut || !words.empty();
    if (words.empty()) {
      words = folded_words(recordings[r.choice]);
      if (words.empty()) continue;
      folded = true;
    }
    fit.remarks.push_back({"rest_cut_off", std::move(words)});
  }
  if (!cut && !folded) return;
  const Remark doubt{kZeroOrContact, "the zero of the force or the depth of contact"};
  for (std::size_t i = 0; i < fit.parameters.size() && i < fit.config.parameters.size(); ++i) {
    ParameterResult& p = fit.parameters[i];
    if (p.verdict != Verdict::identified || p.not_separable || !depends_on_zero(fit, i, !cut))
      continue;
    p.not_separable = doubt;
    p.summary = parameter_words(p, fit.config.level);
  }
}

}  // namespace

void doubt_placement(FitResult& fit, std::span<const PreparedRecording> recordings) {
  doubt_contact(fit);
  doubt_zero(fit, recordings);
}

void doubt_placement(FitResult& fit, const std::vector<DataSet>& data) {
  doubt_placement(fit, found_phases(fit, data));
}

}  // namespace tpm::fit
