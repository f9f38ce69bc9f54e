#pragma once
#include <optional>

#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Residuals of a material function beside the scatter of neighbouring readings.
struct FunctionScatter {
  double residual_over_scatter = 0.0;  ///< ratio of standard deviations
  double p_value =
      1.0;  ///< of residuals that follow each other as much, if readings are independent
};

/// The lag-1 correlation r of the residuals, each in its noise, along time or frequency: of N pairs
/// of independent readings about a law that is right, r sqrt(N) is standard normal (the parameters
/// make r a little smaller). The scatter is that of the differences of neighbours, over sqrt(2).
/// @return none for other data than one material function, fewer than 8 pairs, or residuals at the
/// level of rounding
[[nodiscard]] std::optional<FunctionScatter> reading_scatter(const FitResult& fit);

/// States that the recommended law does not describe the readings of a material function, where its
/// residuals follow each other by more than chance (1 %).
void state_scatter(Selection& s);

/// The same for one fit whose law was chosen from such readings.
void state_scatter(FitResult& fit);

/// Noise a + b |reading| of a material function, from how the residuals of a fit scatter about
/// their neighbours: small readings of an instrument scatter by more than a share of their size.
/// @return a / b, SI; none if the noise of the fit explains the scatter (likelihood ratio, 1 %), if
/// the file states standard deviations, or below 16 readings of a curve
[[nodiscard]] std::optional<double> scatter_floor(const FitResult& fit);

/// Standard deviations of the magnitude (of its logarithm) and of the phase of a spectrum.
struct MagnitudeAndPhase {
  double magnitude = 0.0, phase_rad = 0.0;

  [[nodiscard]] Remark remark() const;
};

/// The scatter of both about a fit, degrees of freedom shared alike.
/// @return none of a spectrum whose magnitude and phase were not measured, below 16 frequencies,
/// and where one of both scatters at the level of rounding
[[nodiscard]] std::optional<MagnitudeAndPhase> scatter_of_magnitude_and_phase(const FitResult& fit);

/// Largest standard deviation that a reading of 0 may have, of noise a + b |reading|: the end of
/// the interval (likelihood ratio, 95 %) that the scatter of the residuals allows.
/// @return none below 16 readings of a curve, and for readings without scatter
[[nodiscard]] std::optional<double> most_scatter_of_small(const FitResult& fit);

}  // namespace tpm::fit
