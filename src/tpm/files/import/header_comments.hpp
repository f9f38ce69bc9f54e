#pragma once
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace tpm::files {

/// The fields of a comment; blanks count as one where they separate.
[[nodiscard]] std::vector<std::string_view> cut_comment(std::string_view text, char separator);

/// Text behind the mark of a comment: "#", "%", "//", or ";" where that separates nothing.
/// None if there is no mark.
/// @param separator of the fields of the table
[[nodiscard]] std::optional<std::string_view> behind_comment_mark(std::string_view text,
                                                                  char separator);

/// "columns: time, depth, force" and "units: s, mm, N": what stands behind such a label; the whole
/// text where there is none.
[[nodiscard]] std::string_view without_label(std::string_view text);

/// A comment with one title: "2: depth (mm)", "column 2 = depth (mm)".
struct NumberedTitle {
  std::size_t number = 0;  ///< from 1
  std::string_view title;
};

[[nodiscard]] std::optional<NumberedTitle> numbered_title(std::string_view text);

}  // namespace tpm::files
