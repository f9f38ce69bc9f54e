#include <fmt/format.h>

#include <algorithm>

#include "tpm/core/error.hpp"
#include "tpm/scene/experiment_blocks.hpp"

namespace tpm {

void require_keys_of(const Json& block, std::string_view kind,
                     const std::vector<std::string_view>& needed,
                     const std::vector<std::string_view>& allowed, const DocumentPlace& place) {
  const auto in = [](const std::vector<std::string_view>& list, std::string_view key) {
    return std::find(list.begin(), list.end(), key) != list.end();
  };
  std::vector<std::string_view> known = needed;
  known.insert(known.end(), allowed.begin(), allowed.end());
  for (const auto& [key, value] : block.items()) {
    if (key == "kind" || in(known, key)) continue;
    throw bad_input(place.key(key).where, fmt::format("is no key of the kind '{}'", kind),
                    fmt::format("{}", fmt::join(known, ", ")));
  }
  for (const std::string_view key : needed) {
    if (block.contains(key)) continue;
    throw bad_input(place.key(key).where, "is missing",
                    fmt::format("'{}' needs {}", kind, fmt::join(needed, ", ")));
  }
}

}  // namespace tpm
