#pragma once
#include <string>

#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/json.hpp"

namespace tpm::files {

/// Writes the members of a JSON object into a group ("/" or "/a/b") under their own names, so that
/// an HDF5 file and the JSON of the same thing have the same keys:
///
/// | JSON | HDF5 |
/// | --- | --- |
/// | text, number | attribute |
/// | true, false | attribute, 1 or 0 |
/// | object | group, with its members |
/// | list of objects that have the same members, all texts, such as remarks | group, with a dataset
/// for each member | | null, empty text, empty list | nothing |
///
/// Other lists are for the caller to write. Attributes hold 64 KB at most.
/// @pre a list is empty or of such objects
void write_members(Hdf5Writer& file, const std::string& group, const Json& object);

}  // namespace tpm::files
