#pragma once
#include <filesystem>
#include <string>

namespace tpm {

/// A file on its way to a name: written under a temporary name in the same folder and renamed when
/// it is whole, so that a reader sees the old file or the new one.
///
/// A symbolic link is followed: the file that it points to is replaced, the link stays. The new
/// file has the mode of the one that it replaces. The temporary file is created with O_EXCL and
/// locked while its writer lives; temporary files of the same name whose writers are dead are
/// removed.
class Replacement {
 public:
  /// Creates the parent folders and the temporary file. Throws Error(environment) if that fails or
  /// if the name is that of a folder, a device or a pipe, and Error(usage) for a file that the
  /// command reads (file_roles.hpp).
  explicit Replacement(std::filesystem::path path);
  /// Removes the temporary file unless it was put in place.
  ~Replacement();
  Replacement(const Replacement&) = delete;
  Replacement& operator=(const Replacement&) = delete;

  /// Open for reading and writing for as long as this lives.
  [[nodiscard]] int descriptor() const noexcept { return file_; }
  /// Passes everything to the disk. Throws Error(environment).
  void to_disk() const;
  /// Gives the file its name. Throws Error(environment).
  void put_in_place();

 private:
  std::filesystem::path path_;    ///< as it was given, for messages
  std::filesystem::path target_;  ///< what a symbolic link leads to
  std::filesystem::path temporary_;
  int file_ = -1;
};

/// The file that a name leads to through symbolic links, which need not exist. Throws
/// Error(environment) for links that lead round in a circle.
[[nodiscard]] std::filesystem::path followed(const std::filesystem::path& path);

}  // namespace tpm
