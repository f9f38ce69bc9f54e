#include "tpm/store/seal.hpp"

#include <fcntl.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tpm/core/error.hpp"
#include "tpm/store/check_sum.hpp"

namespace tpm {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "seals hold little-endian numbers");

constexpr std::string_view kSealMagic = "TPMSEAL1";

struct Seal {
  char magic[8];
  std::uint64_t size;  ///< of what is sealed
  std::uint32_t crc;
  std::uint32_t nothing;
};

/// A file that is open, for as long as this lives.
class OpenFile {
 public:
  OpenFile(const fs::path& file, int flags) : file_(::open(file.c_str(), flags | O_CLOEXEC)) {}
  ~OpenFile() {
    if (file_ >= 0) ::close(file_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] int get() const { return file_; }

  /// False if there are fewer bytes.
  bool read(void* to, std::uint64_t size, std::uint64_t from) const {
    auto* bytes = static_cast<char*>(to);
    while (size > 0) {
      const ssize_t n = ::pread(file_, bytes, size, static_cast<off_t>(from));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      bytes += n;
      from += static_cast<std::uint64_t>(n);
      size -= static_cast<std::uint64_t>(n);
    }
    return true;
  }

 private:
  int file_;
};

constexpr std::uint64_t kStretch = std::uint64_t{1} << 22U;

/// Of a stretch of a file.
std::optional<std::uint32_t> crc_of_stretch(const OpenFile& file, std::uint64_t from,
                                            std::uint64_t to) {
  constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 17U;
  std::vector<char> bytes(static_cast<std::size_t>(std::min(to - from, kAtOnce)));
  std::uint32_t crc = 0;
  while (from < to) {
    const std::uint64_t part = std::min(to - from, kAtOnce);
    if (!file.read(bytes.data(), part, from)) return std::nullopt;
    crc = check_sum(bytes.data(), static_cast<std::size_t>(part), crc);
    from += part;
  }
  return crc;
}

/// Of the first bytes of a file, by all threads; nothing if they cannot be read.
std::optional<std::uint32_t> crc_of(const OpenFile& file, std::uint64_t size) {
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

void seal_file(const fs::path& file) {
  std::error_code ec;
  Seal seal{{}, fs::file_size(file, ec), 0, 0};
  std::copy(kSealMagic.begin(), kSealMagic.end(), seal.magic);
  const OpenFile opened(file, O_RDWR);
  const auto crc = crc_of(opened, seal.size);
  if (!ec && crc) {
    seal.crc = *crc;
    const auto end = static_cast<off_t>(seal.size);
    if (::pwrite(opened.get(), &seal, sizeof seal, end) == sizeof seal &&
        ::fsync(opened.get()) == 0) {
      return;
    }
  }
  throw Error(ExitCode::environment, file.string(), "cannot write its check sum",
              "a folder that can be written and has room");
}

void require_whole(const fs::path& file) {
  std::error_code ec;
  const std::uint64_t size = fs::file_size(file, ec);
  if (ec || size < sizeof(Seal)) return;
  const OpenFile opened(file, O_RDONLY);
  Seal seal{};
  if (!opened.read(&seal, sizeof seal, size - sizeof seal)) return;
  if (!std::equal(kSealMagic.begin(), kSealMagic.end(), seal.magic)) return;
  if (seal.size + sizeof seal == size && crc_of(opened, seal.size) == seal.crc) return;
  throw bad_input(file.string(), "is damaged: its check sum is another",
                  "the file as it was written");
}

}  // namespace tpm
