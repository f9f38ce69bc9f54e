#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

#include "tpm/store/checksum.hpp"
#include "tpm/store/contained.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/hdf5.hpp"
#include "tpm/store/hdf5_assembly.hpp"
#include "tpm/store/packed.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

enum class Part : std::uint8_t {
  file,  ///< only to begin it
  group,
  array,
  texts,
  text_attribute,
  fixed_text_attribute,
  number_attribute,
  scale,
  attached_scale,
  end
};

/// In the child: adds a part to the file.
std::string add_part(Hdf5Assembly& file, std::string_view request) {
  Unpacker in(request, "");
  Part part{};
  std::string name, second, third;
  in.take(part);
  in.take(name);
  switch (part) {
    case Part::file:
      break;
    case Part::group:
      file.group(name);
      break;
    case Part::array: {
      Hdf5Writer::Number kind{};
      std::vector<std::uint64_t> extents;
      in.take(kind);
      in.take(extents);
      return Packer().put(file.array(name, kind, extents)).take();
    }
    case Part::texts: {
      std::vector<std::string> values;
      in.take(values);
      file.texts(name, values);
      break;
    }
    case Part::text_attribute:
    case Part::fixed_text_attribute:
      in.take(second);
      in.take(third);
      if (part == Part::text_attribute) file.attribute(name, second, third);
      if (part == Part::fixed_text_attribute) file.fixed_text_attribute(name, second, third);
      break;
    case Part::number_attribute: {
      std::vector<std::int64_t> values;
      in.take(second);
      in.take(values);
      file.attribute(name, second, values);
      break;
    }
    case Part::scale:
      file.dimension_scale(name);
      break;
    case Part::attached_scale: {
      unsigned dimension = 0;
      in.take(dimension);
      in.take(second);
      file.attach_scale(name, dimension, second);
      break;
    }
    case Part::end:
      return Packer().put(file.close()).take();
  }
  return {};
}

/// The same. HDF5 gets by without some of the memory that it asks for and then writes another file,
/// without a word; the C library keeps note of it.
std::string add_whole_part(Hdf5Assembly& file, std::string_view request) {
  errno = 0;
  std::string reply = add_part(file, request);
  if (errno == ENOMEM) throw std::bad_alloc();
  return reply;
}

Packer request_for(Part part, std::string_view name) {
  Packer request;
  request.put(part).put(name);
  return request;
}

std::uint64_t number_in(std::string_view reply) {
  std::uint64_t number = 0;
  Unpacker(reply, "").take(number);
  return number;
}

}  // namespace

Hdf5Writer::Hdf5Writer(fs::path path) : path_(std::move(path)), place_(path_) {
  ContainedLimits limits;
  limits.writes = true;
  limits.cpu_s = 60.0;  // milliseconds are usual; a library without memory may loop
  child_ = std::make_unique<Contained>(
      path_.string(), place_.descriptor(), limits, [where = path_.string()](int descriptor) {
        auto file = std::make_shared<Hdf5Assembly>(descriptor, where);
        return [file](std::string_view request) { return add_whole_part(*file, request); };
      });
  static_cast<void>(child_->ask(request_for(Part::file, "").take()));
}

Hdf5Writer::~Hdf5Writer() = default;

void Hdf5Writer::reserve(std::uint64_t bytes) {
  const int refused = ::posix_fallocate(place_.descriptor(), 0, static_cast<off_t>(bytes));
  if (refused == 0) return;
  throw Error(ExitCode::environment, path_.string(),
              fmt::format("cannot write {} MB: {}", (bytes >> 20U) + 1, std::strerror(refused)),
              "a folder that can be written and has room; what was computed is kept");
}

void Hdf5Writer::group(const std::string& name) {
  static_cast<void>(child_->ask(request_for(Part::group, name).take()));
}

std::uint64_t Hdf5Writer::arrange(const std::string& name, Number kind,
                                  const std::vector<std::uint64_t>& extents) {
  return number_in(child_->ask(request_for(Part::array, name).put(kind).put(extents).take()));
}

