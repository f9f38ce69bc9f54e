#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/number_style.hpp"

namespace tpm::files {

/// Encoding of a text file.
enum class Encoding { utf8, utf8_with_mark, utf16_little_endian, utf16_big_endian, latin1 };

/// "UTF-8", "UTF-16 LE", ... as people write it.
[[nodiscard]] std::string_view encoding_name(Encoding encoding) noexcept;

/// Options of the reader; those left open are determined from the text.
struct DelimitedOptions {
  std::optional<char> separator;      ///< ',', ';', '\t' or ' ' (any blanks)
  std::optional<bool> decimal_comma;  ///< "3,5" is three and a half; with separator ',' in quotes
  std::optional<ThousandsMark> thousands;  ///< for whoever reads numbers; parse_delimited does not
  bool latin1 = false;  ///< read bytes as ISO 8859-1 unless a byte order mark says more
  bool utf8 = false;    ///< for importers, which read other bytes as latin-1 unless this is said
  bool ragged = false;  ///< let rows differ in their number of fields
  std::size_t longest_line = std::size_t{1} << 20;  ///< bytes after conversion to UTF-8
};

/// One row of fields, with the line it starts on (from 1). The fields are views of the table's
/// text.
struct DelimitedRow {
  int line = 0;
  std::span<const std::string_view> fields;
};

/// A line that starts with '#', or with "//" in a ragged table, without that mark.
struct DelimitedComment {
  int line = 0;  ///< from 1
  std::string text;
};

/// The characters that the fields of a table are views of.
struct DelimitedText;

/// A delimited text file, taken apart but not interpreted. Copies share one text, which lives as
/// long as any of them; a row or a field that is kept longer has to be copied.
struct DelimitedTable {
  Encoding encoding = Encoding::utf8;
  char separator = ',';
  bool decimal_comma = false;
  std::vector<DelimitedRow> rows;  ///< without comments and blank lines
  std::vector<DelimitedComment> comments;
  std::shared_ptr<const DelimitedText> text;
};

/// Takes delimited text apart: UTF-8 with or without byte order mark or UTF-16 with one; fields may
/// be quoted with '"' and then hold separators and line ends; a line that starts with '#' is a
/// comment; line ends may be LF, CRLF or CR. A quote inside a field that does not begin with one is
/// a letter (G", inches). The separator is that of tab, semicolon, comma and blanks which makes the
/// most rows of numbers.
///
/// Throws Error(bad_input), naming the line and never repeating it, for bytes that are not text, a
/// line that is too long, a stray or unfinished quote, no rows at all, and (unless `ragged`) a row
/// whose number of fields differs from the first row's.
[[nodiscard]] DelimitedTable parse_delimited(std::string_view bytes, std::string_view where,
                                             const DelimitedOptions& options = {});

/// read_file and parse_delimited.
[[nodiscard]] DelimitedTable read_delimited(const std::filesystem::path& path,
                                            const DelimitedOptions& options = {});

/// A field as a finite number, with the table's decimal sign. Throws Error(bad_input).
[[nodiscard]] double parse_field(std::string_view field, bool decimal_comma,
                                 std::string_view where);

/// As parse_field; none where that throws.
[[nodiscard]] std::optional<double> find_field_number(std::string_view field, bool decimal_comma);

/// As parse_field, for the many fields of a column: `where` is a function that returns the place,
/// called only if there is an error.
template <typename Where>
[[nodiscard]] double parse_field_at(std::string_view field, bool decimal_comma, Where&& where) {
  if (const auto number = find_field_number(field, decimal_comma)) return *number;
  return parse_field(field, decimal_comma, where());
}

/// True if parse_field would succeed.
[[nodiscard]] bool is_number(std::string_view field, bool decimal_comma);

/// A field in quotes where the text needs them, for a comma-separated file.
[[nodiscard]] std::string quoted_field(std::string_view text);

/// "comma", "semicolon", "tab" or "blank".
[[nodiscard]] std::string_view separator_name(char separator) noexcept;

}  // namespace tpm::files
