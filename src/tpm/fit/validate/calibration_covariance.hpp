#pragma once
#include <optional>
#include <span>

#include "tpm/fit/validate/placement_of_recording.hpp"

namespace tpm::fit {

/// The law with the covariance of its parameters computed again from the recordings that it was
/// fitted to, by the sandwich of least squares
///
///     C = A^-1 B A^-1,   A = sum J' J + v P,   B = sum sigma^2 K' R K,   K = J + v W P,
///
/// J the derivatives of the fitted samples by the law's coordinates and by zero, contact and drift
/// of each recording, where they were fitted; sigma and R from the scatter of that recording alone
/// (scatter_of). P holds 1/sd^2 of what was measured of zero, contact and drift
/// (measure_placement), which the fit took as priors, and v is the variance of an independent
/// reading against which it weighed them. W holds the weights of the readings in what was measured:
/// the ramp's first part tells the onset and is fitted, too, so the two are not independent, and
/// the sd of an onset allows for more than scatter. What has no such weights counts as independent:
/// v^2 P is added to B, and (J' s u)(J' s u)' where --contact-force put contact between two samples
/// of the drive (s the derivative by contact, u = step / sqrt 3). The sandwich holds for correlated
/// readings, and for a law that leaves something out: then it is the scatter about the best law of
/// its kind. Degrees of freedom: the sum over recordings.
///
/// None where this is not what the fit did: noise that is not of one size, a recording that is
/// missing.
/// @param calibration in the order of the law's data
[[nodiscard]] std::optional<LawFile> with_calibration_covariance(
    const LawFile& law, std::span<const PreparedRecording> calibration);

/// True if `contact` of a fit is the sample at which the recording passes --contact-force.
[[nodiscard]] bool is_at_threshold(const PreparedRecording& recording, double contact);

}  // namespace tpm::fit
