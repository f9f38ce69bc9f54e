#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Number of starts that found the minimum of a search. Ends that are as good within a
/// twentieth of what an interval allows count as the same.
struct Confirmation {
  int starts = 0;                             ///< that were followed to an end
  int found = 0;                              ///< of them, in this minimum
  std::optional<std::vector<double>> deeper;  ///< where a further start went lower

  /// One start of several: another search may find a deeper minimum.
  [[nodiscard]] bool is_doubtful() const { return starts > 1 && found < 2; }
};

/// Follows further starts (further_starts) if one alone found the minimum.
[[nodiscard]] Confirmation confirm(const FitResult& result, const ExperimentResiduals& function,
                                   std::span<const FitParameter> parameters,
                                   const Threshold& threshold);

/// Says of the parameters of a doubtful minimum why they are not identified, and what to do.
void mark_unconfirmed(FitResult& result, const Confirmation& confirmation);

}  // namespace tpm::fit
