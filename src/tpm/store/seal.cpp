#include "tpm/store/seal.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
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

/// Of the first bytes of a file; false if they cannot be read.
bool crc_of(const fs::path& file, std::uint64_t size, std::uint32_t& crc) {
  constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 20U;
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes(static_cast<std::size_t>(std::min(size, kAtOnce)));
  crc = 0;
  for (std::uint64_t done = 0; done < size;) {
    const std::uint64_t part = std::min(size - done, kAtOnce);
    if (!in.read(bytes.data(), static_cast<std::streamsize>(part))) return false;
    crc = check_sum(bytes.data(), static_cast<std::size_t>(part), crc);
    done += part;
  }
  return true;
}

}  // namespace

void seal_file(const fs::path& file) {
  std::error_code ec;
  Seal seal{{}, fs::file_size(file, ec), 0, 0};
  std::copy(kSealMagic.begin(), kSealMagic.end(), seal.magic);
  bool good = !ec && crc_of(file, seal.size, seal.crc);
  if (good) {
    std::ofstream out(file, std::ios::binary | std::ios::app);
    out.write(reinterpret_cast<const char*>(&seal), sizeof seal);
    out.close();
    good = out.good();
  }
  if (good) return;
  throw Error(ExitCode::environment, file.string(), "cannot write its check sum",
              "a folder that can be written and has room");
}

void require_whole(const fs::path& file) {
  std::error_code ec;
  const std::uint64_t size = fs::file_size(file, ec);
  if (ec || size < sizeof(Seal)) return;
  std::ifstream in(file, std::ios::binary);
  Seal seal{};
  in.seekg(static_cast<std::streamoff>(size - sizeof seal));
  if (!in.read(reinterpret_cast<char*>(&seal), sizeof seal)) return;
  if (!std::equal(kSealMagic.begin(), kSealMagic.end(), seal.magic)) return;
  std::uint32_t crc = 0;
  if (seal.size + sizeof seal == size && crc_of(file, seal.size, crc) && crc == seal.crc) return;
  throw bad_input(file.string(), "is damaged: its check sum is another",
                  "the file as it was written");
}

}  // namespace tpm
