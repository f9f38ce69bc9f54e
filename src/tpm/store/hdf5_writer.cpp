#include <fcntl.h>
#include <fmt/format.h>
#include <hdf5_hl.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "tpm/core/error.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/hdf5_driver.hpp"
#include "tpm/store/hdf5_parts.hpp"
#include "tpm/store/seal.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little, "arrays hold little-endian numbers");

hid_t stored_type(Hdf5Writer::Number kind) {
  switch (kind) {
    case Hdf5Writer::Number::float64:
      break;
    case Hdf5Writer::Number::int64:
      return H5T_STD_I64LE;
    case Hdf5Writer::Number::int32:
      return H5T_STD_I32LE;
    case Hdf5Writer::Number::uint8:
      return H5T_STD_U8LE;
  }
  return H5T_IEEE_F64LE;
}

}  // namespace

Hdf5Handle::Hdf5Handle(Hdf5Handle&& other) noexcept
    : id_(std::exchange(other.id_, -1)), closer_(other.closer_) {}

Hdf5Handle& Hdf5Handle::operator=(Hdf5Handle&& other) noexcept {
  if (this != &other) {
    reset();
    id_ = std::exchange(other.id_, -1);
    closer_ = other.closer_;
  }
  return *this;
}

void Hdf5Handle::reset() noexcept {
  if (valid() && closer_ != nullptr) closer_(id_);
  id_ = -1;
}

Hdf5Writer::Hdf5Writer(fs::path path)
    : path_(std::move(path)), storage_(std::make_unique<Hdf5Storage>()), place_(path_) {
  const QuietErrors quiet;
  storage_->descriptor = place_.descriptor();
  file_ = create_hdf5(*storage_);
  require_written(file_.valid(), "cannot write");
}

Hdf5Writer::~Hdf5Writer() {
  const QuietErrors quiet;
  file_.reset();
}

void Hdf5Writer::reserve(std::uint64_t bytes) {
  const int refused = ::posix_fallocate(place_.descriptor(), 0, static_cast<off_t>(bytes));
  if (refused == 0) return;
  throw Error(ExitCode::environment, path_.string(),
              fmt::format("cannot write {} MB: {}", (bytes >> 20U) + 1, std::strerror(refused)),
              "a folder that can be written and has room; what was computed is kept");
}

/// HDF5 was not told of what went wrong on the disk (hdf5_driver.hpp).
void Hdf5Writer::require_written(bool done, const std::string& what) const {
  if (storage_->error_number != 0) throw cannot_write(path_, storage_->error_number);
  if (!done) fail(what);
}

void Hdf5Writer::fail(const std::string& what) const {
  throw Error(ExitCode::environment, path_.string(), what,
              "a folder that can be written and has room");
}

