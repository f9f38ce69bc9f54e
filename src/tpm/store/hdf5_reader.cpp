#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "tpm/store/checksum.hpp"
#include "tpm/store/contained.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/file_roles.hpp"
#include "tpm/store/hdf5.hpp"
#include "tpm/store/hdf5_contents.hpp"
#include "tpm/store/packed.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

enum class Wish : std::uint8_t {
  nothing,  ///< only to open the file
  has,
  members,
  numbers,
  table,
  extents,
  part,
  texts,
  has_attribute,
  attribute
};

/// In the child.
std::string answer(const Hdf5Contents& file, std::string_view request) {
  Unpacker in(request, "");
  Wish wish{};
  std::string name, second;
  in.take(wish);
  in.take(name);
  Packer out;
  switch (wish) {
    case Wish::nothing:
      break;
    case Wish::has:
      return out.put(static_cast<std::uint8_t>(file.has(name))).take();
    case Wish::members:
      return out.put(file.members(name)).take();
    case Wish::numbers:
      return out.put(file.real_numbers(name, 1)).take();
    case Wish::table:
      return out.put(file.real_numbers(name, 2)).take();
    case Wish::extents:
      return out.put(file.extents(name)).take();
    case Wish::part: {
      std::vector<std::uint64_t> first, counts;
      in.take(first);
      in.take(counts);
      return out.put(file.part(name, first, counts)).take();
    }
    case Wish::texts:
      return out.put(file.texts(name)).take();
    case Wish::has_attribute:
      in.take(second);
      return out.put(static_cast<std::uint8_t>(file.has_attribute(name, second))).take();
    case Wish::attribute:
      in.take(second);
      return out.put(std::string_view(file.attribute(name, second))).take();
  }
  return {};
}

constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";

/// The open file. HDF5 says the same of a missing file and of garbage: here they are told apart.
int opened(const fs::path& path) {
  if (is_device_or_pipe(path)) throw bad_input(path.string(), "is a device or a pipe", "a file");
  std::error_code ec;
  // Not a file, not readable or empty: the reason is read_file's to tell.
  if (!fs::is_regular_file(path, ec) || fs::is_empty(path, ec)) {
    static_cast<void>(read_file(path, 1));
    throw bad_input(path.string(), "cannot be opened for reading", "a readable file");
  }
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) {
    throw cannot_read(path, errno);
  }
  return file;
}

void require_hdf5(const fs::path& path, int file) {
  std::array<char, kSignature.size()> begin{};
  const ssize_t n = ::pread(file, begin.data(), begin.size(), 0);
  if (n != static_cast<ssize_t>(begin.size()) ||
      !std::equal(begin.begin(), begin.end(), kSignature.begin())) {
    throw bad_input(path.string(), "is not an HDF5 file", "an HDF5 file that tpm wrote");
  }
}

ContainedLimits limits_for(int file) {
  struct stat found {};
  const std::uint64_t size =
      ::fstat(file, &found) == 0 ? static_cast<std::uint64_t>(found.st_size) : 0;
  // A list may have as many numbers as the file has bytes (compressed ones do), and is packed once.
  constexpr std::uint64_t kBytesForByte = 32;
  ContainedLimits limits;
  limits.memory_bytes += kBytesForByte * size;
  limits.answer_bytes += kBytesForByte * size;
  return limits;
}

}  // namespace

Hdf5Reader::Hdf5Reader(fs::path path) : path_(std::move(path)) {
  const int file = opened(path_);
  try {
    note_reading(path_, file);
    require_hdf5(path_, file);
    check_sum_ = checksum_of(file);
    if (check_sum_ == ChecksumState::broken) {
      throw bad_input(path_.string(), "is damaged: its check sum is another",
                      "the file as it was written");
    }
    child_ = std::make_unique<Contained>(
        path_.string(), file, limits_for(file), [where = path_.string()](int descriptor) {
          auto contents = std::make_shared<Hdf5Contents>(descriptor, where);
          return [contents](std::string_view request) { return answer(*contents, request); };
        });
    static_cast<void>(child_->ask(Packer().put(Wish::nothing).put(std::string_view()).take()));
  } catch (...) {
    ::close(file);
    throw;
  }
  ::close(file);
}

Hdf5Reader::~Hdf5Reader() = default;
Hdf5Reader::Hdf5Reader(Hdf5Reader&&) noexcept = default;
Hdf5Reader& Hdf5Reader::operator=(Hdf5Reader&&) noexcept = default;

bool Hdf5Reader::has_checksum() const noexcept {
  return check_sum_ == ChecksumState::whole;
}

template <class Result>
Result Hdf5Reader::ask(const std::string& request) const {
  const std::string reply = child_->ask(request);
  Result result{};
  Unpacker(reply, path_.native()).take(result);
  return result;
}

bool Hdf5Reader::has(const std::string& name) const {
  return ask<std::uint8_t>(Packer().put(Wish::has).put(std::string_view(name)).take()) != 0;
}

std::vector<std::string> Hdf5Reader::members(const std::string& group) const {
  return ask<std::vector<std::string>>(
      Packer().put(Wish::members).put(std::string_view(group)).take());
}

std::vector<double> Hdf5Reader::numbers(const std::string& name) const {
  return ask<std::vector<double>>(Packer().put(Wish::numbers).put(std::string_view(name)).take());
}

std::vector<double> Hdf5Reader::table(const std::string& name) const {
  return ask<std::vector<double>>(Packer().put(Wish::table).put(std::string_view(name)).take());
}

std::vector<std::uint64_t> Hdf5Reader::extents(const std::string& name) const {
  return ask<std::vector<std::uint64_t>>(
      Packer().put(Wish::extents).put(std::string_view(name)).take());
}

std::vector<double> Hdf5Reader::part(const std::string& name,
                                     const std::vector<std::uint64_t>& first,
                                     const std::vector<std::uint64_t>& counts) const {
  return ask<std::vector<double>>(
      Packer().put(Wish::part).put(std::string_view(name)).put(first).put(counts).take());
}

std::vector<std::string> Hdf5Reader::texts(const std::string& name) const {
  return ask<std::vector<std::string>>(
      Packer().put(Wish::texts).put(std::string_view(name)).take());
}

bool Hdf5Reader::has_attribute(const std::string& object, const std::string& name) const {
  return ask<std::uint8_t>(Packer()
                               .put(Wish::has_attribute)
                               .put(std::string_view(object))
                               .put(std::string_view(name))
                               .take()) != 0;
}

std::string Hdf5Reader::attribute(const std::string& object, const std::string& name) const {
  return ask<std::string>(Packer()
                              .put(Wish::attribute)
                              .put(std::string_view(object))
                              .put(std::string_view(name))
                              .take());
}

}  // namespace tpm
