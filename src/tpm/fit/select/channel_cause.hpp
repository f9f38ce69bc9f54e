#pragma once
#include <span>
#include <string>

#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Cause of a delay between the two channels of a recording.
enum class ChannelFault {
  response_delayed,  ///< by a constant time
  drive_delayed,
  response_filtered,  ///< by a low pass of first order
  drive_filtered,
};

/// The recording as if the other channel had the same delay or filter: then both belong together.
/// A law that is linear in the drive answers a filtered drive with a filtered response.
/// @param time_s delay or time constant, above 0
[[nodiscard]] Recording with_same_fault(Recording recording, ChannelFault fault, double time_s);

/// Where no law that was tried describes one recording, or only one with a dashpot beside it:
/// looks for a delay between the channels, or a filter of one, with which a law does, by the same
/// test of the residual against the noise at rest. What is found is added to the causes that the
/// fit's adequacy states. Nothing is added if the test supports none, if another cause is known, or
/// for more than one recording.
void name_channel_cause(Selection& s, std::span<const PreparedRecording> recordings,
                        const SetupOptions& setup);

}  // namespace tpm::fit
