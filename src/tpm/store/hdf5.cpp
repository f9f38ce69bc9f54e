#include "tpm/store/hdf5.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <hdf5_hl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <type_traits>
#include <utility>

#include "tpm/core/error.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

static_assert(std::is_same_v<hid_t, Hdf5Handle::Id> && std::is_same_v<herr_t, int>);

/// Keeps HDF5 from printing its error stack while a call is under way; we report errors ourselves.
class QuietErrors {
 public:
  QuietErrors() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~QuietErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

/// A UTF-8 string type of any length.
Hdf5Handle text_type() {
  Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

/// HDF5 reads texts of any length into memory of its own, which has to be given back to it.
class BorrowedTexts {
 public:
  BorrowedTexts(const Hdf5Handle& type, const Hdf5Handle& space, std::size_t size)
      : type_(type), space_(space), pointers_(size, nullptr) {}
  ~BorrowedTexts() {
    H5Dvlen_reclaim(type_.get(), space_.get(), H5P_DEFAULT, static_cast<void*>(pointers_.data()));
  }
  BorrowedTexts(const BorrowedTexts&) = delete;
  BorrowedTexts& operator=(const BorrowedTexts&) = delete;

  [[nodiscard]] void* buffer() { return static_cast<void*>(pointers_.data()); }
  [[nodiscard]] std::vector<std::string> copy() const {
    std::vector<std::string> texts;
    texts.reserve(pointers_.size());
    for (const char* text : pointers_) texts.emplace_back(text == nullptr ? "" : text);
    return texts;
  }

 private:
  const Hdf5Handle& type_;
  const Hdf5Handle& space_;
  std::vector<char*> pointers_;
};

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
    : path_(std::move(path)), temporary_(fmt::format("{}.part.{}", path_.string(), ::getpid())) {
  const QuietErrors quiet;
  std::error_code ec;
  if (path_.has_parent_path()) fs::create_directories(path_.parent_path(), ec);
  file_ = {H5Fcreate(temporary_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose};
  if (!file_.valid()) fail("cannot write");
}

Hdf5Writer::~Hdf5Writer() {
  if (committed_) return;
  const QuietErrors quiet;
  file_.reset();
  std::error_code ec;
  fs::remove(temporary_, ec);
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
  if (!made.valid()) fail(fmt::format("cannot write group {}", name));
}

Hdf5Handle Hdf5Writer::dataset(const std::string& name, hid_t type,
                               const std::vector<std::uint64_t>& extents) {
  const std::vector<hsize_t> shape(extents.begin(), extents.end());
  const Hdf5Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr),
                         H5Sclose);
  const Hdf5Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(links.get(), 1);
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.get(), 0);
  Hdf5Handle made(H5Dcreate2(file_.get(), name.c_str(), type, space.get(), links.get(),
                             creation.get(), H5P_DEFAULT),
                  H5Dclose);
  if (!made.valid()) fail(fmt::format("cannot write dataset {}", name));
  return made;
}

