#pragma once
// Internal to store/: what Hdf5Reader's child process does (contained.hpp).
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/hdf5/hdf5_driver.hpp"

namespace tpm::files {

/// Reads an HDF5 file that may be crafted. Before every read the kind of object, its type, its rank
/// and its extent are checked, and that the file holds the numbers itself: no link and no storage
/// leads to another file. Names and errors as in Hdf5Reader.
class Hdf5Contents {
 public:
  /// Throws Error(bad_input) if HDF5 cannot open it.
  Hdf5Contents(int descriptor, std::string where);

  [[nodiscard]] bool has(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> members(const std::string& group) const;
  /// Floating-point numbers of an array of so many dimensions.
  [[nodiscard]] std::vector<double> real_numbers(const std::string& name, int dimensions) const;
  [[nodiscard]] std::vector<std::uint64_t> extents(const std::string& name) const;
  [[nodiscard]] std::vector<double> part(const std::string& name,
                                         const std::vector<std::uint64_t>& first,
                                         const std::vector<std::uint64_t>& counts) const;
  [[nodiscard]] std::vector<std::string> texts(const std::string& name) const;
  [[nodiscard]] bool has_attribute(const std::string& object, const std::string& name) const;
  [[nodiscard]] std::string attribute(const std::string& object, const std::string& name) const;
  [[nodiscard]] double number_attribute(const std::string& object, const std::string& name) const;

 private:
  void require_inside(const std::string& name, std::string_view missing) const;
  [[nodiscard]] Hdf5Handle open_dataset(const std::string& name) const;
  [[nodiscard]] Hdf5Handle open_attribute(const std::string& object, const std::string& name) const;
  void require_kept_inside(const std::string& name, const Hdf5Handle& set) const;
  [[nodiscard]] std::size_t size_of(const std::string& name, const Hdf5Handle& space,
                                    int dimensions, std::string_view expected) const;
  [[noreturn]] void fail(const std::string& object, const std::string& what,
                         std::string_view expected) const;

  std::string where_;
  std::uint64_t file_size_ = 0;
  std::unique_ptr<Hdf5Storage> storage_;
  Hdf5Handle file_;
};

}  // namespace tpm::files
