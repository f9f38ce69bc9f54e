#include "tpm/fit/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

#include "tpm/core/error.hpp"
#include "tpm/core/progress.hpp"
#include "tpm/core/text.hpp"
#include "tpm/fit/experiment_refit.hpp"
#include "tpm/fit/prediction.hpp"
#include "tpm/fit/starts.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/material/tpm_element.hpp"

namespace tpm {
namespace {

constexpr Eigen::Index kMostSearched = 20'000;  // residuals that many starts are followed with
constexpr std::size_t kThinnedTo = 2'000;       // samples that stand for a longer recording
constexpr Eigen::Index kMostProfiled = 20'000;  // residuals that profiles are walked with

constexpr double kSameDeviance = 1e-5;   // relative: one minimum
constexpr double kSameParameter = 1e-5;  // relative: five digits

bool same_deviance(double a, double b) {
  return std::abs(a - b) <= kSameDeviance * std::max(1.0, std::abs(b));
}

/// All starts, each followed to its end, sorted into distinct minima.
struct MultiStart {
  std::vector<DistinctMinimum> minima;
  int run = 0, failed = 0, agreeing = 0;
  std::vector<double> end_deviances;  ///< of every start; NaN where it failed
};

void add_to_cluster(std::vector<DistinctMinimum>& minima, const Minimum& m) {
  for (DistinctMinimum& cluster : minima) {
    if (!same_deviance(m.deviance, cluster.minimum.deviance)) continue;
    ++cluster.starts;
    for (std::size_t i = 0; i < m.natural.size(); ++i) {
      cluster.low[i] = std::min(cluster.low[i], m.natural[i]);
      cluster.high[i] = std::max(cluster.high[i], m.natural[i]);
    }
    return;
  }
  minima.push_back({m, 1, m.natural, m.natural});
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
                      const std::vector<std::vector<double>>& starts, StartKind kind) {
  MultiStart result;
  std::vector<Minimum> ends;
  Progress progress("fitting from several starts", starts.size());
  for (const auto& start : starts) {
    const Minimum m = kind == StartKind::solved ? minimise_near(function, parameters, start)
                                                : minimise_both_ways(function, parameters, start);
    ++result.run;
    result.end_deviances.push_back(m.usable ? m.deviance
                                            : std::numeric_limits<double>::quiet_NaN());
    if (m.usable) {
      ends.push_back(m);
    } else {
      ++result.failed;
    }
    progress.advance();
  }
  if (ends.empty()) {
    throw Error(
        ExitCode::numerical, "fit",
        fmt::format("none of {} starts ended in a point that can be evaluated", starts.size()));
  }
  std::stable_sort(ends.begin(), ends.end(),
                   [](const Minimum& a, const Minimum& b) { return a.deviance < b.deviance; });
  for (const Minimum& m : ends) add_to_cluster(result.minima, m);
  const Minimum& best = ends.front();
  for (const Minimum& m : ends) {
    bool agrees = same_deviance(m.deviance, best.deviance);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      agrees = agrees && std::abs(m.natural[i] - best.natural[i]) <=
                             kSameParameter * std::abs(best.natural[i]);
    }
    if (agrees) ++result.agreeing;
  }
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

/// Profiles of every parameter; on meeting a deeper minimum descends into it and starts again.
void profile_all(const ResidualFunction& function, FitResult& result,
                 std::span<const FitParameter> parameters, const Threshold& threshold) {
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
        result.covariance = linear_covariance(function, parameters, result.best, threshold);
        deeper = true;
        continue;
      }
      result.parameters[i].lower = profile.lower;
      result.parameters[i].upper = profile.upper;
      result.parameters[i].profile = std::move(profile);
      progress.advance();
    }
    if (!deeper) return;
  }
  throw Error(ExitCode::numerical, "profiles", "a deeper minimum was met again and again");
}

/// Limits from the covariance alone.
void linear_intervals(FitResult& result, std::span<const FitParameter> parameters,
                      const Threshold& threshold) {
  const double wide =
      std::sqrt(threshold.rise(result.best.deviance) /
                (threshold.inflation * threshold.variance_factor(result.best.deviance)));
  const Covariance& c = result.covariance;
  for (std::size_t k = 0; c.full_rank && k < c.free.size(); ++k) {
    const std::size_t i = c.free[k];
    const FitParameter& p = parameters[i];
    const double theta = p.theta(result.best.natural[i]);
    const double half = wide * c.theta_sd[static_cast<Eigen::Index>(k)];
    const double a = p.natural(std::max(theta - half, p.theta_lower()));
    const double b = p.natural(std::min(theta + half, p.theta_upper()));
    if (theta - half > p.theta_lower())
      (p.reversed() ? result.parameters[i].upper : result.parameters[i].lower) = a;
    if (theta + half < p.theta_upper())
      (p.reversed() ? result.parameters[i].lower : result.parameters[i].upper) = b;
  }
}

