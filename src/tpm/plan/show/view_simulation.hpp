#pragma once
#include <filesystem>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::plan {

/// The page of a result of `tpm simulate`. Throws what its readers throw.
/// @param bytes of the file, for its hash
[[nodiscard]] ViewPage view_simulation(const std::filesystem::path& file, std::string_view bytes,
                                       const ViewOptions& options);

}  // namespace tpm::plan
