#pragma once
#include <cstddef>
#include <cstdint>

namespace tpm::files {

/// CRC-32 of bytes (ISO 3309, as in gzip), or of what stands before them and the bytes.
/// @param before the CRC of what stands before; 0: nothing does
[[nodiscard]] std::uint32_t crc32_of(const void* bytes, std::size_t size, std::uint32_t before = 0);

/// The CRC of two stretches one behind the other, from those of each alone.
[[nodiscard]] std::uint32_t joined_crc32(std::uint32_t first, std::uint32_t second,
                                         std::uint64_t size_of_second);

/// Writes behind the first `size` bytes of an open file a checksum (their CRC) and passes the file
/// to the disk: from here on it survives the machine. HDF5 ignores what stands behind its own end.
/// False with errno if that is not possible.
[[nodiscard]] bool write_checksum(int descriptor, std::uint64_t size);

/// State of a file's content by the checksum at its end.
enum class ChecksumState { none, whole, broken };

[[nodiscard]] ChecksumState checksum_of(int descriptor);

}  // namespace tpm::files
