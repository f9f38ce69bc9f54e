#include "tpm/store/checksum.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tpm/store/check_sum.hpp"

namespace tpm {
namespace {

static_assert(std::endian::native == std::endian::little, "check sums hold little-endian numbers");

constexpr std::string_view kChecksumMagic = "TPMSEAL1";

struct CheckSum {
  char magic[8];
  std::uint64_t size;  ///< of what the check sum covers
  std::uint32_t crc;
  std::uint32_t nothing;
};

/// False if there are fewer bytes.
bool read_checked(int file, void* to, std::uint64_t size, std::uint64_t from) {
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t n = ::pread(file, bytes, size, static_cast<off_t>(from));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    from += static_cast<std::uint64_t>(n);
    size -= static_cast<std::uint64_t>(n);
  }
  return true;
}

constexpr std::uint64_t kStretch = std::uint64_t{1} << 22U;

/// Of a stretch of a file.
std::optional<std::uint32_t> crc_of_stretch(int file, std::uint64_t from, std::uint64_t to) {
  constexpr std::uint64_t kInstantaneous = std::uint64_t{1} << 17U;
  std::vector<char> bytes(static_cast<std::size_t>(std::min(to - from, kInstantaneous)));
  std::uint32_t crc = 0;
  while (from < to) {
    const std::uint64_t part = std::min(to - from, kInstantaneous);
    if (!read_checked(file, bytes.data(), part, from)) return std::nullopt;
    crc = check_sum(bytes.data(), static_cast<std::size_t>(part), crc);
    from += part;
  }
  return crc;
}

/// Of the first bytes of a file, by all threads; nothing if they cannot be read.
std::optional<std::uint32_t> crc_of(int file, std::uint64_t size) {
  std::vector<std::optional<std::uint32_t>> parts((size + kStretch - 1) / kStretch);
  const auto end_of = [&](std::size_t i) { return std::min(size, (i + 1) * kStretch); };
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    parts[i] = crc_of_stretch(file, i * kStretch, end_of(i));
  });
  std::uint32_t whole = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i]) return std::nullopt;
    whole = joined_check_sum(whole, *parts[i], end_of(i) - i * kStretch);
  }
  return whole;
}

}  // namespace

bool write_checksum(int descriptor, std::uint64_t size) {
  CheckSum write_checksum{{}, size, 0, 0};
  std::copy(kChecksumMagic.begin(), kChecksumMagic.end(), write_checksum.magic);
  const auto crc = crc_of(descriptor, size);
  if (!crc) {
    if (errno == 0) errno = EIO;
    return false;
  }
  write_checksum.crc = *crc;
  const ssize_t n =
      ::pwrite(descriptor, &write_checksum, sizeof write_checksum, static_cast<off_t>(size));
  if (n >= 0 && n != sizeof write_checksum) errno = ENOSPC;
  return n == sizeof write_checksum && ::fsync(descriptor) == 0;
}

ChecksumState checksum_of(int descriptor) {
  struct stat found {};
  if (::fstat(descriptor, &found) != 0) return ChecksumState::none;
  const auto size = static_cast<std::uint64_t>(found.st_size);
  CheckSum write_checksum{};
  if (size < sizeof write_checksum ||
      !read_checked(descriptor, &write_checksum, sizeof write_checksum,
                    size - sizeof write_checksum) ||
      !std::equal(kChecksumMagic.begin(), kChecksumMagic.end(), write_checksum.magic)) {
    return ChecksumState::none;
  }
  const bool whole = write_checksum.size + sizeof write_checksum == size &&
                     write_checksum.nothing == 0 &&
                     crc_of(descriptor, write_checksum.size) == write_checksum.crc;
  return whole ? ChecksumState::whole : ChecksumState::broken;
}

}  // namespace tpm
