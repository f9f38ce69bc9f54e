#pragma once
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Refuses a force or a depth that is counted negative: Error(bad_input) names the option that
/// turns it. A hold alone passes.
void require_rise(const PreparedRecording& recording);

}  // namespace tpm::fit
