#pragma once
// Internal to store/: what Hdf5Writer's child process does (contained.hpp).
#include <cstdint>
#include <string>
#include <vector>

#include "tpm/files/hdf5/hdf5_driver.hpp"

namespace tpm::files {

/// Arranges an HDF5 file: groups, datasets, texts and attributes. Numbers are not written here:
/// array() says where they belong. Names as in Hdf5Writer; errors are Error(environment).
class Hdf5Assembly {
 public:
  Hdf5Assembly(int descriptor, std::string where);
  ~Hdf5Assembly();
  Hdf5Assembly(const Hdf5Assembly&) = delete;
  Hdf5Assembly& operator=(const Hdf5Assembly&) = delete;

  void group(const std::string& name);
  /// @returns where its numbers stand, in bytes from the file's beginning
  std::uint64_t array(const std::string& name, Hdf5Writer::Number kind,
                      const std::vector<std::uint64_t>& extents);
  void texts(const std::string& name, const std::vector<std::string>& values);
  void text_attribute(const std::string& object, const std::string& name, const std::string& text);
  void fixed_text_attribute(const std::string& object, const std::string& name,
                            const std::string& text);
  void number_attribute(const std::string& object, const std::string& name,
                        const std::vector<std::int64_t>& values);
  void real_attribute(const std::string& object, const std::string& name, double value);
  void dimension_scale(const std::string& name);
  void attach_scale(const std::string& array, unsigned dimension, const std::string& scale);
  /// Ends the file. @returns its size, bytes
  std::uint64_t close();

 private:
  [[nodiscard]] Hdf5Handle dataset(const std::string& name, Hdf5Handle::Id type,
                                   const std::vector<std::uint64_t>& extents,
                                   const Hdf5Handle& creation);
  void attach(const std::string& object, const std::string& name, Hdf5Handle::Id type,
              const Hdf5Handle& space, const void* values);
  void require_written(bool done, const std::string& what) const;

  std::string where_;
  Hdf5Storage storage_;
  Hdf5Handle file_;
};

}  // namespace tpm::files
