#pragma once
#include <cstdint>

namespace tpm::files {

/// Writes behind the first `size` bytes of an open file a check sum of them, and passes the file to
/// the disk: from here on it survives the machine. HDF5 ignores what stands behind its own end.
/// False with errno if that is not possible.
[[nodiscard]] bool write_checksum(int descriptor, std::uint64_t size);

/// State of a file's content by the checksum at its end.
enum class ChecksumState { none, whole, broken };

[[nodiscard]] ChecksumState checksum_of(int descriptor);

}  // namespace tpm::files
