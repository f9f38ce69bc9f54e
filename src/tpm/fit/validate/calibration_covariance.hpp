#pragma once
#include <optional>
#include <span>

#include "tpm/fit/validate/placement_of_recording.hpp"

namespace tpm::fit {

/// The law with the covariance of its parameters computed again from the recordings that it was
/// fitted to, by the sandwich of least squares
///
///     C = A^-1 B A^-1,   A = sum J' J,   B = sum sigma^2 J' R J,
///
/// J the derivatives of the fitted samples by the law's coordinates and by contact and zero of each
/// recording, sigma and R from the scatter of that recording alone (scatter_of). It holds for
/// correlated readings, and for a law that leaves something out: then it is the scatter about the
/// best law of its kind. Degrees of freedom: the sum over recordings.
///
/// None where this is not what the fit did: noise that is not of one size, a recording that is
/// missing.
/// @param calibration in the order of the law's data
[[nodiscard]] std::optional<LawFile> with_calibration_covariance(
    const LawFile& law, std::span<const PreparedRecording> calibration);

}  // namespace tpm::fit