void describe_parameters(FitResult& result, double level, bool profiles) {
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    ParameterResult& p = result.parameters[i];
    p.estimate = result.best.natural[i];
    p.at_lower_bound = p.parameter.at_lower(p.estimate);
    p.at_upper_bound = p.parameter.at_upper(p.estimate);
    p.standard_error = natural_standard_error(result, i);
    p.verdict = profiles ? verdict_of(p) : Verdict::not_profiled;
    p.words = parameter_words(p, level);
  }
}

}  // namespace

FitResult fit_residuals(const ResidualFunction& function, std::vector<FitParameter> parameters,
                        const std::vector<std::vector<double>>& starts, Threshold threshold,
                        bool profiles, StartKind kind, const InflationRule& inflation) {
  threshold.parameter_count = static_cast<int>(parameters.size());
  FitResult result;
  MultiStart multi = run_starts(function, parameters, starts, kind);
  result.starts_run = multi.run;
  result.starts_failed = multi.failed;
  result.starts_agreeing = multi.agreeing;
  result.waterfall = waterfall(multi.end_deviances);
  result.minima = std::move(multi.minima);
  result.best = result.minima.front().minimum;
  if (inflation) threshold.inflation = inflation(result.best.natural);
  result.inflation = threshold.inflation;
  result.covariance = linear_covariance(function, parameters, result.best, threshold);
  for (const FitParameter& p : parameters) {
    ParameterResult r;
    r.parameter = p;
    result.parameters.push_back(std::move(r));
  }
  if (profiles && function.residual_count() <= kMostProfiled) {
    profile_all(function, result, parameters, threshold);
  } else if (profiles) {
    // With so many readings the likelihood is a parabola as far as the interval reaches.
    linear_intervals(result, parameters, threshold);
    result.flags.push_back(
        fmt::format("{} readings: the intervals come from the covariance, not from profiles",
                    function.residual_count()));
  }
  result.degrees_of_freedom = threshold.data_count - threshold.parameter_count;
  result.variance_factor = threshold.scale_known || result.degrees_of_freedom > 0
                               ? threshold.variance_factor(result.best.deviance)
                               : 1.0;
  describe_parameters(result, threshold.level, profiles);
  result.weakest_words = weakest_direction_words(result);
  return result;
}

namespace {

HypothesisResult test_hypothesis(const ExperimentResiduals& function, const FitResult& fit,
                                 std::span<const FitParameter> parameters,
                                 const Hypothesis& hypothesis, const Threshold& threshold) {
  HypothesisResult result;
  result.hypothesis = hypothesis;
  FixedMask fixed(parameters.size(), false);
  std::vector<std::vector<double>> starts{fit.best.natural};
  for (auto& start : latin_hypercube_starts(parameters, 10, fit.config.seed)) {
    starts.push_back(std::move(start));
  }
  for (const auto& [name, value] : hypothesis.values) {
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (parameters[i].name != name) continue;
      fixed[i] = true;
      for (auto& start : starts) start[i] = value;
    }
  }
  for (const auto& start : starts) {
    const Minimum m = minimise(function, parameters, start, fixed);
    const bool deeper = !result.minimum.usable || m.deviance < result.minimum.deviance;
    if (m.usable && deeper) result.minimum = m;
  }
  if (!result.minimum.usable) {
    throw Error(ExitCode::numerical, fmt::format("hypothesis '{}'", hypothesis.name),
                "the model cannot be evaluated there");
  }
  const int constrained = static_cast<int>(hypothesis.values.size());
  result.rise = std::max(result.minimum.deviance - fit.best.deviance, 0.0);
  result.p_value = threshold.p_value(result.rise, fit.best.deviance, constrained);
  result.excluded = result.p_value < 1.0 - threshold.level;
  result.words = hypothesis_words(result, threshold.level);
  return result;
}

/// Standard deviation of a new reading about the model's answer, on the scale of the data.
double reading_sd(const ExperimentResiduals& function, std::size_t datum, double answer,
                  std::span<const double> natural) {
  const FitDatum& d = function.data()[datum];
  const ErrorLaw law = error_law(function.config().data[d.choice].noise);
  const double sd = standard_deviation(law, function.new_noise_scale(datum, answer, natural));
  return sd / transformed_slope(law.scale, answer);
}

