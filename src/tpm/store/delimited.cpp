#include "tpm/store/delimited.hpp"

#include <csv.h>
#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <utility>

#include "tpm/core/error.hpp"
#include "tpm/core/units.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
constexpr std::string_view kTextExpected = "text in UTF-8, or in UTF-16 with a byte order mark";

std::string at_line(std::string_view where, int line) {
  return fmt::format("{}:{}", where, line);
}

int line_of(std::string_view text, std::size_t position) {
  return 1 + static_cast<int>(std::count(
                 text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n'));
}

std::string from_utf16(std::string_view bytes, bool big_endian, std::string_view where) {
  if (bytes.size() % 2 != 0) {
    throw bad_input(where, "UTF-16 text ends in the middle of a character", "a whole file");
  }
  std::u16string units(bytes.size() / 2, u'\0');
  for (std::size_t i = 0; i < units.size(); ++i) {
    const auto first = static_cast<unsigned char>(bytes[2 * i]);
    const auto second = static_cast<unsigned char>(bytes[2 * i + 1]);
    units[i] = static_cast<char16_t>(big_endian ? first * 256 + second : second * 256 + first);
  }
  try {
    return utf8::utf16to8(units);
  } catch (const utf8::exception&) {
    throw bad_input(where, "the byte order mark says UTF-16 but the text is not", kTextExpected);
  }
}

std::string from_latin1(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) utf8::append(static_cast<unsigned char>(byte), text);
  return text;
}

struct Decoded {
  Encoding encoding;
  std::string text;
};

Decoded decode(std::string_view bytes, bool latin1, std::string_view where) {
  if (bytes.starts_with("\xFF\xFE")) {
    return {Encoding::utf16_little_endian, from_utf16(bytes.substr(2), false, where)};
  }
  if (bytes.starts_with("\xFE\xFF")) {
    return {Encoding::utf16_big_endian, from_utf16(bytes.substr(2), true, where)};
  }
  if (bytes.starts_with(kUtf8Mark)) {
    return {Encoding::utf8_with_mark, std::string(bytes.substr(kUtf8Mark.size()))};
  }
  if (latin1) return {Encoding::latin1, from_latin1(bytes)};
  return {Encoding::utf8, std::string(bytes)};
}

void require_text(std::string_view text, std::string_view where) {
  const auto binary = std::find_if(text.begin(), text.end(), [](char c) {
    const auto u = static_cast<unsigned char>(c);
    return (u < 0x20 && c != '\t' && c != '\n' && c != '\r') || u == 0x7f;
  });
  if (binary != text.end()) {
    const auto position = static_cast<std::size_t>(binary - text.begin());
    throw bad_input(at_line(where, line_of(text, position)),
                    fmt::format("byte 0x{:02X} is not text", static_cast<unsigned char>(*binary)),
                    kTextExpected);
  }
  const auto invalid = utf8::find_invalid(text.begin(), text.end());
  if (invalid != text.end()) {
    const auto position = static_cast<std::size_t>(invalid - text.begin());
    throw bad_input(at_line(where, line_of(text, position)),
                    fmt::format("byte 0x{:02X} is not UTF-8", static_cast<unsigned char>(*invalid)),
                    fmt::format("{} (older Windows exports are latin-1)", kTextExpected));
  }
}

std::vector<std::string_view> split_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find_first_of("\r\n");
    lines.push_back(text.substr(0, end));
    if (end == std::string_view::npos) break;
    const bool pair = text.substr(end).starts_with("\r\n");
    text.remove_prefix(end + (pair ? 2 : 1));
  }
  return lines;
}

bool is_blank(std::string_view line) {
  return line.find_first_not_of(" \t") == std::string_view::npos;
}

bool holds_outside_quotes(std::string_view line, char wanted) {
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == wanted && !quoted) return true;
  }
  return false;
}

char find_separator(const std::vector<std::string_view>& lines) {
  constexpr std::size_t kSample = 200;
  std::vector<std::string_view> sample;
  for (const std::string_view line : lines) {
    if (sample.size() == kSample) break;
    if (!is_blank(line) && !line.starts_with('#')) sample.push_back(line);
  }
  for (const char candidate : {'\t', ';', ','}) {
    const auto n = std::count_if(sample.begin(), sample.end(), [candidate](std::string_view line) {
      return holds_outside_quotes(line, candidate);
    });
    if (n > 0 && 2 * static_cast<std::size_t>(n) >= sample.size()) return candidate;
  }
  return ',';
}

/// Owns a libcsv parser and gathers its fields into rows.
class RowParser {
 public:
  explicit RowParser(char separator) {
    csv_init(&parser_, CSV_STRICT | CSV_STRICT_FINI);
    csv_set_delim(&parser_, static_cast<unsigned char>(separator));
  }
  ~RowParser() { csv_free(&parser_); }
  RowParser(const RowParser&) = delete;
  RowParser& operator=(const RowParser&) = delete;

  /// True while a quoted field goes on over the end of a line.
  [[nodiscard]] bool inside_row() const { return open_; }
  [[nodiscard]] int row_line() const { return row_.line; }

  /// False if libcsv finds a quote where none belongs.
  bool feed(std::string_view line, int line_number) {
    if (!open_) row_.line = line_number;
    open_ = true;
    return parse(line) && parse("\n");
  }
  bool finish() { return csv_fini(&parser_, on_field, on_row, this) == 0; }
  std::vector<DelimitedRow> take_rows() { return std::move(rows_); }

