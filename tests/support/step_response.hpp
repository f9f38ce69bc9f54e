#pragma once
#include <span>

#include "tpm/law/relaxation.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::law {

/// StepResponse at one time, the values looked at first.
[[nodiscard]] inline SlopedNumber law_relaxation(const LawSpec& spec,
                                                 std::span<const double> values, double t_s) {
  LawModel(spec).require_in_range(values);
  return StepResponse(spec, values).relaxation(t_s);
}

[[nodiscard]] inline SlopedNumber law_creep(const LawSpec& spec, std::span<const double> values,
                                            double t_s) {
  LawModel(spec).require_in_range(values);
  return StepResponse(spec, values).creep(t_s);
}

}  // namespace tpm::law
