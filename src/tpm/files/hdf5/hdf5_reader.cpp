// Declared in tpm/files/hdf5/hdf5.hpp.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "tpm/files/checksum.hpp"
#include "tpm/files/contained.hpp"
#include "tpm/files/descriptor.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/hdf5/hdf5_contents.hpp"
#include "tpm/files/hdf5/packed.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace fs = std::filesystem;
namespace {

enum class Wish : std::uint8_t {
  nothing,  ///< only to open the file
  has,
  members,
  numbers,
  extents,
  part,
  texts,
  has_attribute,
  attribute,
  number_attribute
};

template <class Result, class... Arguments>
std::string answer_by(Result (Hdf5Contents::*function)(Arguments...) const,
                      const Hdf5Contents& file, Unpacker& request) {
  return answered<Arguments...>(request,
                                [&](const auto&... each) { return (file.*function)(each...); });
}

/// In the child.
std::string answer(const Hdf5Contents& file, std::string_view bytes) {
  Unpacker request(bytes, "");
  Wish wish{};
  request.take(wish);
  switch (wish) {
    case Wish::nothing:
      break;
    case Wish::has:
      return answer_by(&Hdf5Contents::has, file, request);
    case Wish::members:
      return answer_by(&Hdf5Contents::members, file, request);
    case Wish::numbers:
      return answer_by(&Hdf5Contents::real_numbers, file, request);
    case Wish::extents:
      return answer_by(&Hdf5Contents::extents, file, request);
    case Wish::part:
      return answer_by(&Hdf5Contents::part, file, request);
    case Wish::texts:
      return answer_by(&Hdf5Contents::texts, file, request);
    case Wish::has_attribute:
      return answer_by(&Hdf5Contents::has_attribute, file, request);
    case Wish::attribute:
      return answer_by(&Hdf5Contents::attribute, file, request);
    case Wish::number_attribute:
      return answer_by(&Hdf5Contents::number_attribute, file, request);
  }
  return {};
}

constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";

/// The open file. HDF5 says the same of a missing file and of garbage: here they are told apart.
Descriptor opened(const fs::path& path) {
  if (is_device_or_pipe(path)) throw bad_input(path.string(), "is a device or a pipe", "a file");
  std::error_code ec;
  // Not a file, not readable or empty: the reason is read_file's to tell.
  if (!fs::is_regular_file(path, ec) || fs::is_empty(path, ec)) {
    static_cast<void>(read_file(path, 1));
    throw bad_input(path.string(), "cannot be opened for reading", "a readable file");
  }
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) throw cannot_read(path, errno);
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
  const Descriptor file = opened(path_);
  note_reading(path_, file.get());
  require_hdf5(path_, file.get());
  check_sum_ = checksum_of(file.get());
  if (check_sum_ == ChecksumState::broken) {
    throw bad_input(path_.string(), "is damaged: its check sum is another",
                    "the file as it was written");
  }
  child_ = std::make_unique<Contained>(
      path_.string(), file.get(), limits_for(file.get()), [where = path_.string()](int descriptor) {
        auto contents = std::make_shared<Hdf5Contents>(descriptor, where);
        return [contents](std::string_view request) { return answer(*contents, request); };
      });
  static_cast<void>(child_->ask(packed(Wish::nothing)));
}
Hdf5Reader::~Hdf5Reader() = default;
Hdf5Reader::Hdf5Reader(Hdf5Reader&&) noexcept = default;
Hdf5Reader& Hdf5Reader::operator=(Hdf5Reader&&) noexcept = default;

bool Hdf5Reader::has_checksum() const noexcept {
  return check_sum_ == ChecksumState::whole;
}

template <class Result, class... Parts>
Result Hdf5Reader::ask(const Parts&... request) const {
  const std::string reply = child_->ask(packed(request...));
  Result result{};
  Unpacker(reply, path_.native()).take(result);
  return result;
}

bool Hdf5Reader::has(const std::string& name) const {
  return ask<std::uint8_t>(Wish::has, name) != 0;
}

std::vector<std::string> Hdf5Reader::members(const std::string& group) const {
  return ask<std::vector<std::string>>(Wish::members, group);
}

std::vector<double> Hdf5Reader::numbers(const std::string& name) const {
  return ask<std::vector<double>>(Wish::numbers, name, 1);
}

std::vector<double> Hdf5Reader::table(const std::string& name) const {
  return ask<std::vector<double>>(Wish::numbers, name, 2);
}

std::vector<std::uint64_t> Hdf5Reader::extents(const std::string& name) const {
  return ask<std::vector<std::uint64_t>>(Wish::extents, name);
}

std::vector<double> Hdf5Reader::part(const std::string& name,
                                     const std::vector<std::uint64_t>& first,
                                     const std::vector<std::uint64_t>& counts) const {
  return ask<std::vector<double>>(Wish::part, name, first, counts);
}

std::vector<std::string> Hdf5Reader::texts(const std::string& name) const {
  return ask<std::vector<std::string>>(Wish::texts, name);
}

bool Hdf5Reader::has_attribute(const std::string& object, const std::string& name) const {
  return ask<std::uint8_t>(Wish::has_attribute, object, name) != 0;
}

std::string Hdf5Reader::attribute(const std::string& object, const std::string& name) const {
  return ask<std::string>(Wish::attribute, object, name);
}

double Hdf5Reader::number_attribute(const std::string& object, const std::string& name) const {
  return ask<double>(Wish::number_attribute, object, name);
}

}  // namespace tpm::files
