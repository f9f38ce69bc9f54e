#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace tpm::files {

/// The origin of a file, kept in its extended attribute "user.tpm.origin", which moves and is
/// deleted with it. File systems without such attributes have none, and most copies have none.
struct OriginMark {
  std::string origin;    ///< the command and its inputs
  bool changed = false;  ///< its size or its time is not that of the marked content
};

/// Of an open file that has its content. What cannot be marked stays without a mark.
void set_origin_mark(int descriptor, const std::string& origin) noexcept;

/// None if the file has none, or none that can be read.
[[nodiscard]] std::optional<OriginMark> origin_mark(const std::filesystem::path& path);

}  // namespace tpm::files
