#pragma once
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tpm::show {

/// A table ready to be written: text cells only, no physics.
struct TableSection {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `columns`
  std::vector<bool> right_aligned;             ///< per column; missing ones are left-aligned
};

/// Sections with remarks before and after them.
struct TableDocument {
  std::string title;
  std::vector<std::string> introduction;
  std::vector<TableSection> sections;
  std::vector<std::string> conclusion;
};

enum class TableStyle { text, markdown, latex };

/// Aligned columns for a terminal, GitHub-flavoured Markdown, or LaTeX with the booktabs package.
/// Text from outside is escaped as the style needs. Ends with a line feed.
[[nodiscard]] std::string render(const TableDocument& document, TableStyle style);

/// A line for each row, its columns lined up with two blanks between them.
/// @param rows at least one, all of the same length
/// @param right columns aligned to the right; missing ones are left-aligned
[[nodiscard]] std::string aligned(const std::vector<std::vector<std::string>>& rows,
                                  const std::vector<bool>& right = {});

/// One CSV line (RFC 4180 quoting) with a line feed.
[[nodiscard]] std::string csv_line(const std::vector<std::string>& cells);

/// Names of columns and their numbers, of the same length; the numbers are not copied.
using NumberColumns = std::vector<std::pair<std::string, std::span<const double>>>;

/// CSV of columns of numbers; a cell without a finite number is empty.
[[nodiscard]] std::string numbers_csv(const NumberColumns& columns, int digits);

/// Breaks text into lines of at most `width` columns at spaces, each after the first indented.
/// @param column where the first line starts
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width, std::size_t indent,
                                  std::size_t column = 0);

}  // namespace tpm::show
