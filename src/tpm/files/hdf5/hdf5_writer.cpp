// Declared in tpm/files/hdf5/hdf5.hpp.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <new>
#include <utility>

#include "tpm/files/checksum.hpp"
#include "tpm/files/contained.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/hdf5/hdf5_assembly.hpp"
#include "tpm/files/hdf5/packed.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
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
  real_attribute,
  scale,
  attached_scale,
  end
};

template <class Result, class... Arguments>
std::string add_by(Result (Hdf5Assembly::*function)(Arguments...), Hdf5Assembly& file,
                   Unpacker& request) {
  return answered<Arguments...>(request,
                                [&](const auto&... each) { return (file.*function)(each...); });
}

/// In the child: adds a part to the file.
std::string add_part(Hdf5Assembly& file, std::string_view bytes) {
  Unpacker request(bytes, "");
  Part part{};
  request.take(part);
  switch (part) {
    case Part::file:
      break;
    case Part::group:
      return add_by(&Hdf5Assembly::group, file, request);
    case Part::array:
      return add_by(&Hdf5Assembly::array, file, request);
    case Part::texts:
      return add_by(&Hdf5Assembly::texts, file, request);
    case Part::text_attribute:
      return add_by(&Hdf5Assembly::text_attribute, file, request);
    case Part::fixed_text_attribute:
      return add_by(&Hdf5Assembly::fixed_text_attribute, file, request);
    case Part::number_attribute:
      return add_by(&Hdf5Assembly::number_attribute, file, request);
    case Part::real_attribute:
      return add_by(&Hdf5Assembly::real_attribute, file, request);
    case Part::scale:
      return add_by(&Hdf5Assembly::dimension_scale, file, request);
    case Part::attached_scale:
      return add_by(&Hdf5Assembly::attach_scale, file, request);
    case Part::end:
      return add_by(&Hdf5Assembly::close, file, request);
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

constexpr std::size_t kKept = std::size_t{1} << 16U;  // bytes of an array that may wait

template <class... Parts>
void order(Contained& child, const Parts&... request) {
  child.tell(packed(request...));
}

std::uint64_t number_in(std::string_view answer) {
  std::uint64_t number = 0;
  Unpacker(answer, "").take(number);
  return number;
}

template <class... Parts>
std::uint64_t number_from(Contained& child, const Parts&... request) {
  return number_in(child.ask(packed(request...)));
}

/// Has an array made and calls write(place, values) when it is known where, short arrays later.
template <class Number, class T, class Write>
void write_array(Contained& child, const std::string& name, Number kind,
                 const std::vector<std::uint64_t>& extents, const std::vector<T>& values,
                 const Write& write) {
  const std::string request = packed(Part::array, name, kind, extents);
  if (values.size() * sizeof(T) > kKept) {
    write(number_in(child.ask(request)), std::as_bytes(std::span(values)));
    return;
  }
  child.tell(request, [values, write](std::string_view answer) {
    write(number_in(answer), std::as_bytes(std::span(values)));
  });
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
  static_cast<void>(child_->ask(packed(Part::file)));  // says at once if it cannot be begun
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
  order(*child_, Part::group, name);
}

std::uint64_t Hdf5Writer::arrange(const std::string& name, Number kind,
                                  const std::vector<std::uint64_t>& extents) {
  return number_from(*child_, Part::array, name, kind, extents);
}

void Hdf5Writer::numbers(const std::string& name, const std::vector<double>& values) {
  write_array(*child_, name, Number::float64, {values.size()}, values,
              std::bind_front(&Hdf5Writer::write_at, this));
}

void Hdf5Writer::table(const std::string& name, const std::vector<double>& values,
                       std::size_t columns) {
  write_array(*child_, name, Number::float64, {values.size() / columns, columns}, values,
              std::bind_front(&Hdf5Writer::write_at, this));
}

void Hdf5Writer::integers(const std::string& name, const std::vector<std::int32_t>& values,
                          std::size_t columns) {
  std::vector<std::uint64_t> extents{values.size() / columns};
  if (columns > 1) extents.push_back(columns);
  write_array(*child_, name, Number::int32, extents, values,
              std::bind_front(&Hdf5Writer::write_at, this));
}

void Hdf5Writer::long_integers(const std::string& name, const std::vector<std::int64_t>& values) {
  write_array(*child_, name, Number::int64, {values.size()}, values,
              std::bind_front(&Hdf5Writer::write_at, this));
}

void Hdf5Writer::bytes(const std::string& name, const std::vector<std::uint8_t>& values) {
  write_array(*child_, name, Number::uint8, {values.size()}, values,
              std::bind_front(&Hdf5Writer::write_at, this));
}

void Hdf5Writer::texts(const std::string& name, const std::vector<std::string>& values) {
  order(*child_, Part::texts, name, values);
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::string& text) {
  order(*child_, Part::text_attribute, object, name, text);
}

void Hdf5Writer::fixed_text_attribute(const std::string& object, const std::string& name,
                                      const std::string& text) {
  order(*child_, Part::fixed_text_attribute, object, name, text);
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::vector<std::int64_t>& values) {
  order(*child_, Part::number_attribute, object, name, values);
}

void Hdf5Writer::real_attribute(const std::string& object, const std::string& name, double value) {
  order(*child_, Part::real_attribute, object, name, value);
}

void Hdf5Writer::array(const std::string& name, Number kind,
                       const std::vector<std::uint64_t>& extents) {
  places_[name] = arrange(name, kind, extents);
}

void Hdf5Writer::write_at(std::uint64_t place, std::span<const std::byte> values) const {
  const std::size_t done = pwrite_all(place_.descriptor(), values.data(), values.size(), place);
  if (done < values.size()) throw cannot_write(path_, errno);
}

void Hdf5Writer::dimension_scale(const std::string& name) {
  order(*child_, Part::scale, name);
}

void Hdf5Writer::attach_scale(const std::string& array, unsigned dimension,
                              const std::string& scale) {
  order(*child_, Part::attached_scale, array, dimension, scale);
}

void Hdf5Writer::commit() {
  const std::uint64_t size = number_from(*child_, Part::end);
  if (::ftruncate(place_.descriptor(), static_cast<off_t>(size)) != 0 ||
      !write_checksum(place_.descriptor(), size)) {
    throw cannot_write(path_, errno);
  }
  place_.put_in_place();
}

}  // namespace tpm::files
