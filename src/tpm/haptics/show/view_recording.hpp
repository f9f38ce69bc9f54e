#pragma once
#include <filesystem>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::haptics {

/// The page of a recording of `tpm hil run`. Throws what its readers and make_loop_model() throw.
/// @param bytes of the file, for its hash
[[nodiscard]] ViewPage view_recording(const std::filesystem::path& file, std::string_view bytes,
                                      const ViewOptions& options);

}  // namespace tpm::haptics
