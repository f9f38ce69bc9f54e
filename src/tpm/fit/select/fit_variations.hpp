#pragma once
#include <vector>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// A fit under another assumption about what the paper does not state.
struct FitVariant {
  double rate_m_per_s = 0.0;  ///< ramp rate of every ramp-and-hold data set
  NoiseKind noise = NoiseKind::relative_to_datum;
  FitResult result;
};

/// A fit without one depth, which it then predicts.
struct HeldOutFit {
  double depth_m = 0.0;
  FitResult result;
};

/// A profile likelihood dense enough to be drawn: the interval search of run_fit takes as few steps
/// as it can.
struct DrawnProfile {
  std::size_t parameter = 0;         ///< index into FitResult::parameters
  std::vector<ProfilePoint> points;  ///< rising in the natural value
};

/// One configuration, what it depends on, and whether it predicts.
struct FitStudy {
  FitResult reference;                 ///< the configuration as it stands
  std::vector<DrawnProfile> profiles;  ///< of `reference`, one per parameter
  std::vector<FitVariant> variants;    ///< every rate with every noise convention, rates outermost
  std::vector<HeldOutFit> held_out;    ///< each depth of the data in turn
};

/// Runs the configuration at ramp rates of 1, 2 and 4 mm/s under three noise conventions of the
/// same size (relative to the datum, log-normal, relative to the model), and with each depth held
/// out. Throws Error(bad_input) if no data set of it is a ramp-and-hold.
[[nodiscard]] FitStudy run_fit_study(const FitConfig& config);

/// {"variants": [{"rate_m_per_s", "noise", "fit"}]}
[[nodiscard]] Json variants_json(const FitStudy& study);

/// {"held_out": [{"depth_m", "fit"}]}
[[nodiscard]] Json held_out_json(const FitStudy& study);

}  // namespace tpm::fit
