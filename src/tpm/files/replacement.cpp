#include "tpm/files/replacement.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>
#include <vector>

#include "tpm/files/checksum.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"

namespace tpm::files {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 255;  // bytes; of all usual file systems
constexpr std::size_t kRoomForEnding = 24;

/// Prefix of all temporary files for a target. A long name is not repeated: there would be no room
/// for the ending.
std::string temporary_beginning(const fs::path& target) {
  const std::string name = target.filename().string();
  if (name.size() + kRoomForEnding <= kLongestName) return name + ".part.";
  return fmt::format(".tpm-{:08x}.part.", crc32_of(name.data(), name.size()));
}

fs::path folder_of(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

/// "4711" or "4711-2", as they follow the beginning.
bool is_ending(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789-") == std::string_view::npos;
}

/// A writer that lives holds a lock on its file.
void remove_if_abandoned(const fs::path& file) {
  const int opened = ::open(file.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (opened < 0) return;
  struct stat found {};
  if (::fstat(opened, &found) == 0 && S_ISREG(found.st_mode) &&
      ::flock(opened, LOCK_EX | LOCK_NB) == 0) {
    ::unlink(file.c_str());
  }
  ::close(opened);
}

void remove_abandoned(const fs::path& target) {
  const std::string beginning = temporary_beginning(target);
  std::vector<fs::path> found;
  std::error_code ec;
  for (fs::directory_iterator entry(folder_of(target), ec), end; !ec && entry != end;
       entry.increment(ec)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(beginning) && is_ending(std::string_view(name).substr(beginning.size()))) {
      found.push_back(entry->path());
    }
  }
  for (const fs::path& file : found) remove_if_abandoned(file);
}

/// -1 with errno if that is not possible.
int create_locked(const char* file, mode_t mode) {
  const int opened = ::open(file, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode);
  if (opened < 0) return -1;
  // Not every file system has locks. Where they are, another process may have found the file
  // abandoned before it was locked, and have removed it.
  struct stat found {};
  const bool locked = ::flock(opened, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
  if (locked && ::fstat(opened, &found) == 0 && found.st_nlink > 0) return opened;
  ::close(opened);
  errno = EEXIST;
  return -1;
}

/// The name under which the kernel knows an open file.
std::string name_of_open(int file) {
  return fmt::format("/proc/self/fd/{}", file);
}

/// A file without a name, locked for the moment in which it has a temporary one. -1 with errno;
/// EOPNOTSUPP where the file system or a missing /proc does not allow it.
int create_nameless(const fs::path& folder, mode_t mode) {
  const int opened = ::open(folder.c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, mode);
  if (opened < 0) {
    // Kernels and file systems that do not know it take it for a wish to write into the folder.
    if (errno == EISDIR || errno == EINVAL || errno == ENOENT) errno = EOPNOTSUPP;
    return -1;
  }
  if (::access(name_of_open(opened).c_str(), F_OK) != 0) {
    ::close(opened);
    errno = EOPNOTSUPP;
    return -1;
  }
  (void)::flock(opened, LOCK_EX | LOCK_NB);
  return opened;
}

constexpr int kTemporaryNames = 10;

}  // namespace

fs::path followed(const fs::path& path) {
  constexpr int kMostLinks = 40;
  fs::path target = path;
  std::error_code ec;
  for (int links = 0; links < kMostLinks; ++links) {
    const fs::path next = fs::read_symlink(target, ec);
    if (ec) return target;  // no link, or nothing there
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  throw cannot_write(path, ELOOP);
}

Replacement::Replacement(fs::path path) : path_(std::move(path)), target_(followed(path_)) {
  require_replaceable(target_);
  require_not_read(target_);
  if (target_.filename().string().size() > kLongestName) throw cannot_write(path_, ENAMETOOLONG);
  std::error_code ec;
  if (target_.has_parent_path()) {
    fs::create_directories(target_.parent_path(), ec);
    if (ec) throw cannot_write(target_.parent_path(), ec.value());
  }
  remove_abandoned(target_);

  struct stat old {};
  const bool replaces = ::stat(target_.c_str(), &old) == 0;
  constexpr mode_t kPermissions = 07777, kNewFile = 0666;
  const mode_t mode = replaces ? old.st_mode & kPermissions : kNewFile;
  // Nobody may read a private file while it is under way.
  create(replaces ? mode & 0600 : mode);
  if (!replaces) return;
  // Who replaces the file of another may not be allowed to hand it to them.
  const bool handed = ::fchown(file_, old.st_uid, old.st_gid) == 0;
  const mode_t kept = handed ? mode : mode & 0777;
  if (::fchmod(file_, kept) != 0) {
    const int error_number = errno;
    discard();
    throw cannot_write(path_, error_number);
  }
}

Replacement::~Replacement() {
  discard();
}

void Replacement::discard() noexcept {
  if (temporary_ != nullptr) ::unlink(temporary_);
  if (file_ >= 0) ::close(file_);
}

void Replacement::create(mode_t mode) {
  const std::string name =
      (folder_of(target_) / fmt::format("{}{}", temporary_beginning(target_), ::getpid())).string();
  for (int i = 1; i <= kTemporaryNames; ++i) {
    temporary_names_.push_back(i == 1 ? name : fmt::format("{}-{}", name, i));
  }
  file_ = create_nameless(folder_of(target_), mode);
  if (file_ >= 0) {
    open_file_ = name_of_open(file_);
    return;
  }
  if (errno != EOPNOTSUPP) throw cannot_write(path_, errno);
  for (const std::string& temporary : temporary_names_) {
    file_ = create_locked(temporary.c_str(), mode);
    if (file_ >= 0) temporary_ = temporary.c_str();
    if (file_ >= 0 || errno != EEXIST) break;
  }
  if (file_ < 0) throw cannot_write(path_, errno);
}

void Replacement::to_disk() const {
  if (::fsync(file_) != 0) throw cannot_write(path_, errno);
}

/// Links the file to a name. False with errno, EEXIST if there is a file of that name.
bool Replacement::link_to(const char* name) const noexcept {
  return ::linkat(AT_FDCWD, open_file_.c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW) == 0;
}

void Replacement::put_in_place() {
  mark_result(file_);
  bool placed = !open_file_.empty() && link_to(target_.c_str());
  if (!placed && !open_file_.empty()) {
    if (errno != EEXIST) throw cannot_write(path_, errno);
    for (const std::string& name : temporary_names_) {
      if (link_to(name.c_str())) {
        temporary_ = name.c_str();
      } else if (errno == EEXIST) {
        continue;
      }
      break;
    }
    if (temporary_ == nullptr) throw cannot_write(path_, errno);
  }
  if (!placed && ::rename(temporary_, target_.c_str()) != 0) throw cannot_write(path_, errno);
  temporary_ = nullptr;
  note_written(target_);
}

}  // namespace tpm::files
