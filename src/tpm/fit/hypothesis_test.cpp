#include "tpm/fit/hypothesis_test.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/fit/verdict.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

namespace {

/// The deepest of the ends; not usable if none is.
Minimum deepest(const ResidualFunction& function, std::span<const FitParameter> parameters,
                const std::vector<std::vector<double>>& starts, const FixedMask& fixed) {
  Minimum best;
  for (const auto& start : starts) {
    const Minimum m = minimise(function, parameters, start, fixed);
    if (m.usable && (!best.usable || m.deviance < best.deviance)) best = m;
  }
  return best;
}

}  // namespace

HypothesisResult test_hypothesis(const ExperimentResiduals& function, const FitResult& fit,
                                 std::span<const FitParameter> parameters,
                                 const Hypothesis& hypothesis, const Threshold& threshold) {
  HypothesisResult result;
  result.hypothesis = hypothesis;
  FixedMask fixed(parameters.size(), false);
  std::vector<std::vector<double>> starts{fit.best.natural};
  std::ranges::move(latin_hypercube_starts(parameters, 10, fit.config.seed),
                    std::back_inserter(starts));
  for (const auto& [name, value] : hypothesis.values) {
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (parameters[i].name != name) continue;
      fixed[i] = true;
      for (auto& start : starts) start[i] = value;
    }
  }
  if (const ResidualFunction* surrogate = function.surrogate()) {
    const Minimum there = deepest(*surrogate, parameters, starts, fixed);
    starts.resize(1);
    if (there.usable) starts.push_back(there.natural);
  }
  result.minimum = deepest(function, parameters, starts, fixed);
  if (!result.minimum.usable) {
    throw Error(ExitCode::numerical, fmt::format("hypothesis '{}'", hypothesis.name),
                "the model cannot be evaluated there");
  }
  const int constrained = static_cast<int>(hypothesis.values.size());
  result.rise = std::max(result.minimum.deviance - fit.best.deviance, 0.0);
  result.p_value = threshold.p_value(result.rise, fit.best.deviance, constrained);
  result.excluded = result.p_value < 1.0 - threshold.level;
  result.summary = hypothesis_words(result, threshold.level);
  return result;
}

}  // namespace tpm::fit
