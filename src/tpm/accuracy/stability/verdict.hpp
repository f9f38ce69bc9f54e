#pragma once
// Classification of a run by comparison with the reference.
#include <array>
#include <string>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/steps/method.hpp"

namespace tpm::accuracy {

/// Classes of a run.
enum class StabilityClass {
  holds,               ///< the steady state within kHoldsWithin of the peak
  oscillates,          ///< about the reference, from step to step or slowly, without growing
  wrong_steady_state,  ///< calm, and somewhere else
  energy_grew,         ///< a motion gains: not beyond all bounds yet
  diverged,
  newton_failed,
  buckled,
  too_much_work,
  not_applicable,
};

struct StabilityClassEntry {
  StabilityClass meaning;
  std::string_view text;
};

inline constexpr std::array<StabilityClassEntry, 9> kStabilityClasses{{
    {StabilityClass::holds, "holds"},
    {StabilityClass::oscillates, "oscillates"},
    {StabilityClass::wrong_steady_state, "wrong steady state"},
    {StabilityClass::energy_grew, "energy grew"},
    {StabilityClass::diverged, "diverged"},
    {StabilityClass::newton_failed, "Newton failed"},
    {StabilityClass::buckled, "buckled"},
    {StabilityClass::too_much_work, "too much work"},
    {StabilityClass::not_applicable, "not applicable"},
}};

[[nodiscard]] std::string_view stability_class_name(StabilityClass c);

/// Error of the steady state that a run may have and still holds, in parts of the peak.
inline constexpr double kHoldsWithin = 0.02;

struct StabilityVerdict {
  StabilityClass found = StabilityClass::holds;
  double error = 0.0;  ///< largest difference at the end, in parts of the peak; NaN if not reached
  std::string reason;  ///< in words, where the run did not complete
};

/// Classifies the responses at times one step apart at the end of a run.
/// @param reference at the same times
/// @param peak size of the response that the error is relative to, > 0
/// @param moves spheres have mass
[[nodiscard]] StabilityVerdict classify_run(const MethodRun& run, const Eigen::VectorXd& reference,
                                            double peak, bool moves);

}  // namespace tpm::accuracy
