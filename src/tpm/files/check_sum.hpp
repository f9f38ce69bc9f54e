#pragma once
#include <cstddef>
#include <cstdint>

namespace tpm::files {

/// CRC-32 of bytes (ISO 3309, as in gzip), or of what stands before them and the bytes.
/// @param before the check sum of what stands before; 0: nothing does
[[nodiscard]] std::uint32_t check_sum(const void* bytes, std::size_t size,
                                      std::uint32_t before = 0);

/// The check sum of two stretches one behind the other, from those of each alone.
[[nodiscard]] std::uint32_t joined_check_sum(std::uint32_t first, std::uint32_t second,
                                             std::uint64_t size_of_second);

}  // namespace tpm::files
