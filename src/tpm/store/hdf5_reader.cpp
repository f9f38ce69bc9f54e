#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include "tpm/core/error.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/hdf5_parts.hpp"

namespace tpm {
namespace fs = std::filesystem;
namespace {

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
  // HDF5 writes as many texts as the file says into the room for one.
  if (H5Sget_simple_extent_npoints(space.get()) != 1) {
    fail(object, fmt::format("attribute '{}' is not a single text", name), "one text");
  }
  BorrowedTexts borrowed(type, space, 1);
  if (H5Aread(opened.get(), type.get(), borrowed.buffer()) < 0) {
    fail(object, fmt::format("attribute '{}' cannot be read", name), "a whole HDF5 file");
  }
  return borrowed.copy().front();
}

}  // namespace tpm
