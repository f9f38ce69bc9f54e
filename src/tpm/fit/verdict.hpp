#pragma once
#include <string>

#include "tpm/fit/fit.hpp"

namespace tpm {

/// From which limits the profile reached.
[[nodiscard]] Verdict verdict_of(const ParameterResult& parameter);

/// One sentence for a reader, made from the numbers.
[[nodiscard]] std::string parameter_words(const ParameterResult& parameter, double level);

/// "eta1 = 5 Pa s is excluded by these data (...)" or "cannot be told ...".
[[nodiscard]] std::string hypothesis_words(const HypothesisResult& result, double level);

/// Which combination of parameters the data see least; empty for fewer than two free parameters.
[[nodiscard]] std::string weakest_direction_words(const FitResult& result);

}  // namespace tpm