 private:
  bool parse(std::string_view text) {
    return csv_parse(&parser_, text.data(), text.size(), on_field, on_row, this) == text.size();
  }
  static void on_field(void* field, std::size_t size, void* self) {
    static_cast<RowParser*>(self)->row_.fields.emplace_back(static_cast<const char*>(field), size);
  }
  static void on_row(int /*terminator*/, void* self) {
    auto* parser = static_cast<RowParser*>(self);
    parser->rows_.push_back(std::exchange(parser->row_, {}));
    parser->open_ = false;
  }

  csv_parser parser_{};
  DelimitedRow row_;
  std::vector<DelimitedRow> rows_;
  bool open_ = false;
};

void require_same_width(const std::vector<DelimitedRow>& rows, std::string_view where) {
  const std::size_t width = rows.front().fields.size();
  for (const DelimitedRow& row : rows) {
    if (row.fields.size() != width) {
      throw bad_input(at_line(where, row.line),
                      fmt::format("{} fields in this row", row.fields.size()),
                      fmt::format("{} fields as in line {}", width, rows.front().line));
    }
  }
}

bool uses_decimal_comma(const std::vector<DelimitedRow>& rows, char separator) {
  if (separator == ',') return false;
  bool comma = false;
  for (const DelimitedRow& row : rows) {
    for (const std::string& field : row.fields) {
      const bool has_comma = field.find(',') != std::string::npos;
      if (has_comma && is_number(field, true)) comma = true;
      if (field.find('.') != std::string::npos && is_number(field, false)) return false;
    }
  }
  return comma;
}

}  // namespace

std::string_view encoding_name(Encoding encoding) noexcept {
  switch (encoding) {
    case Encoding::utf8:
      return "UTF-8";
    case Encoding::utf8_with_mark:
      return "UTF-8 with byte order mark";
    case Encoding::utf16_little_endian:
      return "UTF-16 LE";
    case Encoding::utf16_big_endian:
      return "UTF-16 BE";
    case Encoding::latin1:
      return "latin-1";
  }
  return "";
}

std::string_view separator_name(char separator) noexcept {
  switch (separator) {
    case '\t':
      return "tab";
    case ';':
      return "semicolon";
    default:
      return "comma";
  }
}

DelimitedTable parse_delimited(std::string_view bytes, std::string_view where,
                               const DelimitedOptions& options) {
  const Decoded decoded = decode(bytes, options.latin1, where);
  require_text(decoded.text, where);
  const auto lines = split_lines(decoded.text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].size() > options.longest_line) {
      throw bad_input(at_line(where, static_cast<int>(i) + 1),
                      fmt::format("the line is {} bytes long", lines[i].size()),
                      fmt::format("at most {} bytes a line", options.longest_line));
    }
  }

  DelimitedTable table;
  table.encoding = decoded.encoding;
  table.separator = options.separator.value_or(find_separator(lines));
  RowParser parser(table.separator);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const int number = static_cast<int>(i) + 1;
    if (!parser.inside_row()) {
      if (is_blank(lines[i])) continue;
      if (lines[i].starts_with('#')) {
        table.comments.emplace_back(lines[i].substr(1));
        continue;
      }
    }
    if (!parser.feed(lines[i], number)) {
      throw bad_input(at_line(where, number), "a quote stands where none belongs",
                      "fields quoted as a whole, and quotes inside them doubled");
    }
  }
  if (parser.inside_row() || !parser.finish()) {
    throw bad_input(at_line(where, parser.row_line()), "a quoted field is never closed",
                    "a second quote");
  }
  table.rows = parser.take_rows();
  if (table.rows.empty()) throw bad_input(where, "no rows", "at least one row of fields");
  if (!options.ragged) require_same_width(table.rows, where);
  table.decimal_comma =
      options.decimal_comma.value_or(uses_decimal_comma(table.rows, table.separator));
  if (table.decimal_comma && table.separator == ',') {
    throw bad_input(where, "the comma cannot be both separator and decimal sign",
                    "another separator");
  }
  return table;
}

DelimitedTable read_delimited(const std::filesystem::path& path, const DelimitedOptions& options) {
  return parse_delimited(read_file(path), path.string(), options);
}

double parse_field(std::string_view field, bool decimal_comma, std::string_view where) {
  if (!decimal_comma) return parse_number(field, where);
  // A point beside a decimal comma is a thousands mark or a mistake: refuse both.
  if (field.find('.') != std::string_view::npos) {
    throw bad_input(where, fmt::format("'{}' has a point beside decimal commas", printable(field)),
                    "a number such as 12,5");
  }
  std::string with_point(field);
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  return parse_number(with_point, where);
}

bool is_number(std::string_view field, bool decimal_comma) {
  try {
    static_cast<void>(parse_field(field, decimal_comma, {}));
    return true;
  } catch (const Error&) {
    return false;
  }
}

std::string quoted_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.starts_with('#')) {
    return std::string(text);
  }
  std::string quoted(2 * text.size() + 2, '\0');
  quoted.resize(csv_write(quoted.data(), quoted.size(), text.data(), text.size()));
  return quoted;
}

}  // namespace tpm
