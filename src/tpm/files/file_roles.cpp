#include "tpm/files/file_roles.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "tpm/files/file.hpp"
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
  using Files = std::map<FileIdentity, fs::path>;  ///< with the name under which it was met
  Files read;
  Files written;                  ///< by this command
  std::vector<fs::path> results;  ///< announced, not yet written
  std::vector<fs::path> states;

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

void announce(const std::vector<fs::path>& files, std::vector<fs::path> Roles::*list) {
  for (const fs::path& file : files) require_short_name(file);
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  for (const fs::path& file : files) {
    const auto identity = identity_of(file);
    if (roles->was_read(identity)) throw both_read_and_written(file);
    ((*roles).*list).push_back(file);
  }
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

void will_write(const std::vector<fs::path>& results) {
  announce(results, &Roles::results);
}

void will_update(const std::vector<fs::path>& states) {
  announce(states, &Roles::states);
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
  if (roles->was_read(identity_of(path))) throw both_read_and_written(path);
}

void note_written(const fs::path& path) {
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  if (const auto file = identity_of(path)) Roles::add(roles->written, *file, path);
}

}  // namespace tpm::files
