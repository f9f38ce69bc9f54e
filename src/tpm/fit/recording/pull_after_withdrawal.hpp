#pragma once
#include <span>

namespace tpm::fit {

/// Readings of a rest, in the order of time.
struct ReadingsAtRest {
  std::span<const double> time_s, reading;
};

/// True if the readings after withdrawal lie lower than a linear drift explains: tissue that sticks
/// to the probe still pulls it, and they tell neither the zero nor the drift. The line through the
/// readings before contact is extrapolated with its uncertainty (AR(1) noise). Nothing is claimed
/// of fewer than 20 readings before or 8 after.
[[nodiscard]] bool is_pulled_after(const ReadingsAtRest& before, const ReadingsAtRest& after);

}  // namespace tpm::fit
