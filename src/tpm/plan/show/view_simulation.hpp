#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/import/file_kind.hpp"
#include "tpm/show/view_parts.hpp"

namespace tpm::plan {

/// The kind of an HDF5 file that is no result of `tpm simulate`, and its viewer; none for a
/// result.
[[nodiscard]] std::optional<OtherKind> other_than_simulation(const Hdf5Reader& file,
                                                             const std::filesystem::path& path);

/// The page of a result of `tpm simulate`. Throws what its readers throw.
/// @param bytes of the file, for its hash
[[nodiscard]] ViewPage view_simulation(const std::filesystem::path& file, std::string_view bytes,
                                       const ViewOptions& options);

}  // namespace tpm::plan
