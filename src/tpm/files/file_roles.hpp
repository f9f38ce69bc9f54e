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

  /// From now on each result says in an extended attribute what made it (origin_mark.hpp), and
  /// results that the user did not name are kept if others made or changed them (Naming).
  /// @param origin the command and its inputs: "tpm fit /data/a.csv"
  /// @param force nothing is kept
  void mark_results(std::string origin, bool force);
};

/// Who chose the name of a result decides what it may replace.
enum class Naming {
  file,        ///< the user: whatever stands there, but no input
  folder,      ///< the user named its folder: but nothing that was changed since tpm wrote it
  by_default,  ///< nobody: only what the same command made of the same inputs
};

/// Announces results before they are computed. Throws Error(environment) for a name that is too
/// long for a file system, and Error(usage) for one that is among the files read so far or may not
/// be replaced; reading one of them later, before it was written, throws Error(usage), too.
void will_write(const std::vector<std::filesystem::path>& results, Naming naming = Naming::file);

/// Announces a folder for files whose names are not known yet: require_not_read() refuses what
/// will_write() would.
void will_write_in(const std::filesystem::path& folder, Naming naming);

/// Announces files in which a command keeps its own state (a checkpoint, a log): it may read them
/// and write them.
void will_update(const std::vector<std::filesystem::path>& states);

/// Called by readers once the file is open. Throws Error(usage) for an announced result.
void note_reading(const std::filesystem::path& path, int descriptor);

/// Called by writers before they touch the file. Throws Error(usage) for a file that was read, or
/// that stands in a folder of will_write_in() and may not be replaced.
void require_not_read(const std::filesystem::path& path);

/// Called by writers when the file has its content and, perhaps, no name yet.
void mark_result(int descriptor);

/// Called by writers once the file has its content: it may be read back and written again.
void note_written(const std::filesystem::path& path);

/// The mark of results, set by mark_results(), for programs that write for this one. Empty if
/// they are not.
[[nodiscard]] std::string result_origin();

}  // namespace tpm::files
