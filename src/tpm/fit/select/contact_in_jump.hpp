#pragma once
#include <string>

#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Where a probe met the tissue within a jump of the drive, so that no sample tells at which depth:
/// says so, what the fit supposes, and the option that states it. Empty if the onset is sampled, if
/// contact is stated, and for recordings that are no indentations.
/// @param config that was fitted
[[nodiscard]] std::string contact_in_jump_words(const PreparedRecording& recording,
                                                const FitConfig& config);

}  // namespace tpm::fit
