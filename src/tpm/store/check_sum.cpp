#include "tpm/store/check_sum.hpp"

#include <zlib.h>

namespace tpm {

std::uint32_t check_sum(const void* bytes, std::size_t size, std::uint32_t before) {
  if (size == 0) return before;  // zlib takes no bytes for a wish to begin anew
  return static_cast<std::uint32_t>(crc32_z(before, static_cast<const Bytef*>(bytes), size));
}

std::uint32_t joined_check_sum(std::uint32_t first, std::uint32_t second,
                               std::uint64_t size_of_second) {
  return static_cast<std::uint32_t>(
      crc32_combine(first, second, static_cast<z_off_t>(size_of_second)));
}

}  // namespace tpm
