#pragma once
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// Time to which a recording is fitted, s: where the drive first falls back, because a contact may
/// shrink from there on. Creep of a strain has none, and is fitted with its recovery.
[[nodiscard]] double end_of_test(const PreparedRecording& recording);

}  // namespace tpm::fit
