#include "tpm/fit/fitted_data.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/distributions.hpp"
#include "tpm/fit/prediction.hpp"

namespace tpm::fit {
namespace {

/// Standard deviation of a new reading about the model's answer, on the scale of the data.
double reading_sd(const ExperimentResiduals& function, std::size_t datum, double answer,
                  std::span<const double> natural) {
  const FitDatum& d = function.data()[datum];
  const ErrorLaw law = error_law(function.config().data[d.choice].noise);
  const double sd = standard_deviation(law, function.new_noise_scale(datum, answer, natural));
  return sd / transformed_slope(law.scale, answer);
}

/// Standard deviation of a reading, from the scale of the noise to the reading's own.
double sd_of_reading(const Noise& noise, const FitDatum& d) {
  const ErrorLaw law = error_law(noise);
  return standard_deviation(law, d.sigma) / transformed_slope(law.scale, *d.value);
}

/// Bands about the answers to all data; empty if the data do not determine them.
std::optional<PredictionBands> bands_of(const FitResult& result,
                                        const ExperimentResiduals& function,
                                        std::span<const FitParameter> parameters,
                                        const Threshold& threshold,
                                        const Eigen::VectorXd& predicted,
                                        const RowMatrix& sensitivity) {
  if (!result.covariance.full_rank || !threshold.estimable()) return std::nullopt;
  Eigen::VectorXd sd(predicted.size());
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    sd[i] = reading_sd(function, static_cast<std::size_t>(i), predicted[i], result.best.natural);
  }
  return prediction_bands(predicted, sensitivity, parameters, result.best, result.covariance,
                          threshold, sd);
}

/// Residuals of the fitted samples of each recording, in the order of measurement.
std::vector<std::vector<double>> recording_residuals(const ExperimentResiduals& function,
                                                     std::span<const double> natural) {
  const Eigen::VectorXd answer = function.predict(natural, nullptr);
  std::vector<std::vector<double>> residuals;
  for (const Experiment& experiment : function.experiments()) {
    if (!experiment.is_recording) continue;
    std::vector<double>& list = residuals.emplace_back();
    for (const std::size_t i : experiment.data) {
      const FitDatum& d = function.data()[i];
      if (d.held_out || !d.value) continue;  // held out, or censored
      list.push_back(function.standardised(i, answer[static_cast<Eigen::Index>(i)], natural));
    }
  }
  return residuals;
}

}  // namespace

std::optional<Correlation> correlation_at(const ExperimentResiduals& function,
                                          std::span<const double> natural) {
  const bool any = std::ranges::any_of(function.experiments(), &Experiment::is_recording);
  if (!any) return std::nullopt;
  const auto residuals = recording_residuals(function, natural);
  const std::vector<std::span<const double>> parts(residuals.begin(), residuals.end());
  return residual_correlation(parts);
}

double inflation_at(const ExperimentResiduals& function, std::span<const double> natural) {
  if (!function.config().adjust_correlation) return 1.0;
  const std::optional<Correlation> c = correlation_at(function, natural);
  if (!c || !c->significant) return 1.0;
  const double n = function.value_count();
  return n / (n - static_cast<double>(c->count) + c->effective_count);
}

