#include "tpm/files/origin_mark.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/xattr.h>

#include <exception>

namespace tpm::files {
namespace {

constexpr const char* kAttribute = "user.tpm.origin";
/// Names and values of all attributes of a file share a block of 4 kB on most file systems.
constexpr std::size_t kLongestOrigin = 3000;

/// Mark that tells changed content from the marked one without reading it.
std::string content_of(const struct stat& file) {
  return fmt::format("{} {}.{:09}", file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
}

}  // namespace

void set_origin_mark(int descriptor, const std::string& origin) noexcept try {
  struct stat found {};
  if (::fstat(descriptor, &found) != 0 || !S_ISREG(found.st_mode)) return;
  const std::string value =
      fmt::format("{}\n{}", content_of(found), origin.substr(0, kLongestOrigin));
  (void)::fsetxattr(descriptor, kAttribute, value.data(), value.size(), 0);
} catch (const std::exception&) {
  // Without room for a text the file stays without a mark, as one on a file system without them.
}

std::optional<OriginMark> origin_mark(const std::filesystem::path& path) {
  std::string value(kLongestOrigin + 100, '\0');
  const ssize_t size = ::getxattr(path.c_str(), kAttribute, value.data(), value.size());
  struct stat found {};
  if (size <= 0 || ::stat(path.c_str(), &found) != 0) return std::nullopt;
  value.resize(static_cast<std::size_t>(size));
  const std::size_t end = value.find('\n');
  if (end == std::string::npos) return std::nullopt;
  return OriginMark{value.substr(end + 1), value.substr(0, end) != content_of(found)};
}

}  // namespace tpm::files
