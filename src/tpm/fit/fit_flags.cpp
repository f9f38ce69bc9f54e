#include "tpm/fit/fit_flags.hpp"
#include "tpm/fit/likelihood/quantum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/data/straight_pieces.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::fit {
namespace {

/// Fitted values further from the model than noise goes, in standard deviations.
constexpr double kOutlying = 8.0;

void flag_outliers(FitResult& result, const ExperimentResiduals& function) {
  const double unit = std::sqrt(result.variance_factor);
  const Eigen::VectorXd answer = function.predict(result.best.natural, nullptr);
  int count = 0;
  std::string worst;
  double worst_z = kOutlying * unit;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const FitDatum& d = function.data()[i];
    if (!d.value || d.held_out) continue;
    const double z = std::abs(
        function.standardised(i, answer[static_cast<Eigen::Index>(i)], result.best.natural));
    if (!(z > kOutlying * unit) || !(unit > 0.0)) continue;
    ++count;
    if (z < worst_z) continue;
    worst_z = z;
    worst = fmt::format("{} of '{}'", datum_label(d), result.config.data[d.choice].dataset);
  }
  if (count == 0) return;
  result.remarks.push_back(
      {"outliers",
       fmt::format(
           "{} of {} values {} more than {} standard deviations from the model, the furthest "
           "{} ({} standard deviations): errors in the data, or noise with wider tails "
           "(distribution 'student_t')",
           count, result.value_count, count == 1 ? "lies" : "lie", kOutlying, worst,
           significant(worst_z / unit, 3))});
}

/// True if the noise is the least that is believed.
bool is_met_exactly(const FitResult& result) {
  return !result.config.scale_known() && result.degrees_of_freedom > 0 &&
         result.least_variance > 0.0 && result.variance_factor <= result.least_variance;
}

void flag_noise(FitResult& result) {
  const bool estimated = std::ranges::any_of(result.config.data, &DataChoice::estimates_sigma);
  if (estimated) {
    result.remarks.push_back(
        {"noise_estimated",
         fmt::format("the size of the noise is estimated from {} values: intervals are those of "
                     "many values, and too short for few",
                     result.value_count)});
  }
  if (is_met_exactly(result)) {
    result.remarks.push_back(
        {"noise_at_computed_share",
         fmt::format(
             "the readings are met more nearly than is computed: intervals suppose noise of "
             "{:g} of each reading, which says how near the numbers are, not how near a "
             "measurement is",
             kComputedShare)});
  }
  if (result.noise) {
    result.remarks.push_back({result.noise->limited      ? "limited_by_resolution"
                              : result.noise->correlated ? "correlated_noise"
                                                         : "drive_noise",
                              result.noise->summary});
  } else if (result.inflation > 1.0) {
    result.remarks.push_back(
        {"correlated_residuals",
         fmt::format("{}; the intervals count them so", result.correlation.value().summary)});
  }
}

/// Bands alone: where all are met there is no best point.
void flag_plateau(FitResult& result) {
  if (result.value_count > 0 || result.best.deviance > 0.0) return;
  result.remarks.push_back(
      {"estimates_not_unique",
       "every reading lies within its band: a whole region of parameters fits alike, and the "
       "estimates are one point of it; the intervals say how far it reaches"});
}

void flag_not_predicted(FitResult& result) {
  for (const RecordingFit& r : result.recordings) {
    if (r.not_predicted == 0) continue;
    result.remarks.push_back(
        {"not_predicted",
         fmt::format(
             "{} samples of '{}' are not predicted: the contact shrinks or grows again in a "
             "way that the law does not cover",
             r.not_predicted, result.config.data[r.choice].dataset)});
  }
}

/// Readings at a limit of the force cell.
int flag_clipping(FitResult& result) {
  int all = 0;
  for (const RecordingFit& r : result.recordings) {
    const auto count = static_cast<int>(std::ranges::count(r.censored, true));
    if (count == 0) continue;
    all += count;
    result.remarks.push_back(
        {"clipping", fmt::format("clipping: {} samples of '{}' at a limit of the force cell are "
                                 "censored: of each it counts "
                                 "only that it lay there or beyond",
                                 count, result.config.data[r.choice].dataset)});
  }
  return all;
}

