// Declared in tpm/fit/design/design.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/work/give_up.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr int kFewestSets = 10;

/// Scatters the readings of a recording about the expected ones.
/// @param neighbours correlation of neighbouring readings, 0 .. 1
PointSet scattered(PointSet points, double neighbours, Random& random) {
  double z = random.normal();
  for (Datum& d : points.data) {
    *d.value += *d.sd * z;
    z = neighbours * z + std::sqrt(1.0 - neighbours * neighbours) * random.normal();
  }
  return points;
}

/// Errors in theta of the fitted data sets, one vector for each material parameter.
using Errors = std::vector<std::vector<double>>;

bool on_a_bound(const FitResult& fit, std::size_t material) {
  return std::any_of(fit.parameters.begin(),
                     fit.parameters.begin() + static_cast<std::ptrdiff_t>(material),
                     [](const ParameterResult& p) { return p.at_lower_bound || p.at_upper_bound; });
}

void collect(const FitResult& fit, Errors& errors) {
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    errors[i].push_back(p.parameter.theta(p.estimate) - p.parameter.theta(p.parameter.start));
  }
}

CheckedParameter check_of(const ExpectedParameter& expected, const FitParameter& parameter,
                          const std::vector<double>& errors) {
  const auto n = static_cast<double>(errors.size());
  CheckedParameter result;
  result.name = expected.name;
  result.predicted = expected.theta_standard_error;
  double mean = 0.0;
  for (const double e : errors) mean += e / n;
  double squares = 0.0;
  for (const double e : errors) squares += (e - mean) * (e - mean);
  result.observed = std::sqrt(squares / (n - 1.0));
  if (!std::isfinite(result.predicted)) {
    result.agrees = false;
    return result;
  }
  result.ratio = result.observed / result.predicted;
  result.ratio_error = result.ratio / std::sqrt(2.0 * (n - 1.0));
  result.bias = mean / result.predicted;
  result.bias_error = result.ratio / std::sqrt(n);
  // The interval is symmetric in theta: it contains the true value as often as an
  // interval about the true value contains the estimate.
  const double theta = parameter.theta(parameter.start);
  const auto reach = [&](const std::optional<double>& limit) {
    return limit ? std::abs(parameter.theta(*limit) - theta)
                 : std::numeric_limits<double>::infinity();
  };
  const double width = std::min(reach(expected.lower), reach(expected.upper));
  result.covered = static_cast<int>(
      std::count_if(errors.begin(), errors.end(), [&](double e) { return std::abs(e) <= width; }));
  constexpr double kSure = 3.0;
  result.agrees = std::abs(result.ratio - 1.0) <= kSure * result.ratio_error &&
                  std::abs(result.bias) <= kSure * result.bias_error;
  return result;
}

Remark disagreement(const CheckedParameter& p) {
  if (!std::isfinite(p.predicted)) {
    return {"nothing_predicted",
            fmt::format("{}: no information is predicted; nothing to compare with", p.name)};
  }
  return {"linear_prediction_fails", fmt::format("{}: the estimates spread {} +- {} times as far "
                                                 "as predicted, mean error {} +- {} predicted "
                                                 "standard errors: the linear prediction does not "
                                                 "hold (nonlinearity, a bound, or correlated "
                                                 "noise)",
                                                 p.name, fixed(p.ratio, 2), fixed(p.ratio_error, 2),
                                                 fixed(p.bias, 2), fixed(p.bias_error, 2))};
}

/// Knowledge from the simulated experiments alone.
Expectation predicted(const DesignProblem& problem,
                      const std::vector<PlannedExperiment>& experiments) {
  Knowledge knowledge = nothing_known(problem);
  for (const PlannedExperiment& e : experiments) {
    knowledge.add(recording_information(problem, e), e.repeats);
  }
  return expectation(problem, knowledge);
}

/// Correlation of neighbouring readings in each recording of planned_fit.
std::vector<double> neighbour_correlations(const DesignProblem& problem,
                                           const std::vector<PlannedExperiment>& experiments) {
  std::vector<double> list;
  for (const PlannedExperiment& e : experiments) {
    const double correlation = problem.correlation_time_s > 0.0
                                   ? std::exp(-e.interval_s / problem.correlation_time_s)
                                   : 0.0;
    list.insert(list.end(), static_cast<std::size_t>(e.repeats), correlation);
  }
  return list;
}

}  // namespace

DesignCheck check_design(const DesignProblem& problem, const PlannedExperiment& experiment,
                         int sets, std::uint64_t seed) {
  if (sets < kFewestSets) {
    throw Error(ExitCode::usage, "--repetitions", fmt::format("{} simulated data sets", sets),
                fmt::format("{} or more", kFewestSets));
  }
  std::vector<PlannedExperiment> experiments = problem.previous;
  experiments.push_back(experiment);
  const Expectation expected = predicted(problem, experiments);
  const PlannedFit planned = planned_fit(problem, experiments);
  const std::vector<double> neighbours = neighbour_correlations(problem, experiments);
  const std::size_t material = problem.config.parameters.size();

  DesignCheck check;
  check.seed = seed;
  Errors errors(material);
  Random random(seed);
  Progress progress("simulating and fitting", static_cast<std::size_t>(sets));
  for (int set = 0; set < sets; ++set) {
    std::vector<DataSet> data;
    data.reserve(planned.data.size());
    for (std::size_t i = 0; i < planned.data.size(); ++i) {
      data.emplace_back(scattered(std::get<PointSet>(planned.data[i]), neighbours[i], random));
    }
    progress.advance();
    const std::string failure = gave_up([&] {
      const FitResult fit = run_fit(planned.config, data);
      collect(fit, errors);
      ++check.sets;
      if (on_a_bound(fit, material)) ++check.at_bound;
    });
    if (!failure.empty()) ++check.failed;
  }
  if (2 * check.sets < sets) {
    throw Error(
        ExitCode::numerical, "design",
        fmt::format("{} of {} simulated data sets could not be fitted", check.failed, sets));
  }
  for (std::size_t i = 0; i < material; ++i) {
    check.parameters.push_back(check_of(expected.parameters[i], problem.parameter(i), errors[i]));
    if (!check.parameters.back().agrees) {
      check.remarks.push_back(disagreement(check.parameters.back()));
    }
  }
  if (check.at_bound > 0) {
    check.remarks.push_back(
        {"fits_at_bound", fmt::format("{} of {} fits ended with a parameter on its bound",
                                      check.at_bound, check.sets)});
  }
  return check;
}

}  // namespace tpm::fit
