#include "tpm/files/file.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/sha.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "tpm/files/descriptor.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/files_read.hpp"
#include "tpm/files/replacement.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace fs = std::filesystem;
namespace {

/// /dev/stdout, /dev/fd/3: links into /proc, which stand for a stream whatever it is connected to.
bool is_open_stream(const fs::path& path) {
  constexpr int kMostLinks = 40;
  fs::path target = path;
  std::error_code ec;
  for (int links = 0; links < kMostLinks && fs::is_symlink(target, ec); ++links) {
    if (target.string().starts_with("/proc/")) return true;
    const fs::path next = fs::read_symlink(target, ec);
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return false;
}

/// False with errno if reading fails; stops one byte above the limit.
bool read_all(int fd, std::uint64_t most, std::string& bytes) {
  // A pipe has no size, and a file may change: whatever comes is read in blocks.
  // A block is zeroed before it is read into: of a small file no more than its size is asked for.
  constexpr std::size_t kBlock = std::size_t{1} << 20U;
  constexpr std::size_t kLeastGrowth = std::size_t{1} << 16U;
  while (bytes.size() <= most) {
    const std::size_t have = bytes.size();
    const std::size_t room = bytes.capacity() - have;
    const std::size_t block = std::min(kBlock, room > 0 ? room : std::max(kLeastGrowth, have));
    bytes.resize(have + std::min<std::uint64_t>(block, most + 1 - have));
    const ssize_t n = ::read(fd, bytes.data() + have, bytes.size() - have);
    bytes.resize(have + static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n == 0;
  }
  return true;
}

}  // namespace

Error cannot_read(const fs::path& path, int error_number) {
  const bool of_the_file = error_number == EACCES || error_number == EPERM ||
                           error_number == ENOENT || error_number == ENXIO;
  if (of_the_file) {
    return bad_input(path.string(), "cannot be opened for reading", "a readable file");
  }
  return {ExitCode::environment, path.string(),
          fmt::format("cannot be opened for reading: {}", std::strerror(error_number)),
          "a system that can open one more file"};
}

Error cannot_write(const fs::path& path, int error_number) {
  const char* expected = "a folder that can be written and has room";
  if (error_number == ENAMETOOLONG) expected = "a name of at most 255 bytes";
  if (error_number == ELOOP) expected = "links that lead to a file";
  return {ExitCode::environment, path.string(),
          fmt::format("cannot write: {}", std::strerror(error_number)), expected};
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

std::optional<std::size_t> pread_all(int descriptor, void* to, std::size_t size,
                                     std::uint64_t from) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = ::pread(descriptor, static_cast<char*>(to) + done, size - done,
                              static_cast<off_t>(from + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return std::nullopt;
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

std::size_t pwrite_all(int descriptor, const void* from, std::size_t size, std::uint64_t to) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = ::pwrite(descriptor, static_cast<const char*>(from) + done, size - done,
                               static_cast<off_t>(to + done));
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

namespace {

/// One that has a name, so that perhaps nobody writes into it; a shell's `<(...)` has none.
bool is_named_pipe(const fs::path& path, const fs::file_status& status) {
  std::error_code ec;
  (void)fs::canonical(path, ec);
  return fs::is_fifo(status) && !ec;
}

/// Opening a pipe that nobody writes into would wait for ever. The descriptor blocks afterwards.
void wait_for_writer(const fs::path& path, int descriptor) {
  constexpr int kLongest_ms = 10000;
  pollfd waited{descriptor, POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&waited, 1, kLongest_ms);
  } while (ready < 0 && errno == EINTR);
  if (ready <= 0) {
    throw bad_input(
        path.string(),
        fmt::format("is a pipe into which nothing was written for {} s", kLongest_ms / 1000),
        "a file, or a pipe that something is written into");
  }
  (void)::fcntl(descriptor, F_SETFL, 0);
}

}  // namespace

std::string read_file(const fs::path& path, std::uint64_t most) {
  constexpr std::uint64_t kLargestFromDevice = std::uint64_t{1} << 24U;  // it may have no end
  std::error_code ec;
  const auto status = fs::status(path, ec);
  if (fs::is_character_file(status)) most = std::min(most, kLargestFromDevice);
  require_exists(path);
  if (fs::is_directory(status)) throw bad_input(path.string(), "is a folder", "a readable file");
  const bool pipe = is_named_pipe(path, status);
  const Descriptor in(::open(path.c_str(), O_RDONLY | O_CLOEXEC | (pipe ? O_NONBLOCK : 0)));
  if (in.get() < 0) {
    throw cannot_read(path, errno);
  }
  if (pipe) wait_for_writer(path, in.get());
  note_reading(path, in.get());
  const auto too_large = [&] {
    return bad_input(path.string(), fmt::format("holds more than {} MB", most >> 20U),
                     "a smaller file");
  };
  std::string bytes;
  if (fs::is_regular_file(status)) {
    const std::uint64_t size = fs::file_size(path, ec);
    if (!ec && size > most) throw too_large();
    if (!ec) bytes.reserve(size + 1);
  }
  if (!read_all(in.get(), most, bytes)) {
    throw bad_input(path.string(), "reading stopped half-way", "a readable file");
  }
  if (bytes.size() > most) throw too_large();
  if (bytes.empty()) throw bad_input(path.string(), "the file is empty", "some content");
  return bytes;
}

bool is_device_or_pipe(const fs::path& path) {
  if (is_open_stream(path)) return true;
  std::error_code ec;
  const auto status = fs::status(path, ec);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

void require_replaceable(const fs::path& path) {
  const bool device = is_device_or_pipe(path);
  std::error_code ec;
  if (!device && !fs::is_directory(path, ec)) return;
  throw Error(ExitCode::environment, path.string(),
              device ? "is a device or a pipe" : "is a folder", "a file to write");
}

void write_file(const fs::path& path, std::string_view bytes) {
  if (is_device_or_pipe(path)) {
    Descriptor device(::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
    if (device.get() < 0 || !write_all(device.get(), bytes) || device.close() != 0) {
      throw cannot_write(path, errno);
    }
    return;
  }
  Replacement file(path);
  if (!write_all(file.descriptor(), bytes)) throw cannot_write(path, errno);
  file.to_disk();
  file.put_in_place();
}

fs::path share_dir() {
  const auto has_data = [](const fs::path& p) {
    std::error_code ec;
    return fs::is_directory(p / "data", ec) && fs::is_directory(p / "schemas", ec);
  };
  if (const char* chosen = std::getenv("TPMKIT_SHARE"); chosen != nullptr && *chosen != '\0') {
    if (has_data(chosen)) return chosen;
    throw Error(ExitCode::environment, fmt::format("TPMKIT_SHARE={}", chosen),
                "has no data/ and schemas/", "the folder that tpmkit's data were installed in");
  }
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  if (!ec) {
    fs::path beside = program.parent_path().parent_path() / "share" / "tpmkit";
    if (has_data(beside)) return beside;
  }
  // The shared library or the Python module that this is linked into, which may have been moved:
  // beside it (a wheel), or up to four folders above it (lib/python3/dist-packages/tpmkit).
  Dl_info object{};
  if (dladdr(reinterpret_cast<const void*>(&share_dir), &object) != 0 && object.dli_fname) {
    constexpr int kFoldersUp = 4;
    fs::path folder = fs::weakly_canonical(object.dli_fname, ec).parent_path();
    for (int up = 0; up <= kFoldersUp; ++up, folder = folder.parent_path()) {
      fs::path place = folder / "share" / "tpmkit";
      if (has_data(place)) return place;
    }
  }
  for (const char* place : {TPM_INSTALL_SHARE, TPM_SOURCE_SHARE}) {
    if (has_data(place)) return place;
  }
  throw Error(ExitCode::environment, "tpmkit data", "not found",
              "an installation with share/tpmkit, or TPMKIT_SHARE pointing to one");
}

std::string read_page(std::string_view name) {
  constexpr std::string_view kPlace = "<script src=\"drawing.js\"></script>";
  const fs::path folder = share_dir() / "pages";
  std::string page = read_file(folder / name);
  const std::size_t at = page.find(kPlace);
  if (at == std::string::npos) {
    throw Error(ExitCode::environment, (folder / name).string(), "does not name drawing.js",
                "the page that belongs to this version of tpm");
  }
  return page.replace(at, kPlace.size(),
                      "<script>\n" + read_file(folder / "drawing.js") + "</script>");
}

namespace {

using Digest = std::array<unsigned char, SHA256_DIGEST_LENGTH>;

std::string hexadecimal(const Digest& digest) {
  std::string text;
  for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace

std::string sha256_hex(std::string_view bytes) {
  Digest digest{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return hexadecimal(digest);
}

std::string sha256_of_file(const fs::path& path) {
  const Descriptor in(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> hash(EVP_MD_CTX_new(),
                                                                     &EVP_MD_CTX_free);
  if (in.get() < 0 || !hash || EVP_DigestInit_ex(hash.get(), EVP_sha256(), nullptr) != 1) return {};
  constexpr std::size_t kPart = 1 << 20;
  std::string part(kPart, '\0');
  for (;;) {
    const ssize_t size = ::read(in.get(), part.data(), part.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return {};
    if (size == 0) break;
    EVP_DigestUpdate(hash.get(), part.data(), static_cast<std::size_t>(size));
  }
  Digest digest{};
  return EVP_DigestFinal_ex(hash.get(), digest.data(), nullptr) == 1 ? hexadecimal(digest)
                                                                     : std::string{};
}

}  // namespace tpm::files
