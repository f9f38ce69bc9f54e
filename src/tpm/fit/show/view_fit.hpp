#pragma once
#include <filesystem>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::fit {

/// The page of law.json, figures.json or the JSON answer of `tpm fit`. Throws Error(bad_input) for
/// another document.
/// @param bytes of the file, for its text and its hash
[[nodiscard]] ViewPage view_fit(const std::filesystem::path& file, std::string_view bytes);

}  // namespace tpm::fit
