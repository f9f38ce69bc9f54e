#pragma once
#include <algorithm>
#include <span>
#include <string_view>

#include "tpm/base/remark.hpp"

namespace tpm::test {

/// True if one of the remarks has this code.
[[nodiscard]] inline bool has_remark(std::span<const Remark> remarks, std::string_view code) {
  return std::ranges::any_of(remarks, [&](const Remark& one) { return one.code == code; });
}

/// The text of the first remark of this code; empty if there is none.
[[nodiscard]] inline std::string_view remark_text(std::span<const Remark> remarks,
                                                  std::string_view code) {
  const auto found = std::ranges::find(remarks, code, &Remark::code);
  return found == remarks.end() ? std::string_view() : std::string_view(found->text);
}

}  // namespace tpm::test