void Hdf5Writer::numbers(const std::string& name, const std::vector<double>& values) {
  const QuietErrors quiet;
  const Hdf5Handle set = dataset(name, H5T_IEEE_F64LE, {values.size()});
  if (H5Dwrite(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::table(const std::string& name, const std::vector<double>& values,
                       std::size_t columns) {
  const QuietErrors quiet;
  const Hdf5Handle set = dataset(name, H5T_IEEE_F64LE, {values.size() / columns, columns});
  if (H5Dwrite(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::integers(const std::string& name, const std::vector<std::int32_t>& values,
                          std::size_t columns) {
  const QuietErrors quiet;
  std::vector<std::uint64_t> extents{values.size() / columns};
  if (columns > 1) extents.push_back(columns);
  const Hdf5Handle set = dataset(name, H5T_STD_I32LE, extents);
  if (H5Dwrite(set.get(), H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::texts(const std::string& name, const std::vector<std::string>& values) {
  const QuietErrors quiet;
  const Hdf5Handle type = text_type();
  const Hdf5Handle set = dataset(name, type.get(), {values.size()});
  std::vector<const char*> pointers;
  pointers.reserve(values.size());
  for (const std::string& value : values) pointers.push_back(value.c_str());
  if (H5Dwrite(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT,
               static_cast<const void*>(pointers.data())) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::long_integers(const std::string& name, const std::vector<std::int64_t>& values) {
  const QuietErrors quiet;
  const Hdf5Handle set = dataset(name, H5T_STD_I64LE, {values.size()});
  if (H5Dwrite(set.get(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::bytes(const std::string& name, const std::vector<std::uint8_t>& values) {
  const QuietErrors quiet;
  const Hdf5Handle set = dataset(name, H5T_STD_U8LE, {values.size()});
  if (H5Dwrite(set.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::attach(const std::string& object, const std::string& name, hid_t type,
                        const Hdf5Handle& space, const void* values) {
  const Hdf5Handle made(H5Acreate_by_name(file_.get(), object.c_str(), name.c_str(), type,
                                          space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                        H5Aclose);
  if (!made.valid() || H5Awrite(made.get(), type, values) < 0) {
    fail(fmt::format("cannot write attribute {} of {}", name, object));
  }
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

namespace {

/// A stretch of an array, counted row by row, put together of boxes: the rest of a row, the rest of
/// a plane, ..., whole ones, and the same backwards.
void select_stretch(hid_t space, const std::vector<hsize_t>& shape, std::uint64_t first,
                    std::uint64_t count) {
  H5Sselect_none(space);
  const std::size_t rank = shape.size();
  std::vector<hsize_t> start(rank), box(rank);
  while (count > 0) {
    std::uint64_t rest = first;
    for (std::size_t d = rank; d-- > 0; rest /= shape[d]) start[d] = rest % shape[d];
    // The first dimension along which more than one can be taken at once.
    std::fill(box.begin(), box.end(), hsize_t{1});
    std::uint64_t inner = 1;  // numbers in one step along dimension d
    std::size_t d = rank - 1;
    while (d > 0 && start[d] == 0 && inner * shape[d] <= count) {
      box[d] = shape[d];
      inner *= shape[d--];
    }
    box[d] = std::min<std::uint64_t>(shape[d] - start[d], count / inner);
    H5Sselect_hyperslab(space, H5S_SELECT_OR, start.data(), nullptr, box.data(), nullptr);
    first += box[d] * inner;
    count -= box[d] * inner;
  }
}

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

std::vector<hsize_t> shape_of(const Hdf5Handle& space) {
  std::vector<hsize_t> shape(
      static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space.get()))));
  H5Sget_simple_extent_dims(space.get(), shape.data(), nullptr);
  return shape;
}

}  // namespace

void Hdf5Writer::array(const std::string& name, Number kind,
                       const std::vector<std::uint64_t>& extents) {
  const QuietErrors quiet;
  static_cast<void>(dataset(name, stored_type(kind), extents));
}

void Hdf5Writer::write_part(const std::string& name, std::uint64_t first, std::uint64_t count,
                            hid_t type, const void* values) {
  if (count == 0) return;
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  select_stretch(space.get(), shape_of(space), first, count);
  const hsize_t size = count;
  const Hdf5Handle memory(H5Screate_simple(1, &size, nullptr), H5Sclose);
  if (H5Dwrite(set.get(), type, memory.get(), space.get(), H5P_DEFAULT, values) < 0) {
    fail(fmt::format("cannot write dataset {}", name));
  }
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const double> values) {
  write_part(name, first, values.size(), H5T_NATIVE_DOUBLE, values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int64_t> values) {
  write_part(name, first, values.size(), H5T_NATIVE_INT64, values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::int32_t> values) {
  write_part(name, first, values.size(), H5T_NATIVE_INT32, values.data());
}

void Hdf5Writer::part(const std::string& name, std::uint64_t first,
                      std::span<const std::uint8_t> values) {
  write_part(name, first, values.size(), H5T_NATIVE_UINT8, values.data());
}

void Hdf5Writer::dimension_scale(const std::string& name) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (H5DSset_scale(set.get(), name.substr(name.rfind('/') + 1).c_str()) < 0) {
    fail(fmt::format("cannot write the scale {}", name));
  }
}

void Hdf5Writer::attach_scale(const std::string& array, unsigned dimension,
                              const std::string& scale) {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), array.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle along(H5Dopen2(file_.get(), scale.c_str(), H5P_DEFAULT), H5Dclose);
  if (H5DSattach_scale(set.get(), along.get(), dimension) < 0) {
    fail(fmt::format("cannot write the scales of {}", array));
  }
}

void Hdf5Writer::commit() {
  const QuietErrors quiet;
  if (H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) < 0) fail("cannot write");
  file_.reset();
  std::error_code ec;
  fs::rename(temporary_, path_, ec);
  if (ec) fail(fmt::format("cannot write: {}", ec.message()));
  committed_ = true;
}

Hdf5Reader::Hdf5Reader(fs::path path) : path_(std::move(path)) {
  const QuietErrors quiet;
  // HDF5 says the same of a missing file and of garbage: tell them apart first.
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::array<char, kSignature.size()> begin{};
  std::ifstream in(path_, std::ios::binary);
  // Not a file, not readable or empty: the reason is read_file's to tell.
  std::error_code ec;
  if (!in || !fs::is_regular_file(path_, ec) || fs::is_empty(path_, ec)) {
    static_cast<void>(read_file(path_));
  }
  in.read(begin.data(), begin.size());
  if (!std::equal(begin.begin(), begin.end(), kSignature.begin())) {
    throw bad_input(path_.string(), "is not an HDF5 file", "an HDF5 file that tpm wrote");
  }
  file_ = {H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
  if (!file_.valid()) {
    throw bad_input(path_.string(), "begins like HDF5 but is damaged or cut short",
                    "a whole HDF5 file");
  }
}

void Hdf5Reader::fail(const std::string& object, const std::string& what,
                      std::string_view expected) const {
  throw bad_input(path_.string(), fmt::format("{}: {}", object, what), expected);
}

bool Hdf5Reader::has(const std::string& name) const {
  const QuietErrors quiet;
  return H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::string> Hdf5Reader::members(const std::string& group) const {
  const QuietErrors quiet;
  const Hdf5Handle opened(H5Gopen2(file_.get(), group.c_str(), H5P_DEFAULT), H5Gclose);
  if (!opened.valid()) fail(group, "no such group", "an HDF5 file that tpm wrote");
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return 0;
  };
  if (H5Literate(opened.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0) {
    fail(group, "cannot be listed", "a whole HDF5 file");
  }
  return names;
}

Hdf5Handle Hdf5Reader::open_dataset(const std::string& name, bool as_text, int dimensions,
                                    std::size_t& size) const {
  Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(name, "no such dataset", "an HDF5 file that tpm wrote");
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  const bool right = H5Tget_class(type.get()) == (as_text ? H5T_STRING : H5T_FLOAT) &&
                     H5Sget_simple_extent_ndims(space.get()) == dimensions &&
                     (!as_text || H5Tis_variable_str(type.get()) > 0);
  if (!right) {
    fail(name, "is of another type",
         as_text           ? "a list of texts"
         : dimensions == 1 ? "a list of floating-point numbers"
                           : "a table of floating-point numbers");
  }
  size = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
  // A damaged extent must not become an allocation of that size.
  if (size > fs::file_size(path_))
    fail(name, "says it is larger than the file", "a whole HDF5 file");
  return set;
}

std::vector<double> Hdf5Reader::numbers(const std::string& name) const {
  return real_numbers(name, 1);
}

std::vector<double> Hdf5Reader::table(const std::string& name) const {
  return real_numbers(name, 2);
}

std::vector<double> Hdf5Reader::real_numbers(const std::string& name, int dimensions) const {
  const QuietErrors quiet;
  std::size_t size = 0;
  const Hdf5Handle set = open_dataset(name, false, dimensions, size);
  std::vector<double> values(size);
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(name, "cannot be read", "a whole HDF5 file");
  }
  return values;
}

std::vector<std::uint64_t> Hdf5Reader::extents(const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(name, "no such dataset", "an HDF5 file that tpm wrote");
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_FLOAT && kind != H5T_INTEGER) fail(name, "is of another type", "numbers");
  const auto shape = shape_of({H5Dget_space(set.get()), H5Sclose});
  return {shape.begin(), shape.end()};
}

std::vector<double> Hdf5Reader::part(const std::string& name,
                                     const std::vector<std::uint64_t>& first,
                                     const std::vector<std::uint64_t>& counts) const {
  const auto extents_now = extents(name);
  bool inside = first.size() == extents_now.size() && counts.size() == extents_now.size();
  std::uint64_t size = 1;
  for (std::size_t d = 0; inside && d < counts.size(); ++d) {
    inside = first[d] <= extents_now[d] && counts[d] <= extents_now[d] - first[d];
    size *= counts[d];
  }
  if (!inside) fail(name, "is smaller than was asked for", "a whole HDF5 file");
  if (size > fs::file_size(path_))
    fail(name, "says it is larger than the file", "a whole HDF5 file");
  const QuietErrors quiet;
  const Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  const std::vector<hsize_t> start(first.begin(), first.end()), box(counts.begin(), counts.end());
  H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, box.data(), nullptr);
  const hsize_t count = size;
  const Hdf5Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
  std::vector<double> values(size);
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, values.data()) <
      0) {
    fail(name, "cannot be read", "a whole HDF5 file");
  }
  return values;
}

std::vector<std::string> Hdf5Reader::texts(const std::string& name) const {
  const QuietErrors quiet;
  std::size_t size = 0;
  const Hdf5Handle set = open_dataset(name, true, 1, size);
  const Hdf5Handle type = text_type();
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  BorrowedTexts borrowed(type, space, size);
  if (H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, borrowed.buffer()) < 0) {
    fail(name, "cannot be read", "a whole HDF5 file");
  }
  return borrowed.copy();
}

bool Hdf5Reader::has_attribute(const std::string& object, const std::string& name) const {
  const QuietErrors quiet;
  return H5Aexists_by_name(file_.get(), object.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

std::string Hdf5Reader::attribute(const std::string& object, const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle opened(
      H5Aopen_by_name(file_.get(), object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (!opened.valid()) {
    fail(object, fmt::format("no attribute '{}'", name), "an HDF5 file that tpm wrote");
  }
  const Hdf5Handle stored(H5Aget_type(opened.get()), H5Tclose);
  if (H5Tis_variable_str(stored.get()) <= 0) {
    fail(object, fmt::format("attribute '{}' is of another type", name), "a text");
  }
  const Hdf5Handle type = text_type();
  const Hdf5Handle space(H5Aget_space(opened.get()), H5Sclose);
  BorrowedTexts borrowed(type, space, 1);
  if (H5Aread(opened.get(), type.get(), borrowed.buffer()) < 0) {
    fail(object, fmt::format("attribute '{}' cannot be read", name), "a whole HDF5 file");
  }
  return borrowed.copy().front();
}

}  // namespace tpm