/// Bands about the answers to all data; empty if the data do not determine them.
std::optional<PredictionBands> bands_of(const FitResult& result,
                                        const ExperimentResiduals& function,
                                        std::span<const FitParameter> parameters,
                                        const Threshold& threshold,
                                        const Eigen::VectorXd& predicted,
                                        const RowMatrix& sensitivity) {
  const bool estimable = threshold.scale_known || threshold.data_count > threshold.parameter_count;
  if (!result.covariance.full_rank || !estimable) return std::nullopt;
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
      if (function.data()[i].held_out) continue;
      list.push_back(function.standardised(i, answer[static_cast<Eigen::Index>(i)], natural));
    }
  }
  return residuals;
}

/// Over all recordings; readings of tables are independent and not in it.
std::optional<Correlation> correlation_at(const ExperimentResiduals& function,
                                          std::span<const double> natural) {
  const bool any = std::any_of(function.experiments().begin(), function.experiments().end(),
                               [](const Experiment& e) { return e.is_recording; });
  if (!any) return std::nullopt;
  const auto residuals = recording_residuals(function, natural);
  const std::vector<std::span<const double>> parts(residuals.begin(), residuals.end());
  return residual_correlation(parts);
}

/// Fitted values over the independent readings among them: those of the recordings and every
/// reading of a table.
double inflation_at(const ExperimentResiduals& function, std::span<const double> natural) {
  if (!function.config().adjust_correlation) return 1.0;
  const std::optional<Correlation> c = correlation_at(function, natural);
  if (!c || !c->significant) return 1.0;
  const double n = function.value_count();
  return n / (n - static_cast<double>(c->count) + c->effective_count);
}

RecordingFit recording_fit(const ExperimentResiduals& function, const Experiment& experiment,
                           const Eigen::VectorXd& predicted) {
  RecordingFit fit;
  fit.choice = experiment.choice;
  const LawSpec spec = function.config().law.value_or(LawSpec{});
  fit.drive_quantity = spec.drive;
  fit.response_quantity = spec.response;
  const auto& course = std::get<TimeCourse>(experiment.imposed);
  fit.time_s = course.times_s;
  double inside = 0.0;
  double outside = 0.0;
  std::size_t fitted = 0;
  const auto knots = course.protocol.knots();
  for (std::size_t k = 0; k < experiment.data.size(); ++k) {
    const FitDatum& d = function.data()[experiment.data[k]];
    const double answer = predicted[static_cast<Eigen::Index>(experiment.data[k])];
    fit.provenance = d.provenance;
    fit.drive.push_back(knots[k].value);
    fit.observed.push_back(*d.value);
    fit.predicted.push_back(answer);
    fit.fitted.push_back(!d.held_out);
    const double off = answer - *d.value;
    (d.held_out ? outside : inside) += off * off;
    if (d.held_out) continue;
    ++fitted;
    fit.peak = std::max(fit.peak, std::abs(*d.value));
  }
  fit.rms_residual = std::sqrt(inside / static_cast<double>(std::max<std::size_t>(fitted, 1)));
  const std::size_t rest = fit.time_s.size() - fitted;
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

/// What is said of one recording beside its curve.
void describe_recording(RecordingFit& fit, const Experiment& experiment,
                        const std::optional<PredictionBands>& bands) {
  if (bands) add_band(fit, experiment, *bands);
  std::vector<double> residuals;
  for (std::size_t k = 0; k < fit.standardised.size(); ++k) {
    if (fit.fitted[k]) residuals.push_back(fit.standardised[k]);
  }
  if (!residuals.empty()) fit.correlation = residual_correlation(residuals);
}

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
      FittedDatum d{std::move(datum), predicted[row], std::nullopt, z, {}, {}};
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
      threshold.scale_known &&
      std::all_of(result.config.data.begin(), result.config.data.end(), [](const DataChoice& d) {
        return d.noise.shape == ErrorShape::normal && !d.estimates_sigma();
      });
  if (known_normal && result.degrees_of_freedom > 0 && result.config.loss.kind == Loss::none) {
    result.chi_square_p = boost::math::cdf(boost::math::complement(
        boost::math::chi_squared(result.degrees_of_freedom), result.chi_square));
  }
}

/// Fitted values further from the model than noise goes, in standard deviations.
constexpr double kFarOff = 8.0;

void flag_outliers(FitResult& result, const ExperimentResiduals& function) {
  const double unit = std::sqrt(result.variance_factor);
  const Eigen::VectorXd answer = function.predict(result.best.natural, nullptr);
  int count = 0;
  std::string worst;
  double worst_z = kFarOff * unit;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const FitDatum& d = function.data()[i];
    if (!d.value || d.held_out) continue;
    const double z = std::abs(
        function.standardised(i, answer[static_cast<Eigen::Index>(i)], result.best.natural));
    if (!(z > kFarOff * unit) || !(unit > 0.0)) continue;
    ++count;
    if (z < worst_z) continue;
    worst_z = z;
    worst = fmt::format("{} of '{}'", datum_label(d), result.config.data[d.choice].dataset);
  }
  if (count == 0) return;
  result.flags.push_back(fmt::format(
      "{} of {} values {} more than {} standard deviations from the model, the furthest "
      "{} ({} standard deviations): errors in the data, or noise with wider tails "
      "(distribution 'student_t')",
      count, result.value_count, count == 1 ? "lies" : "lie", kFarOff, worst,
      significant(worst_z / unit, 3)));
}

