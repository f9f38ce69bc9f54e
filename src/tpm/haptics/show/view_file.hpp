#pragma once
#include <filesystem>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::haptics {

/// Reads a result of `tpm simulate`, a recording of `tpm hil run` or a fit (law.json, figures.json
/// or the JSON answer of `tpm fit`) as the page that shows it. What the file is, its bytes say, not
/// its name. Throws Error(bad_input) for any other file, and what the readers and
/// make_loop_model() throw.
[[nodiscard]] ViewPage view_file(const std::filesystem::path& file,
                                 const ViewOptions& options = {});
}  // namespace tpm::haptics
