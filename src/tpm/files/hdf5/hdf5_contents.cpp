#include "tpm/files/hdf5/hdf5_contents.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <utility>

#include "tpm/files/hdf5/hdf5_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr std::string_view kWholeFile = "a whole HDF5 file";
constexpr std::string_view kOfTpm = "an HDF5 file that tpm wrote";

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

/// "float" numbers that a conversion to double keeps: 2, 4 or 8 bytes.
bool is_plain_number(const Hdf5Handle& type) {
  const H5T_class_t kind = H5Tget_class(type.get());
  constexpr std::size_t kWidest = 8;
  return (kind == H5T_FLOAT || kind == H5T_INTEGER) && H5Tget_size(type.get()) <= kWidest;
}

bool is_text_of_any_length(const Hdf5Handle& type) {
  return H5Tget_class(type.get()) == H5T_STRING && H5Tis_variable_str(type.get()) > 0;
}

}  // namespace

Hdf5Contents::Hdf5Contents(int descriptor, std::string where)
    : where_(std::move(where)), storage_(std::make_unique<Hdf5Storage>()) {
  const QuietErrors quiet;
  H5PLset_loading_state(0);  // no code is loaded because a file asks for it
  struct stat found {};
  if (::fstat(descriptor, &found) == 0) file_size_ = static_cast<std::uint64_t>(found.st_size);
  storage_->descriptor = descriptor;
  file_ = open_hdf5(*storage_);
  if (!file_.valid()) {
    throw bad_input(where_, "begins like HDF5 but is damaged or cut short", kWholeFile);
  }
}

void Hdf5Contents::fail(const std::string& object, const std::string& what,
                        std::string_view expected) const {
  throw bad_input(where_, fmt::format("{}: {}", object, what), expected);
}

/// Every link on the way to an object has to stay in the file.
void Hdf5Contents::require_inside(const std::string& name, std::string_view missing) const {
  for (std::size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    const std::string part = name.substr(0, end);
    if (part.empty() || part == "/") continue;
    H5L_info_t link{};
    if (H5Lget_info(file_.get(), part.c_str(), &link, H5P_DEFAULT) < 0) {
      fail(name, std::string(missing), kOfTpm);
    }
    if (link.type != H5L_TYPE_HARD && link.type != H5L_TYPE_SOFT) {
      fail(part, "is a link to another file", "a file that holds its own content");
    }
  }
}

bool Hdf5Contents::has(const std::string& name) const {
  const QuietErrors quiet;
  return H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::string> Hdf5Contents::members(const std::string& group) const {
  const QuietErrors quiet;
  require_inside(group, "no such group");
  const Hdf5Handle opened(H5Gopen2(file_.get(), group.c_str(), H5P_DEFAULT), H5Gclose);
  if (!opened.valid()) fail(group, "no such group", kOfTpm);
  std::vector<std::string> names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->emplace_back(name);
    return 0;
  };
  if (H5Literate(opened.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names) < 0) {
    fail(group, "cannot be listed", kWholeFile);
  }
  return names;
}

Hdf5Handle Hdf5Contents::open_dataset(const std::string& name) const {
  require_inside(name, "no such dataset");
  Hdf5Handle set(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!set.valid()) fail(name, "no such dataset", kOfTpm);
  require_kept_inside(name, set);
  return set;
}

void Hdf5Contents::require_kept_inside(const std::string& name, const Hdf5Handle& set) const {
  const Hdf5Handle creation(H5Dget_create_plist(set.get()), H5Pclose);
  if (!creation.valid()) fail(name, "cannot be read", kWholeFile);
  const H5D_layout_t layout = H5Pget_layout(creation.get());
  if (layout == H5D_VIRTUAL || H5Pget_external_count(creation.get()) != 0) {
    fail(name, "keeps its numbers in another file", "a file that holds its own content");
  }
  if (layout != H5D_COMPACT && layout != H5D_CONTIGUOUS && layout != H5D_CHUNKED) {
    fail(name, "cannot be read", kWholeFile);
  }
}

/// A damaged extent must not become an allocation of that size.
std::size_t Hdf5Contents::size_of(const std::string& name, const Hdf5Handle& space, int dimensions,
                                  std::string_view expected) const {
  if (H5Sget_simple_extent_type(space.get()) != H5S_SIMPLE ||
      H5Sget_simple_extent_ndims(space.get()) != dimensions) {
    fail(name, "is of another type", expected);
  }
  std::uint64_t size = 1;
  for (const hsize_t extent : shape_of(space)) {
    if (extent > file_size_ || (extent > 0 && size > file_size_ / extent)) {
      fail(name, "says it is larger than the file", kWholeFile);
    }
    size *= extent;
  }
  return static_cast<std::size_t>(size);
}

