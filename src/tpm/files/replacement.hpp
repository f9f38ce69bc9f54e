#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace tpm::files {

/// A file on its way to a name: written without a name in the same folder (O_TMPFILE) and given its
/// name when it is whole, so that a reader sees the old file or the new one, and a process that is
/// killed leaves nothing. Where another file has the name, the new one passes through a temporary
/// name ("NAME.part.4711"), because only rename() replaces.
///
/// File systems without O_TMPFILE get the temporary name at once, created with O_EXCL and locked
/// while its writer lives. Temporary files of the same name whose writers are dead are removed.
///
/// A symbolic link is followed: the file that it points to is replaced, the link stays. The new
/// file has the mode of the one that it replaces.
class Replacement {
 public:
  /// Creates the parent folders and the file. Throws Error(environment) if that fails or
  /// if the name is that of a folder, a device or a pipe, and Error(usage) for a file that the
  /// command reads (file_roles.hpp).
  explicit Replacement(std::filesystem::path path);
  /// The file is gone unless it was put in place.
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
  void create(mode_t mode);
  void discard() noexcept;
  [[nodiscard]] bool link_to(const char* name) const noexcept;

  std::filesystem::path path_;    ///< as it was given, for messages
  std::filesystem::path target_;  ///< target of a symbolic link
  std::string open_file_;         ///< the file without a name, for linkat(); empty: it has one
  /// Names that it may have on its way, made before it is written: putting it in place needs no
  /// memory.
  std::vector<std::string> temporary_names_;
  const char* temporary_ = nullptr;  ///< the one that it has
  int file_ = -1;
};

/// The file that a name leads to through symbolic links, which need not exist. Throws
/// Error(environment) for links that lead round in a circle.
[[nodiscard]] std::filesystem::path followed(const std::filesystem::path& path);

}  // namespace tpm::files
