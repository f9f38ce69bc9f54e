#pragma once
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Moves the first fitted sample behind what follows a step: the ramp that was not sampled,
/// ringing, and a response that still rises while the drive stands still, which no tissue does. At
/// most a fifth of the hold. Where readings ring or rise after a later step, too, the fit ends
/// before that step: what is fitted is one stretch. `start_up` says both.
void leave_out_start_up(PreparedRecording& r);

}  // namespace tpm::fit
