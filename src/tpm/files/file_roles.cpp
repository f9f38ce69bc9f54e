#include "tpm/files/file_roles.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "tpm/files/file.hpp"
#include "tpm/files/files_read.hpp"
#include "tpm/files/origin_mark.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

namespace fs = std::filesystem;

using FileIdentity = std::pair<dev_t, ino_t>;

/// Of regular files only: devices and pipes can be read and written by one command.
std::optional<FileIdentity> regular_identity(const struct stat& found) {
  if (!S_ISREG(found.st_mode)) return std::nullopt;
  return FileIdentity{found.st_dev, found.st_ino};
}

std::optional<FileIdentity> identity_of(const fs::path& path) {
  struct stat found {};
  if (path.empty() || ::stat(path.c_str(), &found) != 0) return std::nullopt;
  return regular_identity(found);
}

struct Roles {
  std::string instead;
  std::string origin;  ///< empty: results are not marked
  bool force = false;
  using Files = std::map<FileIdentity, fs::path>;  ///< with the name under which it was met
  Files read;
  Files written;                  ///< by this command
  std::vector<fs::path> results;  ///< announced, not yet written
  std::vector<fs::path> states;
  std::vector<std::pair<fs::path, Naming>> folders;

  [[nodiscard]] bool is_state(const FileIdentity& file) const {
    return std::any_of(states.begin(), states.end(),
                       [&](const fs::path& state) { return identity_of(state) == file; });
  }
  /// A file that was deleted leaves its inode to others: it has to be there still.
  [[nodiscard]] static bool is_among(const Files& files, const std::optional<FileIdentity>& file) {
    const auto found = file ? files.find(*file) : files.end();
    return found != files.end() && identity_of(found->second) == file;
  }
  [[nodiscard]] bool was_read(const std::optional<FileIdentity>& file) const {
    return is_among(read, file);
  }
  static void add(Files& files, const FileIdentity& file, const fs::path& path) {
    std::error_code no_folder;  // the working folder is gone: nothing relative was met in it
    const fs::path name = fs::absolute(path, no_folder);
    files[file] = no_folder ? path : name;
  }
};

constexpr std::size_t kLongestOriginShown = 200;

std::mutex roles_mutex;
std::optional<Roles> roles;

Error both_read_and_written(const fs::path& path) {
  return {ExitCode::usage, path.string(), "this command reads it and would write over it",
          roles->instead};
}

/// Before the work, not after it.
void require_short_name(const fs::path& path) {
  constexpr std::size_t kLongest = 255;
  if (path.filename().native().size() > kLongest) throw cannot_write(path, ENAMETOOLONG);
}

/// Throws Error(usage) for a file that a result of such a name may not replace.
void require_ours(const fs::path& path, Naming naming) {
  const auto file = identity_of(path);
  if (roles->origin.empty() || roles->force || naming == Naming::file || !file) return;
  if (Roles::is_among(roles->written, file)) return;
  const std::optional<OriginMark> mark = origin_mark(path);
  std::string what;
  if (mark && mark->changed) {
    what = "was changed since tpm wrote it";
  } else if (naming == Naming::by_default && !mark) {
    what = "stands there, and nothing says that tpm wrote it";
  } else if (naming == Naming::by_default && mark->origin != roles->origin) {
    what = fmt::format("is a result of: {}", printable(mark->origin, kLongestOriginShown));
  }
  if (what.empty()) return;
  throw Error(ExitCode::usage, path.string(), what, "a name for the result, or --overwrite");
}

void announce(const std::vector<fs::path>& files, std::vector<fs::path> Roles::*list,
              Naming naming) {
  for (const fs::path& file : files) require_short_name(file);
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  for (const fs::path& file : files) {
    const auto identity = identity_of(file);
    if (roles->was_read(identity)) throw both_read_and_written(file);
    require_ours(file, naming);
    ((*roles).*list).push_back(file);
  }
}

/// True if a file stands in a folder or below it.
bool is_within(const fs::path& file, const fs::path& folder) {
  std::error_code ec;
  const fs::path whole = fs::weakly_canonical(file, ec);
  const fs::path of = fs::weakly_canonical(folder, ec);
  return std::mismatch(of.begin(), of.end(), whole.begin(), whole.end()).first == of.end();
}

}  // namespace

FileRoles::FileRoles(std::string instead) {
  const std::lock_guard lock(roles_mutex);
  roles.emplace();
  roles->instead = std::move(instead);
}

FileRoles::~FileRoles() {
  const std::lock_guard lock(roles_mutex);
  roles.reset();
}

void FileRoles::mark_results(std::string origin, bool force) {
  const std::lock_guard lock(roles_mutex);
  roles->origin = std::move(origin);
  roles->force = force;
}

void will_write(const std::vector<fs::path>& results, Naming naming) {
  announce(results, &Roles::results, naming);
}

void will_write_in(const fs::path& folder, Naming naming) {
  const std::lock_guard lock(roles_mutex);
  if (roles && !folder.empty()) roles->folders.emplace_back(folder, naming);
}

void will_update(const std::vector<fs::path>& states) {
  announce(states, &Roles::states, Naming::file);
}

void note_reading(const fs::path& path, int descriptor) {
  const std::lock_guard lock(roles_mutex);
  struct stat found {};
  if (!roles || ::fstat(descriptor, &found) != 0) return;
  const auto file = regular_identity(found);
  if (!file || Roles::is_among(roles->written, file) || roles->is_state(*file)) return;
  for (const fs::path& result : roles->results) {
    if (identity_of(result) == file) throw both_read_and_written(path);
  }
  Roles::add(roles->read, *file, path);
}

void require_not_read(const fs::path& path) {
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  const auto file = identity_of(path);
  if (roles->was_read(file)) throw both_read_and_written(path);
  if (file && roles->is_state(*file)) return;
  for (const auto& [folder, naming] : roles->folders) {
    if (is_within(path, folder)) require_ours(path, naming);
  }
}

void mark_result(int descriptor) {
  const std::lock_guard lock(roles_mutex);
  if (roles && !roles->origin.empty()) set_origin_mark(descriptor, roles->origin);
}

void note_written(const fs::path& path) {
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  if (const auto file = identity_of(path)) Roles::add(roles->written, *file, path);
}

std::vector<fs::path> files_read() {
  const std::lock_guard lock(roles_mutex);
  std::vector<fs::path> files;
  if (!roles) return files;
  for (const auto& [file, path] : roles->read) files.push_back(path);
  std::ranges::sort(files);
  return files;
}

std::string result_origin() {
  const std::lock_guard lock(roles_mutex);
  return roles ? roles->origin : std::string();
}

}  // namespace tpm::files
