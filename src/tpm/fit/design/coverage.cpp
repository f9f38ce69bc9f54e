#include "tpm/fit/design/coverage.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/distributions.hpp"
#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/work/give_up.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

void refuse_what_cannot_be_simulated(const FitConfig& config, const ExperimentResiduals& function) {
  if (function.band_count() > 0) {
    throw bad_input("coverage", fmt::format("the data hold {} bands", function.band_count()),
                    "values only: a band has no noise model to simulate");
  }
  if (config.loss.kind != Loss::none) {
    throw bad_input("coverage", "a robust loss has no chi-square threshold", "loss 'none'");
  }
}

/// A datum as the declared noise would scatter it about the true value.
double simulated(const ExperimentResiduals& function, std::size_t datum, double true_value,
                 std::span<const double> natural, Random& random) {
  const std::size_t choice = function.data()[datum].choice;
  const ErrorLaw law = error_law(function.config().data[choice].noise);
  const double scale = function.new_noise_scale(datum, true_value, natural);
  return scattered(law, true_value, scale, draw_error(law, random));
}

/// A profile that failed is no interval.
bool holds(const ParameterResult& p, double true_value) {
  return p.verdict != Verdict::failed && (!p.lower || *p.lower <= true_value) &&
         (!p.upper || true_value <= *p.upper);
}

}  // namespace

double binomial_test(int k, int n, double p) {
  const double here = binomial_density(k, n, p);
  double sum = 0.0;
  for (int i = 0; i <= n; ++i) {
    const double there = binomial_density(i, n, p);
    if (there <= here * (1.0 + 1e-7)) sum += there;
  }
  return std::min(sum, 1.0);
}

CoverageResult check_coverage(const FitConfig& config, int sets, std::uint64_t seed) {
  ExperimentResiduals function(config);
  refuse_what_cannot_be_simulated(config, function);
  const std::vector<FitParameter> parameters = searched_parameters(function.config());
  const std::vector<double> true_value = start_values(parameters);
  CoverageResult result;
  for (const FitParameter& p : parameters) result.parameters.push_back({p.name, 0, 0, 1.0});
  const Threshold threshold{config.level, config.scale_known(), function.value_count()};
  result.seed = seed;
  result.level = config.level;

  const Eigen::VectorXd expected = function.predict(true_value, nullptr);
  Random random(seed);
  Progress progress("simulating and fitting", static_cast<std::size_t>(sets));
  for (int set = 0; set < sets; ++set) {
    for (const Experiment& experiment : function.experiments()) {
      for (const std::size_t i : experiment.data) {
        function.set_value(
            i, simulated(function, i, expected[static_cast<Eigen::Index>(i)], true_value, random));
      }
    }
    ++result.sets;
    progress.advance();
    // A set that cannot be fitted counts as not covered, and is reported.
    const std::string failure = gave_up([&] {
      const FitResult fit = fit_residuals(function, parameters, fit_starts(function, parameters),
                                          threshold, true, start_kind(function));
      for (std::size_t i = 0; i < parameters.size(); ++i) {
        const ParameterResult& p = fit.parameters[i];
        if (holds(p, true_value[i])) ++result.parameters[i].covered;
        if (p.verdict != Verdict::identified) ++result.parameters[i].one_sided;
      }
    });
    if (!failure.empty()) ++result.failed;
  }
  for (ParameterCoverage& p : result.parameters) {
    p.p_value = binomial_test(p.covered, result.sets, result.level);
  }
  return result;
}

Json to_json(const CoverageResult& result) {
  Json j{{"seed", result.seed}, {"confidence_level", result.level}, {"data_sets", result.sets}};
  j["failed"] = result.failed;
  j["parameters"] = array_json(result.parameters, [&](const ParameterCoverage& p) {
    return Json{{"name", p.name},
                {"covered", p.covered},
                {"coverage", rounded(static_cast<double>(p.covered) / result.sets)},
                {"open_intervals", p.one_sided},
                {"binomial_p_value", rounded(p.p_value)}};
  });
  return j;
}

std::string to_terminal_text(const CoverageResult& result) {
  std::string text = fmt::format(
      "{} simulated data sets, seed {}, {} could not be fitted; true values: the start values of "
      "the configuration\n",
      result.sets, result.seed, result.failed);
  for (const ParameterCoverage& p : result.parameters) {
    text += fmt::format(
        "{:<12} {} of {} intervals at {:.4g} % contain the true value ({} %; exact binomial p = "
        "{}; {} intervals open)\n",
        p.name, p.covered, result.sets, 100.0 * result.level,
        significant(100.0 * p.covered / result.sets, 4), significant(p.p_value, 2), p.one_sided);
  }
  return text;
}

}  // namespace tpm::fit