void Hdf5Writer::group(const std::string& name) {
  const QuietErrors quiet;
  const Hdf5Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  const Hdf5Handle made(
      H5Gcreate2(file_.get(), name.c_str(), links.get(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  require_written(made.valid(), fmt::format("cannot write group {}", name));
}

Hdf5Handle Hdf5Writer::dataset(const std::string& name, hid_t type,
                               const std::vector<std::uint64_t>& extents,
                               const Hdf5Handle& creation) {
  const std::vector<hsize_t> shape(extents.begin(), extents.end());
  const Hdf5Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
                         H5Sclose);
  const Hdf5Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  H5Pset_obj_track_times(creation.get(), 0);
  Hdf5Handle made(H5Dcreate2(file_.get(), name.c_str(), type, space.get(), links.get(),
                             creation.get(), H5P_DEFAULT),
                  H5Dclose);
  require_written(made.valid(), fmt::format("cannot write dataset {}", name));
  return made;
}

void Hdf5Writer::write_whole(const std::string& name, Hdf5Handle::Id stored,
                             const std::vector<std::uint64_t>& extents, Hdf5Handle::Id type,
                             const void* values) {
  const QuietErrors quiet;
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const Hdf5Handle set = dataset(name, stored, extents, creation);
  require_written(H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0,
                  fmt::format("cannot write dataset {}", name));
}

void Hdf5Writer::numbers(const std::string& name, const std::vector<double>& values) {
  write_whole(name, H5T_IEEE_F64LE, {values.size()}, H5T_NATIVE_DOUBLE, values.data());
}

void Hdf5Writer::table(const std::string& name, const std::vector<double>& values,
                       std::size_t columns) {
  write_whole(name, H5T_IEEE_F64LE, {values.size() / columns, columns}, H5T_NATIVE_DOUBLE,
              values.data());
}

void Hdf5Writer::integers(const std::string& name, const std::vector<std::int32_t>& values,
                          std::size_t columns) {
  std::vector<std::uint64_t> extents{values.size() / columns};
  if (columns > 1) extents.push_back(columns);
  write_whole(name, H5T_STD_I32LE, extents, H5T_NATIVE_INT32, values.data());
}

void Hdf5Writer::long_integers(const std::string& name, const std::vector<std::int64_t>& values) {
  write_whole(name, H5T_STD_I64LE, {values.size()}, H5T_NATIVE_INT64, values.data());
}

void Hdf5Writer::bytes(const std::string& name, const std::vector<std::uint8_t>& values) {
  write_whole(name, H5T_STD_U8LE, {values.size()}, H5T_NATIVE_UINT8, values.data());
}

void Hdf5Writer::texts(const std::string& name, const std::vector<std::string>& values) {
  std::vector<const char*> pointers;
  pointers.reserve(values.size());
  for (const std::string& value : values) pointers.push_back(value.c_str());
  const Hdf5Handle type = text_type();
  write_whole(name, type.get(), {values.size()}, type.get(),
              static_cast<const void*>(pointers.data()));
}

void Hdf5Writer::attach(const std::string& object, const std::string& name, hid_t type,
                        const Hdf5Handle& space, const void* values) {
  const Hdf5Handle made(H5Acreate_by_name(file_.get(), object.c_str(), name.c_str(), type,
                                          space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                        H5Aclose);
  require_written(made.valid() && H5Awrite(made.get(), type, values) >= 0,
                  fmt::format("cannot write attribute {} of {}", name, object));
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::string& text) {
  const QuietErrors quiet;
  const char* pointer = text.c_str();
  attach(object, name, text_type().get(), {H5Screate(H5S_SCALAR), H5Sclose},
         static_cast<const void*>(&pointer));
}

void Hdf5Writer::fixed_text_attribute(const std::string& object, const std::string& name,
                                      const std::string& text) {
  const QuietErrors quiet;
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), text.size());
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  attach(object, name, type.get(), {H5Screate(H5S_SCALAR), H5Sclose}, text.data());
}

void Hdf5Writer::attribute(const std::string& object, const std::string& name,
                           const std::vector<std::int64_t>& values) {
  const QuietErrors quiet;
  const hsize_t size = values.size();
  const Hdf5Handle space(size == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, nullptr),
                         H5Sclose);
  attach(object, name, H5T_NATIVE_INT64, space, values.data());
}

void Hdf5Writer::array(const std::string& name, Number kind,
                       const std::vector<std::uint64_t>& extents) {
  const QuietErrors quiet;
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_alloc_time(creation.get(), H5D_ALLOC_TIME_EARLY);  // it has a place before it is written
  H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
  const Hdf5Handle made = dataset(name, stored_type(kind), extents, creation);
  const haddr_t place = H5Dget_offset(made.get());
  require_written(place != HADDR_UNDEF, fmt::format("cannot write dataset {}", name));
  places_[name] = place;
}

void Hdf5Writer::write_part(const std::string& name, std::uint64_t place, std::size_t size,
                            const void* values) const {
  const char* bytes = static_cast<const char*>(values);
  place += places_.at(name);
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
  write_part(name, first * sizeof(double), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int64_t> values) const {
  write_part(name, first * sizeof(std::int64_t), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int32_t> values) const {
  write_part(name, first * sizeof(std::int32_t), values.size_bytes(), values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::uint8_t> values) const {
  write_part(name, first, values.size_bytes(), values.data());
}

void Hdf5Writer::dimension_scale(const std::string& name) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  require_written(H5DSset_scale(set.get(), name.substr(name.rfind('/') + 1).c_str()) >= 0,
                  fmt::format("cannot write the scale {}", name));
}

void Hdf5Writer::attach_scale(const std::string& array, unsigned dimension,
                              const std::string& scale) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), array.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle along(H5Dopen2(file_.get(), scale.c_str(), H5P_DEFAULT), H5Dclose);
  require_written(H5DSattach_scale(set.get(), along.get(), dimension) >= 0,
                  fmt::format("cannot write the scales of {}", array));
}

void Hdf5Writer::commit() {
  const QuietErrors quiet;
  const bool flushed = H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0;
  file_.reset();
  require_written(flushed, "cannot write");
  const std::uint64_t size = storage_->begin_of_free;
  if (::ftruncate(place_.descriptor(), static_cast<off_t>(size)) != 0 ||
      !seal(place_.descriptor(), size)) {
    throw cannot_write(path_, errno);
  }
  place_.put_in_place();
}

}  // namespace tpm
