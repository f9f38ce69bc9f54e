#include "tpm/fit/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/progress.hpp"
#include "tpm/core/text.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm {
namespace {

constexpr double kSameDeviance = 1e-5;   // relative: one minimum
constexpr double kSameParameter = 1e-5;  // relative: five digits

bool same_deviance(double a, double b) {
  return std::abs(a - b) <= kSameDeviance * std::max(1.0, std::abs(b));
}

/// All starts, each followed to its end, sorted into distinct minima.
struct MultiStart {
  std::vector<DistinctMinimum> minima;
  int run = 0, failed = 0, agreeing = 0;
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

MultiStart run_starts(const ResidualFunction& function, std::span<const FitParameter> parameters,
                      std::size_t count, std::uint64_t seed) {
  MultiStart result;
  std::vector<Minimum> ends;
  Progress progress("fitting from random starts", count);
  for (const auto& start : latin_hypercube_starts(parameters, count, seed)) {
    // Both first steps are tried from every start; the deeper end counts.
    Minimum m = minimise(function, parameters, start);
    const Minimum other = minimise(function, parameters, start, {}, FirstStep::cautious);
    if (other.usable && (!m.usable || other.deviance < m.deviance)) m = other;
    ++result.run;
    if (m.usable) {
      ends.push_back(m);
    } else {
      ++result.failed;
    }
    progress.advance();
  }
  if (ends.empty()) {
    throw Error(ExitCode::numerical, "fit",
                fmt::format("none of {} starts ended in a point that can be evaluated", count));
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
                        std::size_t starts, std::uint64_t seed, Threshold threshold,
                        bool profiles) {
  threshold.parameter_count = static_cast<int>(parameters.size());
  FitResult result;
  MultiStart multi = run_starts(function, parameters, std::max<std::size_t>(starts, 1), seed);
  result.starts_run = multi.run;
  result.starts_failed = multi.failed;
  result.starts_agreeing = multi.agreeing;
  result.minima = std::move(multi.minima);
  result.best = result.minima.front().minimum;
  result.covariance = linear_covariance(function, parameters, result.best, threshold);
  for (const FitParameter& p : parameters) {
    ParameterResult r;
    r.parameter = p;
    result.parameters.push_back(std::move(r));
  }
  if (profiles) profile_all(function, result, parameters, threshold);
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

/// Standardised as the noise model says; zero inside a band.
double standardised_residual(const FitConfig& config, const ExperimentResiduals& function,
                             std::size_t index, double predicted) {
  const FitDatum& d = function.data()[index];
  if (!d.value) return band_residual(d.sigma, *d.lower, *d.upper, predicted).r;
  for (const Experiment& e : function.experiments()) {
    if (std::find(e.data.begin(), e.data.end(), index) == e.data.end()) continue;
    const auto r = value_residual(config.data[e.choice].noise, d.sigma, *d.value, predicted);
    return r ? r->r : std::numeric_limits<double>::infinity();
  }
  return 0.0;
}

void fill_data(FitResult& result, const ExperimentResiduals& function,
               std::span<const FitParameter> parameters, const Threshold& threshold) {
  RowMatrix sensitivity;
  const Eigen::VectorXd predicted = function.predict(result.best.natural, &sensitivity);
  const Covariance& c = result.covariance;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    FittedDatum d;
    d.datum = function.data()[i];
    d.predicted = predicted[row];
    d.standardised = standardised_residual(result.config, function, i, d.predicted);
    if (c.full_rank) {
      Eigen::VectorXd g(c.theta_sd.size());
      for (Eigen::Index k = 0; k < g.size(); ++k) {
        const std::size_t j = c.free[static_cast<std::size_t>(k)];
        const FitParameter& p = parameters[j];
        g[k] = sensitivity(row, static_cast<Eigen::Index>(j)) *
               p.natural_slope(p.theta(result.best.natural[j])) * c.theta_sd[k];
      }
      d.predicted_sd = std::sqrt(std::max(g.dot(c.correlation * g), 0.0));
    }
    if (!d.datum.held_out) result.chi_square += d.standardised * d.standardised;
    result.data.push_back(std::move(d));
  }
  const bool absolute_scale = threshold.scale_known && result.degrees_of_freedom > 0;
  if (absolute_scale && result.config.loss.kind == Loss::none) {
    result.chi_square_p = boost::math::cdf(boost::math::complement(
        boost::math::chi_squared(result.degrees_of_freedom), result.chi_square));
  }
}

void add_flags(FitResult& result, const ExperimentResiduals& function) {
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
  const TpmParameters p = from_vector(function.model_parameters(result.best.natural));
  double deepest = 0.0;
  for (const Experiment& e : function.experiments()) {
    if (e.protocol.drive() == Drive::displacement) deepest = std::max(deepest, e.protocol.peak());
  }
  for (const FittedDatum& d : result.data) {
    if (d.datum.observable == Observable::indentation_depth) {
      deepest = std::max(deepest, d.predicted);
    }
  }
  for (std::string& flag : validity_flags(p, deepest)) result.flags.push_back(std::move(flag));
}

}  // namespace

FitResult run_fit(const FitConfig& config) {
  const ExperimentResiduals function(config);
  std::vector<FitParameter> parameters;
  for (const EstimatedParameter& p : config.parameters) parameters.push_back(p.fit);
  Threshold threshold;
  threshold.level = config.level;
  threshold.scale_known = config.data.front().noise.scale_known;
  threshold.data_count = function.value_count();
  threshold.parameter_count = static_cast<int>(parameters.size());

  FitResult result =
      fit_residuals(function, parameters, config.starts, config.seed, threshold, config.profiles);
  result.config = config;
  result.value_count = function.value_count();
  result.band_count = function.band_count();
  fill_data(result, function, parameters, threshold);
  for (const Hypothesis& hypothesis : config.hypotheses) {
    result.hypotheses.push_back(
        test_hypothesis(function, result, parameters, hypothesis, threshold));
  }
  add_flags(result, function);
  return result;
}

}  // namespace tpm
