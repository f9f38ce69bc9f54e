#pragma once
#include <filesystem>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::haptics {

/// The file that is shown of a folder of results: selection.json or law.json of a fit,
/// figures.json, simulation.h5; any other path is the file itself. Throws Error(bad_input) for a
/// folder without one.
[[nodiscard]] std::filesystem::path shown_file(const std::filesystem::path& path);

/// Reads a result of `tpm simulate`, a recording of `tpm hil run` or a fit (law.json, figures.json
/// or the JSON answer of `tpm fit`) as the page that shows it. What the file is, its bytes say, not
/// its name. Throws Error(bad_input) for any other file, and what the readers and
/// make_loop_model() throw.
[[nodiscard]] ViewPage view_file(const std::filesystem::path& file,
                                 const ViewOptions& options = {});
}  // namespace tpm::haptics
