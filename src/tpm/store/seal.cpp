#include "tpm/store/seal.hpp"

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

static_assert(std::endian::native == std::endian::little, "seals hold little-endian numbers");

constexpr std::string_view kSealMagic = "TPMSEAL1";

struct Seal {
  char magic[8];
  std::uint64_t size;  ///< of what is sealed
  std::uint32_t crc;
  std::uint32_t nothing;
};

/// False if there are fewer bytes.
bool read_sealed(int file, void* to, std::uint64_t size, std::uint64_t from) {
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
  constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 17U;
  std::vector<char> bytes(static_cast<std::size_t>(std::min(to - from, kAtOnce)));
  std::uint32_t crc = 0;
  while (from < to) {
    const std::uint64_t part = std::min(to - from, kAtOnce);
    if (!read_sealed(file, bytes.data(), part, from)) return std::nullopt;
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

bool seal(int descriptor, std::uint64_t size) {
  Seal seal{{}, size, 0, 0};
  std::copy(kSealMagic.begin(), kSealMagic.end(), seal.magic);
  const auto crc = crc_of(descriptor, size);
  if (!crc) {
    if (errno == 0) errno = EIO;
    return false;
  }
  seal.crc = *crc;
  const ssize_t n = ::pwrite(descriptor, &seal, sizeof seal, static_cast<off_t>(size));
  if (n >= 0 && n != sizeof seal) errno = ENOSPC;
  return n == sizeof seal && ::fsync(descriptor) == 0;
}

SealState seal_of(int descriptor) {
  struct stat found {};
  if (::fstat(descriptor, &found) != 0) return SealState::none;
  const auto size = static_cast<std::uint64_t>(found.st_size);
  Seal seal{};
  if (size < sizeof seal || !read_sealed(descriptor, &seal, sizeof seal, size - sizeof seal) ||
      !std::equal(kSealMagic.begin(), kSealMagic.end(), seal.magic)) {
    return SealState::none;
  }
  const bool whole = seal.size + sizeof seal == size && seal.nothing == 0 &&
                     crc_of(descriptor, seal.size) == seal.crc;
  return whole ? SealState::whole : SealState::broken;
}

}  // namespace tpm
