#include "tpm/files/file_roles.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <optional>
#include <set>
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
  std::set<FileIdentity> read;
  std::set<FileIdentity> written;  ///< by this command
  std::vector<fs::path> results;   ///< announced, not yet written
  std::vector<fs::path> states;

  [[nodiscard]] bool is_state(const FileIdentity& file) const {
    return std::any_of(states.begin(), states.end(),
                       [&](const fs::path& state) { return identity_of(state) == file; });
  }
};

std::mutex roles_mutex;
std::optional<Roles> roles;

Error both_read_and_written(const fs::path& path) {
  return {ExitCode::usage, path.string(), "this command reads it and would write over it",
          "another --output"};
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
    if (identity && roles->read.count(*identity) > 0) throw both_read_and_written(file);
    ((*roles).*list).push_back(file);
  }
}

}  // namespace

FileRoles::FileRoles() {
  const std::lock_guard lock(roles_mutex);
  roles.emplace();
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
  if (!file || roles->written.count(*file) > 0 || roles->is_state(*file)) return;
  for (const fs::path& result : roles->results) {
    if (identity_of(result) == file) throw both_read_and_written(path);
  }
  roles->read.insert(*file);
}

void require_not_read(const fs::path& path) {
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  const auto file = identity_of(path);
  if (file && roles->read.count(*file) > 0) throw both_read_and_written(path);
}

void note_written(const fs::path& path) {
  const std::lock_guard lock(roles_mutex);
  if (!roles) return;
  if (const auto file = identity_of(path)) roles->written.insert(*file);
}

}  // namespace tpm::files
