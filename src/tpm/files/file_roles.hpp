#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace tpm::files {

/// Keeps the files that a program reads apart from those that it writes: a command of tpm for as
/// long as it runs, the Python module for as long as it is loaded. While a FileRoles lives, readers
/// and writers report every file to it, and a file is known by its device and inode, so that links
/// and other spellings of a name are the same file. Without a FileRoles (in a program that uses the
/// library) nothing is watched. At most one lives at a time.
class FileRoles {
 public:
  /// @param instead what a refusal expects in place of a name that was read
  explicit FileRoles(std::string instead = "another --output");
  ~FileRoles();
  FileRoles(const FileRoles&) = delete;
  FileRoles& operator=(const FileRoles&) = delete;
};

/// Announces results before they are computed. Throws Error(environment) for a name that is too
/// long for a file system, and Error(usage) if one of them is among the files read so far; reading
/// one of them later, before it was written, throws the same error.
void will_write(const std::vector<std::filesystem::path>& results);

/// Announces files in which a command keeps its own state (a checkpoint, a log): it may read them
/// and write them.
void will_update(const std::vector<std::filesystem::path>& states);

/// Called by readers once the file is open. Throws Error(usage) for an announced result.
void note_reading(const std::filesystem::path& path, int descriptor);

/// Called by writers before they touch the file. Throws Error(usage) for a file that was read.
void require_not_read(const std::filesystem::path& path);

/// Called by writers once the file has its content: it may be read back and written again.
void note_written(const std::filesystem::path& path);

}  // namespace tpm::files
