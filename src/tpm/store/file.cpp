#include "tpm/store/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/sha.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "tpm/core/error.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

/// Owns a file descriptor; close() reports what the destructor cannot.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  int close() {
    const int r = ::close(fd_);
    fd_ = -1;
    return r;
  }

 private:
  int fd_;
};

Error cannot_write(const fs::path& path, int error_number) {
  return {ExitCode::environment, path.string(),
          fmt::format("cannot write: {}", std::strerror(error_number)),
          "a folder that can be written and has room"};
}

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

std::string read_file(const fs::path& path) {
  std::error_code ec;
  const auto status = fs::status(path, ec);
  if (!fs::exists(status)) throw bad_input(path.string(), "no such file", "a readable file");
  if (fs::is_directory(status)) throw bad_input(path.string(), "is a folder", "a readable file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw bad_input(path.string(), "cannot be opened for reading", "a readable file");
  std::string bytes;
  // A pipe has no size, and a file may change: whatever comes is read in blocks.
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  bytes.reserve(fs::is_regular_file(status) ? fs::file_size(path, ec) + 1 : kBlock);
  while (in) {
    const std::size_t have = bytes.size();
    bytes.resize(have + kBlock);
    in.read(bytes.data() + have, static_cast<std::streamsize>(kBlock));
    bytes.resize(have + static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) throw bad_input(path.string(), "reading stopped half-way", "a readable file");
  if (bytes.empty()) throw bad_input(path.string(), "the file is empty", "some content");
  return bytes;
}

bool is_device_or_pipe(const fs::path& path) {
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
    Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (device.get() < 0 || !write_all(device.get(), bytes) || device.close() != 0) {
      throw cannot_write(path, errno);
    }
    return;
  }
  std::error_code ec;
  if (path.has_parent_path()) {
    fs::create_directories(path.parent_path(), ec);
    if (ec) throw cannot_write(path.parent_path(), ec.value());
  }
  const std::string temporary = fmt::format("{}.part.{}", path.string(), ::getpid());
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) throw cannot_write(path, errno);
  const bool ok = write_all(file.get(), bytes) && ::fsync(file.get()) == 0 && file.close() == 0 &&
                  ::rename(temporary.c_str(), path.c_str()) == 0;
  if (!ok) {
    const int error_number = errno;
    ::unlink(temporary.c_str());
    throw cannot_write(path, error_number);
  }
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
  for (const char* place : {TPM_INSTALL_SHARE, TPM_SOURCE_SHARE}) {
    if (has_data(place)) return place;
  }
  throw Error(ExitCode::environment, "tpmkit data", "not found",
              "an installation with share/tpmkit, or TPMKIT_SHARE pointing to one");
}

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  std::string text;
  for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace tpm