void Hdf5Writer::numbers(const std::string& name, const std::vector<double>& values) {
  write_at(arrange(name, Number::float64, {values.size()}), values.size() * sizeof(double),
           values.data());
}

void Hdf5Writer::table(const std::string& name, const std::vector<double>& values,
                       std::size_t columns) {
  write_at(arrange(name, Number::float64, {values.size() / columns, columns}),
           values.size() * sizeof(double), values.data());
}

void Hdf5Writer::integers(const std::string& name, const std::vector<std::int32_t>& values,
                          std::size_t columns) {
  std::vector<std::uint64_t> extents{values.size() / columns};
  if (columns > 1) extents.push_back(columns);
  write_at(arrange(name, Number::int32, extents), values.size() * sizeof(std::int32_t),
           values.data());
}

void Hdf5Writer::long_integers(const std::string& name, const std::vector<std::int64_t>& values) {
  write_at(arrange(name, Number::int64, {values.size()}), values.size() * sizeof(std::int64_t),
           values.data());
}

void Hdf5Writer::bytes(const std::string& name, const std::vector<std::uint8_t>& values) {
  write_at(arrange(name, Number::uint8, {values.size()}), values.size(), values.data());
}

void Hdf5Writer::texts(const std::string& name, const std::vector<std::string>& values) {
  static_cast<void>(child_->ask(request_for(Part::texts, name).put(values).take()));
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::string& text) {
  static_cast<void>(child_->ask(request_for(Part::text_attribute, object)
                                    .put(std::string_view(name))
                                    .put(std::string_view(text))
                                    .take()));
}

void Hdf5Writer::fixed_text_attribute(const std::string& object, const std::string& name,
                                      const std::string& text) {
  static_cast<void>(child_->ask(request_for(Part::fixed_text_attribute, object)
                                    .put(std::string_view(name))
                                    .put(std::string_view(text))
                                    .take()));
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::vector<std::int64_t>& values) {
  static_cast<void>(child_->ask(
      request_for(Part::number_attribute, object).put(std::string_view(name)).put(values).take()));
}

void Hdf5Writer::array(const std::string& name, Number kind,
                       const std::vector<std::uint64_t>& extents) {
  places_[name] = arrange(name, kind, extents);
}

void Hdf5Writer::write_at(std::uint64_t place, std::size_t size, const void* values) const {
  const char* bytes = static_cast<const char*>(values);
  while (size > 0) {
    const ssize_t n = ::pwrite(place_.descriptor(), bytes, size, static_cast<off_t>(place));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw cannot_write(path_, n < 0 ? errno : ENOSPC);
    bytes += n;
    place += static_cast<std::uint64_t>(n);
    size -= static_cast<std::size_t>(n);
  }
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const double> values) const {
  write_at(places_.at(name) + first * sizeof(double), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int64_t> values) const {
  write_at(places_.at(name) + first * sizeof(std::int64_t), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int32_t> values) const {
  write_at(places_.at(name) + first * sizeof(std::int32_t), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::uint8_t> values) const {
  write_at(places_.at(name) + first, values.size_bytes(), values.data());
}

void Hdf5Writer::dimension_scale(const std::string& name) {
  static_cast<void>(child_->ask(request_for(Part::scale, name).take()));
}

void Hdf5Writer::attach_scale(const std::string& array, unsigned dimension,
                              const std::string& scale) {
  static_cast<void>(child_->ask(
      request_for(Part::attached_scale, array).put(dimension).put(std::string_view(scale)).take()));
}

void Hdf5Writer::commit() {
  const std::uint64_t size = number_in(child_->ask(request_for(Part::end, "").take()));
  if (::ftruncate(place_.descriptor(), static_cast<off_t>(size)) != 0 ||
      !write_checksum(place_.descriptor(), size)) {
    throw cannot_write(path_, errno);
  }
  place_.put_in_place();
}

}  // namespace tpm
