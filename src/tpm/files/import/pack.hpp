#pragma once
#include <filesystem>
#include <vector>

#include "tpmkit/curve_file.hpp"

namespace tpm::files {

/// Writes curves into one HDF5 file, each as a group /curves/ID with its description in attributes
/// and one dataset for each column. Numbers are SI doubles with attributes "quantity" and "unit";
/// an empty field is NaN, as the attribute "missing" says; every row or recording has its
/// provenance. The file appears under its name only when it is complete. Throws Error(bad_input)
/// if two curves have one id, Error(environment) if the file cannot be written.
void pack_curves(const std::filesystem::path& path, const std::vector<Curve>& curves);

/// The inverse, in alphabetical order of the ids. Line numbers stay behind; numbers and words come
/// back exactly. Throws Error(bad_input).
[[nodiscard]] std::vector<Curve> unpack_curves(const std::filesystem::path& path);

}  // namespace tpm::files
