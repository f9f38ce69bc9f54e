#pragma once
#include <filesystem>
#include <string_view>

#include "tpm/haptics/session/recording.hpp"

namespace tpm::haptics {

/// Writes a recording as HDF5 (docs/haptics.md): a list for each column of its rows, with unit and
/// meaning, the phases, and what stands before and behind the rows. Throws Error(environment).
/// @param sha256 of the recording's bytes
void export_recording(const HilRecording& recording, std::string_view sha256,
                      const std::filesystem::path& file);

}  // namespace tpm::haptics
