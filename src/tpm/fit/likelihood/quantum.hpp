#pragma once
#include <span>

namespace tpm::fit {

/// Step between neighbouring levels of readings that were rounded to a grid; 0 if there is none.
[[nodiscard]] double quantum_of(std::span<const double> readings);

}  // namespace tpm::fit
