#pragma once
#include <optional>
#include <vector>

#include "tpm/fit/fit.hpp"
#include "tpm/fit/predict/organ_bonds.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// A recording that bonds are fitted to.
struct OrganReadings {
  Protocol drive;  ///< as recorded, not counted from the contact
  std::vector<double> time_s, force_N;
  double contact_m = 0.0, offset_N = 0.0;  ///< where the search starts
};

/// A fit of an organ's bonds to readings.
struct ReadingsFit {
  /// Parameters: those of the bonds, then contact and offset of each recording.
  FitResult fit;
  int readings = 0;
  double independent = 0.0;  ///< that they count as: n_eff, see Correlation
  double rise = 0.0;         ///< of the deviance at the limits
  double level = 0.95;
};

/// The depth beyond a contact; where it is met a knot is added.
[[nodiscard]] Protocol beyond_contact(const Protocol& drive, double contact_m);

/// Minimises the sum of squares of organ less readings over the bonds' parameters and a contact and
/// an offset of each recording:
///
///     r = F(bonds; max(drive - contact, 0)) + offset - reading.
///
/// The size of the noise is estimated. Neighbours that repeat each other count as fewer independent
/// readings, as in tpm fit: what the organ cannot follow is correlated, too, and widens intervals.
/// @param bonds their parameters, from whose `start` the search begins
/// @param profiles intervals by likelihood profiles; else from derivatives at the estimate
/// Throws Error(numerical) if the organ cannot be run at the start.
[[nodiscard]] ReadingsFit fit_to_readings(const OrganModel& model, const FittedBonds& bonds,
                                          const std::vector<FitParameter>& parameters,
                                          const std::vector<OrganReadings>& recordings,
                                          bool profiles);

}  // namespace tpm::fit