namespace {

RecordingFit recording_fit(const ExperimentResiduals& function, const Experiment& experiment,
                           const Eigen::VectorXd& predicted) {
  RecordingFit fit;
  fit.choice = experiment.choice;
  const LawSpec spec = function.config().law.value_or(LawSpec{});
  const auto& course = std::get<TimeCourse>(experiment.imposed);
  const bool load = course.protocol.drive() == Drive::force;
  fit.drive_quantity = load ? spec.response : spec.drive;
  fit.response_quantity = load ? spec.drive : spec.response;
  fit.time_s = course.times_s;
  double inside = 0.0;
  double outside = 0.0;
  std::size_t fitted = 0;
  std::size_t at_limit = 0;
  const auto knots = course.protocol.knots();
  for (std::size_t k = 0; k < experiment.data.size(); ++k) {
    const FitDatum& d = function.data()[experiment.data[k]];
    const double answer = predicted[static_cast<Eigen::Index>(experiment.data[k])];
    fit.provenance = d.provenance;
    fit.drive.push_back(knots[k].value);
    const bool censored = !d.value;
    fit.observed.push_back(censored ? d.at_limit.value_or(0.0) : *d.value);
    fit.predicted.push_back(answer);
    fit.fitted.push_back(!d.held_out && !censored);
    fit.censored.push_back(censored);
    fit.outlier.push_back(d.outlier);
    if (censored) {
      ++at_limit;
      fit.peak = std::max(fit.peak, std::abs(fit.observed.back()));
      continue;
    }
    if (d.outlier) continue;
    if (d.held_out && !std::isfinite(answer)) {
      ++fit.not_predicted;
      continue;
    }
    const double off = answer - *d.value;
    (d.held_out ? outside : inside) += off * off;
    if (d.held_out) continue;
    ++fitted;
    fit.peak = std::max(fit.peak, std::abs(*d.value));
  }
  fit.rms_residual = std::sqrt(inside / static_cast<double>(std::max<std::size_t>(fitted, 1)));
  const auto outliers = static_cast<std::size_t>(std::ranges::count(fit.outlier, true));
  const std::size_t rest = fit.time_s.size() - fitted - at_limit - fit.not_predicted - outliers;
  if (rest > 0) fit.rms_outside = std::sqrt(outside / static_cast<double>(rest));
  return fit;
}

/// The band of the samples of a recording and how many of the fitted ones lie in it.
void add_band(RecordingFit& fit, const Experiment& experiment, const PredictionBands& bands) {
  int fitted = 0;
  int inside = 0;
  for (std::size_t k = 0; k < experiment.data.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(experiment.data[k]);
    fit.lower.push_back(bands.reading_lower[row]);
    fit.upper.push_back(bands.reading_upper[row]);
    if (!fit.fitted[k]) continue;
    ++fitted;
    if (fit.observed[k] >= fit.lower.back() && fit.observed[k] <= fit.upper.back()) ++inside;
  }
  if (fitted > 0) fit.share_inside = static_cast<double>(inside) / fitted;
}

/// Describes one recording beside its curve.
void describe_recording(RecordingFit& fit, const Experiment& experiment,
                        const std::optional<PredictionBands>& bands) {
  if (bands) add_band(fit, experiment, *bands);
  std::vector<double> residuals;
  for (std::size_t k = 0; k < fit.standardised.size(); ++k) {
    if (fit.fitted[k]) residuals.push_back(fit.standardised[k]);
  }
  if (!residuals.empty()) fit.correlation = residual_correlation(residuals);
}

}  // namespace

void fill_data(FitResult& result, const ExperimentResiduals& function,
               std::span<const FitParameter> parameters, const Threshold& threshold) {
  RowMatrix sensitivity;
  const Eigen::VectorXd predicted = function.predict(result.best.natural, &sensitivity);
  const auto bands = bands_of(result, function, parameters, threshold, predicted, sensitivity);
  const Eigen::VectorXd sd =
      prediction_standard_errors(sensitivity, parameters, result.best.natural, result.covariance);
  for (const Experiment& experiment : function.experiments()) {
    if (experiment.is_recording) {
      result.recordings.push_back(recording_fit(function, experiment, predicted));
      result.recordings.back().standardised.reserve(experiment.data.size());
    }
    for (const std::size_t i : experiment.data) {
      const auto row = static_cast<Eigen::Index>(i);
      FitDatum datum = function.data()[i];
      const double z = function.standardised(i, predicted[row], result.best.natural);
      if (!datum.held_out) result.chi_square += z * z;
      if (experiment.is_recording) {
        result.recordings.back().standardised.push_back(z);
        continue;
      }
      if (result.config.data[datum.choice].estimates_sigma()) {
        datum.sigma = function.noise_scale(i, predicted[row], result.best.natural);
      }
      FittedDatum d{std::move(datum), predicted[row], std::nullopt, 0.0, z, {}, {}};
      const auto* course = std::get_if<TimeCourse>(&experiment.imposed);
      if (course != nullptr && course->protocol.drive() == Drive::displacement) {
        d.imposed_depth_m = course->protocol.peak();
      }
      if (d.datum.value) {
        d.reading_sd = sd_of_reading(result.config.data[d.datum.choice].noise, d.datum) *
                       std::sqrt(result.variance_factor);
      }
      if (sd.size() > 0) d.predicted_sd = sd[row];
      if (bands) {
        d.confidence = {bands->lower[row], bands->upper[row]};
        d.prediction = {bands->reading_lower[row], bands->reading_upper[row]};
      }
      result.data.push_back(std::move(d));
    }
    if (experiment.is_recording) describe_recording(result.recordings.back(), experiment, bands);
  }
  const bool known_normal =
      threshold.scale_known && std::ranges::all_of(result.config.data, [](const DataChoice& d) {
        return d.noise.shape == ErrorShape::normal && !d.estimates_sigma();
      });
  if (known_normal && result.degrees_of_freedom > 0 && result.config.loss.kind == Loss::none) {
    result.chi_square_p = chi_squared_tail(result.chi_square, result.degrees_of_freedom);
  }
}

}  // namespace tpm::fit
