#pragma once
// Internal to store/: how HDF5 reaches a file that is open already.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tpm/files/hdf5/hdf5.hpp"

namespace tpm::files {

/// A file under HDF5. The library does not survive a disk that gets full under it: it crashes or
/// loops while it closes. So it is never told: a write that fails is kept here, what could not be
/// written is kept in memory, and whoever writes asks for `error_number`.
struct Hdf5Storage {
  int descriptor = -1;  ///< owned by whoever made it
  bool writes = false;
  int error_number = 0;             ///< errno of the first write that failed; 0: none
  std::uint64_t begin_of_free = 0;  ///< end of what HDF5 gave out; known when it is closed
  std::map<std::uint64_t, std::vector<char>> unwritten;
};

/// Creates or opens HDF5 in the storage, which must live until the handle is closed. The handle is
/// invalid if HDF5 refuses. No other file can be opened through it: external links lead nowhere.
[[nodiscard]] Hdf5Handle create_hdf5(Hdf5Storage& storage);
[[nodiscard]] Hdf5Handle open_hdf5(Hdf5Storage& storage);

}  // namespace tpm::files