void flag_noise(FitResult& result) {
  const bool estimated = std::any_of(result.config.data.begin(), result.config.data.end(),
                                     [](const DataChoice& d) { return d.estimates_sigma(); });
  if (estimated) {
    result.flags.push_back(
        fmt::format("the size of the noise is estimated from {} values: intervals are those of "
                    "many values, and too short for few",
                    result.value_count));
  }
  if (result.inflation > 1.0) {
    result.flags.push_back(
        fmt::format("{}; the intervals count them so", result.correlation.value().words));
  }
}

void add_flags(FitResult& result, const ExperimentResiduals& function) {
  flag_outliers(result, function);
  flag_noise(result);
  for (const DataChoice& data : result.config.data) {
    if (data.protocol.rate_provenance == Provenance::assumed) {
      result.flags.push_back(fmt::format("the ramp rate of {:.4g} mm/s is assumed for '{}'",
                                         data.protocol.rate_m_per_s * 1e3, data.dataset));
    }
  }
  if (result.band_count > 0) {
    result.flags.push_back(fmt::format(
        "{} bands are penalised only outside and are not counted as data", result.band_count));
  }
  if (result.config.loss.kind != Loss::none) {
    result.flags.push_back(
        fmt::format("the {} loss has no exact likelihood: the intervals' level is only approximate",
                    loss_name(result.config.loss.kind)));
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
  if (result.config.law) return;  // the limits are those of the paper's element
  TpmVector vector{};
  const auto values = model_parameters(result.config, result.best.natural, 0);
  std::copy(values.begin(), values.end(), vector.begin());
  for (std::string& flag : validity_flags(from_vector(vector), deepest)) {
    result.flags.push_back(std::move(flag));
  }
}

}  // namespace

FitResult run_fit(const FitConfig& config) {
  return fit_experiments(ExperimentResiduals(config));
}

FitResult run_fit(const FitConfig& config, const std::vector<DataSet>& data) {
  return fit_experiments(ExperimentResiduals(config, data));
}

namespace {

/// Where the search begins and how it goes on from there.
struct Approach {
  std::vector<std::vector<double>> starts;
  StartKind kind;
};

/// Long recordings are approached through a few of their samples; the minimum is then found with
/// all of them.
Approach approach_to(const ExperimentResiduals& function,
                     std::span<const FitParameter> parameters) {
  if (function.residual_count() <= kMostSearched) {
    return {fit_starts(function, parameters), start_kind(function)};
  }
  const auto few = function.thinned(kThinnedTo);
  Threshold threshold;
  threshold.scale_known = function.config().data.front().noise.scale_known;
  threshold.data_count = static_cast<int>(few->residual_count());
  const FitResult found =
      fit_residuals(*few, std::vector<FitParameter>(parameters.begin(), parameters.end()),
                    fit_starts(*few, parameters), threshold, false, start_kind(*few));
  return {{found.best.natural}, StartKind::solved};
}

}  // namespace

FitResult fit_experiments(const ExperimentResiduals& function) {
  const FitConfig& config = function.config();
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  Threshold threshold;
  threshold.level = config.level;
  threshold.scale_known = config.data.front().noise.scale_known;
  threshold.data_count = function.value_count();
  threshold.parameter_count = static_cast<int>(parameters.size());

  const Approach approach = approach_to(function, parameters);
  FitResult result = fit_residuals(
      function, parameters, approach.starts, threshold, config.profiles, approach.kind,
      [&](std::span<const double> best) { return inflation_at(function, best); });
  threshold.inflation = result.inflation;
  result.config = config;
  result.value_count = function.value_count();
  result.band_count = function.band_count();
  result.likelihood = likelihood_at(function, result.best.natural);
  result.correlation = correlation_at(function, result.best.natural);
  fill_data(result, function, parameters, threshold);
  for (const Hypothesis& hypothesis : config.hypotheses) {
    result.hypotheses.push_back(
        test_hypothesis(function, result, parameters, hypothesis, threshold));
  }
  if (config.bootstrap) {
    result.bootstrap = bootstrap_experiments(function, parameters, result.best, *config.bootstrap);
  }
  add_flags(result, function);
  return result;
}

}  // namespace tpm
