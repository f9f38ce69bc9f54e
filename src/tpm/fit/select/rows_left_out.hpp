#pragma once
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Adds a remark if rows of the file were left out for an empty cell or NaN.
/// @param findings of the RecordingFile that the recording was read from
void warn_of_rows_left_out(PreparedRecording& recording,
                           const std::vector<ImportFinding>& findings);

}  // namespace tpm::fit
