#pragma once
#include <filesystem>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Adds a remark if rows of the file were left out for an empty cell or NaN.
/// @param findings of the RecordingFile that the recording was read from
void warn_of_rows_left_out(PreparedRecording& recording,
                           const std::vector<ImportFinding>& findings);

/// Gives a recording the instrument that the description beside its file states
/// (instrument_beside), if it states one. A fit takes from it the zero where no samples before
/// contact tell it, and the least noise of a reading. What an instrument leaves unknown of
/// stiffnesses as a whole, its gain, is not in a fit's intervals: a warning says so. Throws
/// Error(bad_input) naming the key of a block that is wrong.
void take_instrument(PreparedRecording& recording, const std::filesystem::path& file);

}  // namespace tpm::fit