std::vector<double> Hdf5Contents::real_numbers(const std::string& name, int dimensions) const {
  const QuietErrors quiet;
  const std::string_view expected =
      dimensions == 1 ? "a list of floating-point numbers" : "a table of floating-point numbers";
  const Hdf5Handle set = open_dataset(name);
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  if (!is_plain_number(type) || H5Tget_class(type.get()) != H5T_FLOAT) {
    fail(name, "is of another type", expected);
  }
  std::vector<double> values(size_of(name, space, dimensions, expected));
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    fail(name, "cannot be read", kWholeFile);
  }
  return values;
}

std::vector<std::uint64_t> Hdf5Contents::extents(const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle set = open_dataset(name);
  const Hdf5Handle type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  if (!is_plain_number(type)) fail(name, "is of another type", "numbers");
  const auto shape = shape_of(space);
  return {shape.begin(), shape.end()};
}

std::vector<double> Hdf5Contents::part(const std::string& name,
                                       const std::vector<std::uint64_t>& first,
                                       const std::vector<std::uint64_t>& counts) const {
  const auto extents_now = extents(name);
  bool inside = first.size() == extents_now.size() && counts.size() == extents_now.size();
  std::uint64_t size = 1;
  for (std::size_t d = 0; inside && d < counts.size(); ++d) {
    inside = first[d] <= extents_now[d] && counts[d] <= extents_now[d] - first[d];
    if (counts[d] > 0 && size > file_size_ / counts[d]) {
      fail(name, "says it is larger than the file", kWholeFile);
    }
    size *= counts[d];
  }
  if (!inside) fail(name, "is smaller than was asked for", kWholeFile);
  const QuietErrors quiet;
  const Hdf5Handle set = open_dataset(name);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  const std::vector<hsize_t> start(first.begin(), first.end()), box(counts.begin(), counts.end());
  H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, box.data(), nullptr);
  const hsize_t count = size;
  const Hdf5Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose);
  std::vector<double> values(size);
  if (H5Dread(set.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT, values.data()) <
      0) {
    fail(name, "cannot be read", kWholeFile);
  }
  return values;
}

std::vector<std::string> Hdf5Contents::texts(const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle set = open_dataset(name);
  const Hdf5Handle stored(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(set.get()), H5Sclose);
  if (!is_text_of_any_length(stored)) fail(name, "is of another type", "a list of texts");
  const std::size_t size = size_of(name, space, 1, "a list of texts");
  const Hdf5Handle type = text_type();
  BorrowedTexts borrowed(type, space, size);
  if (H5Dread(set.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, borrowed.buffer()) < 0) {
    fail(name, "cannot be read", kWholeFile);
  }
  return borrowed.copy();
}

bool Hdf5Contents::has_attribute(const std::string& object, const std::string& name) const {
  const QuietErrors quiet;
  require_inside(object, "no such object");
  return H5Aexists_by_name(file_.get(), object.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

Hdf5Handle Hdf5Contents::open_attribute(const std::string& object, const std::string& name) const {
  require_inside(object, "no such object");
  Hdf5Handle opened(
      H5Aopen_by_name(file_.get(), object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (!opened.valid()) fail(object, fmt::format("no attribute '{}'", name), kOfTpm);
  return opened;
}

double Hdf5Contents::number_attribute(const std::string& object, const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle opened = open_attribute(object, name);
  const Hdf5Handle stored(H5Aget_type(opened.get()), H5Tclose);
  const Hdf5Handle space(H5Aget_space(opened.get()), H5Sclose);
  // HDF5 writes as many numbers as the file says into the room for one.
  if (!is_plain_number(stored) || H5Sget_simple_extent_npoints(space.get()) != 1) {
    fail(object, fmt::format("attribute '{}' is of another type", name), "one number");
  }
  double value = 0.0;
  if (H5Aread(opened.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    fail(object, fmt::format("attribute '{}' cannot be read", name), kWholeFile);
  }
  return value;
}

std::string Hdf5Contents::attribute(const std::string& object, const std::string& name) const {
  const QuietErrors quiet;
  const Hdf5Handle opened = open_attribute(object, name);
  const Hdf5Handle stored(H5Aget_type(opened.get()), H5Tclose);
  if (!is_text_of_any_length(stored)) {
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
    fail(object, fmt::format("attribute '{}' cannot be read", name), kWholeFile);
  }
  return borrowed.copy().front();
}

}  // namespace tpm::files
