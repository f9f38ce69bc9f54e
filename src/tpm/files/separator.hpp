#pragma once
#include <string_view>

namespace tpm::files {

/// The separator of a text: that of tab, semicolon, comma and blanks (' ') which makes the most
/// rows of numbers; without any such row the first of tab, semicolon and comma that stands in at
/// least half of the lines, else the comma. Long texts are sampled.
[[nodiscard]] char find_separator(std::string_view text);

}  // namespace tpm::files
