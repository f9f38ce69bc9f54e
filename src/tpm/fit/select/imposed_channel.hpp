#pragma once
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Finds which channel of a recording of stress and strain, or of force and depth, was imposed,
/// before its phases are known: the load if it was held while the strain or depth went on under it
/// (creep), by much more of its range or in a noisier channel, or if a stress went up in stairs and
/// the strain on under the last one. Drive and response then change
/// places, and load_imposed is set: a fit imposes the load and compares the strain or depth.
/// `remarks` say so, and what it biases if both channels are noisy. Throws Error(bad_input) if the
/// strain or depth relaxes under a held load: their titles are swapped.
void find_imposed_channel(PreparedRecording& recording);

/// The warning of find_imposed_channel() for a recording whose imposed channel is known; empty if
/// there is none.
/// @param as_read before drive and response change places
[[nodiscard]] std::optional<Remark> imposed_channel_remark(const std::string& name,
                                                           const Recording& as_read,
                                                           bool load_imposed);

/// Where the search for a law of creep begins: what fits find that take the strain as exact. The
/// stress is linear in the stiffnesses, so that those fits are quick and meet every minimum; the
/// strain under a stress is linear in none.
/// @param config of the recordings, some of which are of creep
/// @return each in the order of config.parameters and within their bounds; may be empty
[[nodiscard]] std::vector<std::vector<double>> creep_starts(
    const FitConfig& config, std::span<const PreparedRecording> recordings,
    const SetupOptions& options);

}  // namespace tpm::fit
