#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/instrument.hpp"

namespace tpm::fit {

/// One error of an instrument: how E follows from it in the validation and in the calibration.
struct InstrumentEffect {
  const char* name;
  double validation = 0.0, calibration = 0.0;  ///< d E / d error
  double u_validation = 0.0, u_calibration = 0.0;
};

/// Derivatives of S and D by errors of the channels: relative ones of depth, time and response,
/// absolute ones of time (s), depth and response (SI).
struct ChannelSlopes {
  double depth_scale, time_scale, time_shift, travel;  ///< of S
  double simulated, by_simulated;                      ///< of S, by the law's response
  double measured, by_measured;                        ///< of D, by the readings
};

/// The errors of the channels that one of the two instruments states.
/// @param creep the force was imposed and the depth read
[[nodiscard]] std::vector<InstrumentEffect> instrument_effects(
    const ChannelSlopes& by, const std::optional<Instrument>& validation,
    const std::optional<Instrument>& calibration, bool creep);

/// d S / d ln(radius of the probe), where the tissue is a homogeneous half space: it has no length
/// of its own, so force over R^2 is one function of depth over R, whatever the law, and
///
///     dF / d ln R = 2 F - dF / d ln u,   of creep   du / d ln R = u - 2 du / d ln F.
///
/// A half of the force for Hertz's sphere, all of it for a flat punch.
/// @param imposed_scale d S / d ln(depth), of creep d S / d ln(force)
[[nodiscard]] double slope_by_radius(double simulated, double imposed_scale, bool creep);

/// The error of a probe's radius: the law was fitted with one probe, D was measured with the same
/// or another one. With the same it is in both alike, whatever its size.
struct ProbeEffect {
  bool stated = false;                             ///< one of the two radii has an uncertainty
  bool same = false;                               ///< one probe
  double u_validation = 0.0, u_calibration = 0.0;  ///< of ln R; 0 each if it is the same probe
};
[[nodiscard]] ProbeEffect probe_effect(const std::optional<Instrument>& validation,
                                       const std::optional<Instrument>& calibration);

/// Whose radius is in u_input, for the line on the instrument; empty: none is stated.
[[nodiscard]] std::string probe_words(const std::optional<Instrument>& validation,
                                      const std::optional<Instrument>& calibration);

/// Two probes of different size: a law holds the calibration's. Empty: of one size, as far as
/// known.
[[nodiscard]] std::string probe_difference_words(const std::optional<Instrument>& validation,
                                                 const std::optional<Instrument>& calibration);

}  // namespace tpm::fit