/// Flags how closely an organ follows a measured motion.
void flag_motions(FitResult& result, const ExperimentResiduals& function) {
  for (const Experiment& e : function.experiments()) {
    const auto* course = std::get_if<TimeCourse>(&e.imposed);
    if (course == nullptr || !course->followed) continue;
    result.remarks.push_back(
        {"motion_followed",
         fmt::format("the organ follows the {} samples of the motion of '{}' within {:g} % of its "
                     "depth, in {} straight pieces",
                     course->times_s.size(), result.config.data[e.choice].dataset,
                     100.0 * kMotionWithin, course->followed->knots().size() - 1)});
  }
}

}  // namespace

std::vector<std::string> prior_words(const FitResult& result, bool flagged) {
  constexpr double kFar = 3.0;  // 0.3 % of healthy fits
  std::vector<std::string> words;
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    const std::optional<Prior>& prior = result.config.parameters[i].prior;
    if (!prior) continue;
    const ParameterResult& p = result.parameters[i];
    const double away = std::abs(p.estimate - prior->mean) / prior->sd;
    if ((!prior->measured || away > kFar) != flagged) continue;
    words.push_back(fmt::format(
        "{} = {} beside {} +- {}{}: {} of this uncertainty away", p.parameter.name,
        in_sized_unit(p, p.estimate), in_sized_unit(p, prior->mean), in_sized_unit(p, prior->sd),
        prior->from.empty() ? "" : " (" + prior->from + ")", significant(away, 2)));
  }
  return words;
}

void add_flags(FitResult& result, const ExperimentResiduals& function) {
  flag_outliers(result, function);
  flag_noise(result);
  for (std::string& words : prior_words(result, true)) {
    result.remarks.push_back({"moved_from_prior", std::move(words)});
  }
  flag_not_predicted(result);
  flag_motions(result, function);
  for (const DataChoice& data : result.config.data) {
    if (data.protocol.rate_provenance == Provenance::assumed) {
      result.remarks.push_back(
          {"ramp_rate_assumed", fmt::format("the ramp rate of {:.4g} mm/s is assumed for '{}'",
                                            data.protocol.rate_m_per_s * 1e3, data.dataset)});
    }
  }
  if (const ExperimentResiduals* surrogate = function.surrogate()) {
    result.remarks.push_back(
        {"started_from_surrogate",
         fmt::format("the search began at the configured start and at the best minima ({}) that {} "
                     "starts of "
                     "the model '{}' have",
                     result.starts_run - 1, result.config.starts, surrogate->model().name())});
  }
  result.band_count -= flag_clipping(result);
  if (result.band_count > 0) {
    result.remarks.push_back(
        {"bands_not_counted",
         fmt::format("{} bands are penalised only outside and are not counted as data",
                     result.band_count)});
  }
  flag_plateau(result);
  if (result.config.loss.kind != Loss::none) {
    result.remarks.push_back(
        {"loss_without_likelihood",
         fmt::format(
             "the {} loss has no exact likelihood: the intervals' level is only approximate",
             loss_name(result.config.loss.kind))});
  }
  double deepest = 0.0;
  for (const Experiment& e : function.experiments()) {
    const auto* course = std::get_if<TimeCourse>(&e.imposed);
    if (course == nullptr || course->protocol.drive() == Drive::force) continue;
    deepest = std::max(deepest, course->protocol.peak());
  }
  for (const FittedDatum& d : result.data) {
    if (d.datum.quantity == Quantity::indentation_depth) {
      deepest = std::max(deepest, d.predicted);
    }
  }
  if (!has_element(result.config)) return;  // the limits are those of the paper's element
  const TpmVector element = fitted_element(result.config, result.best.natural);
  std::ranges::move(validity_remarks(element[kSpacing], deepest),
                    std::back_inserter(result.remarks));
}

}  // namespace tpm::fit
