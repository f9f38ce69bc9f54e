#pragma once
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Refuses creep under a load that was on before the recording began: how far the drive went under
/// it is unknown, and with it every stiffness.
void require_no_kept_load(const PreparedRecording& r);

}  // namespace tpm::fit
