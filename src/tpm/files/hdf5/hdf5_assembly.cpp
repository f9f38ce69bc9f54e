#include "tpm/files/hdf5/hdf5_assembly.hpp"

#include <fmt/format.h>
#include <hdf5_hl.h>

#include <bit>
#include <utility>

#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
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

Hdf5Assembly::Hdf5Assembly(int descriptor, std::string where) : where_(std::move(where)) {
  const QuietErrors quiet;
  storage_.descriptor = descriptor;
  file_ = create_hdf5(storage_);
  require_written(file_.valid(), "cannot write");
}

Hdf5Assembly::~Hdf5Assembly() {
  const QuietErrors quiet;
  file_.reset();
}

/// HDF5 was not told of what went wrong on the disk (hdf5_driver.hpp).
void Hdf5Assembly::require_written(bool done, const std::string& what) const {
  if (storage_.error_number != 0) throw cannot_write(where_, storage_.error_number);
  if (done) return;
  throw Error(ExitCode::environment, where_, what, "a folder that can be written and has room");
}

void Hdf5Assembly::group(const std::string& name) {
  const QuietErrors quiet;
  const Hdf5Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  const Hdf5Handle made(
      H5Gcreate2(file_.get(), name.c_str(), links.get(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  require_written(made.valid(), fmt::format("cannot write group {}", name));
}

Hdf5Handle Hdf5Assembly::dataset(const std::string& name, hid_t type,
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

std::uint64_t Hdf5Assembly::array(const std::string& name, Hdf5Writer::Number kind,
                                  const std::vector<std::uint64_t>& extents) {
  const QuietErrors quiet;
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_alloc_time(creation.get(), H5D_ALLOC_TIME_EARLY);  // it has a place before it is written
  H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
  const Hdf5Handle made = dataset(name, stored_type(kind), extents, creation);
  for (const std::uint64_t extent : extents) {
    if (extent == 0) return 0;  // without numbers it has no place
  }
  const haddr_t place = H5Dget_offset(made.get());
  require_written(place != HADDR_UNDEF, fmt::format("cannot write dataset {}", name));
  return place;
}

void Hdf5Assembly::texts(const std::string& name, const std::vector<std::string>& values) {
  const QuietErrors quiet;
  std::vector<const char*> pointers;
  pointers.reserve(values.size());
  for (const std::string& value : values) pointers.push_back(value.c_str());
  const Hdf5Handle type = text_type();
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const Hdf5Handle set = dataset(name, type.get(), {values.size()}, creation);
  require_written(H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
                           static_cast<const void*>(pointers.data())) >= 0,
                  fmt::format("cannot write dataset {}", name));
}

void Hdf5Assembly::attach(const std::string& object, const std::string& name, hid_t type,
                          const Hdf5Handle& space, const void* values) {
  const Hdf5Handle made(H5Acreate_by_name(file_.get(), object.c_str(), name.c_str(), type,
                                          space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                        H5Aclose);
  require_written(made.valid() && H5Awrite(made.get(), type, values) >= 0,
                  fmt::format("cannot write attribute {} of {}", name, object));
}

void Hdf5Assembly::text_attribute(const std::string& object, const std::string& name,
                                  const std::string& text) {
  const QuietErrors quiet;
  const char* pointer = text.c_str();
  attach(object, name, text_type().get(), {H5Screate(H5S_SCALAR), H5Sclose},
         static_cast<const void*>(&pointer));
}

void Hdf5Assembly::fixed_text_attribute(const std::string& object, const std::string& name,
                                        const std::string& text) {
  const QuietErrors quiet;
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), text.size());
  H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
  attach(object, name, type.get(), {H5Screate(H5S_SCALAR), H5Sclose}, text.data());
}

void Hdf5Assembly::number_attribute(const std::string& object, const std::string& name,
                                    const std::vector<std::int64_t>& values) {
  const QuietErrors quiet;
  const hsize_t size = values.size();
  const Hdf5Handle space(size == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, nullptr),
                         H5Sclose);
  attach(object, name, H5T_NATIVE_INT64, space, values.data());
}

void Hdf5Assembly::real_attribute(const std::string& object, const std::string& name,
                                  double value) {
  const QuietErrors quiet;
  attach(object, name, H5T_NATIVE_DOUBLE, {H5Screate(H5S_SCALAR), H5Sclose}, &value);
}

void Hdf5Assembly::dimension_scale(const std::string& name) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  require_written(H5DSset_scale(set.get(), name.substr(name.rfind('/') + 1).c_str()) >= 0,
                  fmt::format("cannot write the scale {}", name));
}

void Hdf5Assembly::attach_scale(const std::string& array, unsigned dimension,
                                const std::string& scale) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), array.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle along(H5Dopen2(file_.get(), scale.c_str(), H5P_DEFAULT), H5Dclose);
  require_written(H5DSattach_scale(set.get(), along.get(), dimension) >= 0,
                  fmt::format("cannot write the scales of {}", array));
}

std::uint64_t Hdf5Assembly::close() {
  const QuietErrors quiet;
  const bool flushed = H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0;
  file_.reset();
  require_written(flushed, "cannot write");
  return storage_.begin_of_free;
}

}  // namespace tpm::files
