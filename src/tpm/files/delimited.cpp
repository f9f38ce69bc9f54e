#include "tpm/files/delimited.hpp"

#include <csv.h>
#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <utility>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/separator.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
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
  std::string text;
  text.reserve(units.size());
  try {
    utf8::utf16to8(units.begin(), units.end(), std::back_inserter(text));
    return text;
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

bool is_control(unsigned char c) {
  return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f;
}

void require_text(std::string_view text, std::string_view where) {
  // One plain pass over everything; the place of a fault is looked up only if there is one.
  bool control = false;
  bool beyond_ascii = false;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    control |= is_control(u);
    beyond_ascii |= u >= 0x80;
  }
  if (control) {
    const auto binary = std::find_if(
        text.begin(), text.end(), [](char c) { return is_control(static_cast<unsigned char>(c)); });
    const auto position = static_cast<std::size_t>(binary - text.begin());
    throw bad_input(at_line(where, line_of(text, position)),
                    fmt::format("byte 0x{:02X} is not text", static_cast<unsigned char>(*binary)),
                    kTextExpected);
  }
  if (!beyond_ascii) return;
  const auto invalid = utf8::find_invalid(text.begin(), text.end());
  if (invalid != text.end()) {
    const auto position = static_cast<std::size_t>(invalid - text.begin());
    throw bad_input(at_line(where, line_of(text, position)),
                    fmt::format("byte 0x{:02X} is not UTF-8", static_cast<unsigned char>(*invalid)),
                    fmt::format("{} (older Windows exports: --encoding latin-1)", kTextExpected));
  }
}

/// Goes through a text line by line; LF, CRLF and CR end a line.
class LineReader {
 public:
  explicit LineReader(std::string_view text)
      : text_(text), feed_(std::min(text.find('\n'), text.size())) {}

  /// False after the last line.
  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    // Files with CR alone have no LF ahead: it must not be searched for again on every line.
    if (feed_ < at_) feed_ = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, feed_ - at_);
    const auto carriage = line.find('\r');
    const bool ends_in_pair = carriage + 1 == line.size() && feed_ < text_.size();
    at_ += (carriage == std::string_view::npos || ends_in_pair) ? line.size() + 1 : carriage + 1;
    line = line.substr(0, carriage);
    ++number_;
    return true;
  }
  /// Of the line that next() gave last, from 1.
  [[nodiscard]] int number() const { return number_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t feed_;  ///< the first LF from at_ on, or the end of the text
  int number_ = 0;
};

bool is_blank(std::string_view line) {
  return line.find_first_not_of(" \t") == std::string_view::npos;
}

/// True if a field of the line begins with a quote. Quotes elsewhere are letters: G", or inches.
bool has_quoted_field(std::string_view line, char separator) {
  bool begins = true;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == separator) {
      begins = true;
      continue;
    }
    if (line[i] == ' ' || line[i] == '\t') continue;
    if (begins && line[i] == '"') {
      // A quote alone in its field is an inch.
      const auto next = line.find_first_not_of(" \t", i + 1);
      if (next != std::string_view::npos && line[next] != separator) return true;
      if (line.find('"', i + 1) != std::string_view::npos) return true;
    }
    begins = false;
  }
  return false;
}

/// More fields than a text can have: fields must not move once a row looks at them.
std::size_t most_fields(std::string_view text, char separator) {
  const auto ends = std::count_if(text.begin(), text.end(), [separator](char c) {
    return c == separator || c == '\n' || c == '\r' || (separator == ' ' && c == '\t');
  });
  return static_cast<std::size_t>(ends) + 1;
}

/// Of the usual texts more rows than they have, so that rows are never copied as they grow; CRLF
/// counts once.
std::size_t most_rows(std::string_view text) {
  std::size_t feeds = 0, returns = 0;
  for (const char c : text) {
    feeds += c == '\n' ? 1 : 0;
    returns += c == '\r' ? 1 : 0;
  }
  return std::max(feeds, returns) + 1;
}

}  // namespace

struct DelimitedText {
  std::string text;
  /// Fields in quotes, without them, that are no part of the text as it stands, and the first of
  /// the others: empty only if no field stands in quotes.
  std::deque<std::string> unquoted;
  std::vector<std::string_view> fields;
};

namespace {

/// Gathers fields into rows. A line is only cut up, without copying, if quotes stand around whole
/// fields or nowhere; the others go through libcsv, whose rules (white space around a field does
/// not count) the cutting follows.
class RowParser {
 public:
  RowParser(DelimitedText& text, char separator) : text_(text), separator_(separator) {
    csv_init(&parser_, CSV_STRICT | CSV_STRICT_FINI);
    csv_set_delim(&parser_, static_cast<unsigned char>(separator));
    text_.fields.reserve(most_fields(text_.text, separator));
    rows_.reserve(most_rows(text_.text));
  }
  ~RowParser() { csv_free(&parser_); }
  RowParser(const RowParser&) = delete;
  RowParser& operator=(const RowParser&) = delete;

  /// True while a quoted field goes on over the end of a line.
  [[nodiscard]] bool inside_row() const { return open_; }
  [[nodiscard]] int row_line() const { return line_; }

  /// `line` is a part of the text. False if libcsv finds a quote where none belongs.
  bool feed(std::string_view line, int line_number) {
    if (!open_) line_ = line_number;
    if (separator_ == ' ') {
      cut_at_blanks(line);
      return true;
    }
    if (!open_ &&
        (line.find('"') == std::string_view::npos || !has_quoted_field(line, separator_))) {
      cut(line);
      return true;
    }
    if (!open_ && cut_quoted(line)) return true;
    open_ = true;
    return parse(line) && parse("\n");
  }
  bool finish() { return csv_fini(&parser_, on_field, on_row, this) == 0; }
  std::vector<DelimitedRow> take_rows() { return std::move(rows_); }

 private:
  void cut(std::string_view line) {
    while (true) {
      const auto end = line.find(separator_);
      text_.fields.push_back(without_space(line.substr(0, end)));
      if (end == std::string_view::npos) break;
      line.remove_prefix(end + 1);
    }
    end_row();
  }
  /// Blanks in a row count once; a field in quotes keeps its own.
  void cut_at_blanks(std::string_view line) {
    for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
      const auto close = line.front() == '"' ? line.find('"', 1) : std::string_view::npos;
      if (close != std::string_view::npos) {
        text_.fields.push_back(line.substr(1, close - 1));
        line.remove_prefix(close + 1);
        continue;
      }
      const auto end = std::min(line.find_first_of(" \t"), line.size());
      text_.fields.push_back(line.substr(0, end));
      line.remove_prefix(end);
    }
    end_row();
  }
  /// False, with nothing done, for quotes within a field and for one that goes on in the next line.
  bool cut_quoted(std::string_view line) {
    while (true) {
      const auto begin = std::min(line.find_first_not_of(" \t"), line.size());
      const bool quoted = line.substr(begin).starts_with('"');
      const auto close = quoted ? line.find('"', begin + 1) : begin;
      const auto end = std::min(line.find(separator_, std::min(close, line.size())), line.size());
      const bool whole =
          quoted ? close < line.size() && is_blank(line.substr(close + 1, end - close - 1))
                 : line.substr(0, end).find('"') == std::string_view::npos;
      if (!whole) {
        text_.fields.resize(row_end_);
        return false;
      }
      if (quoted) {
        const std::string_view field = line.substr(begin + 1, close - begin - 1);
        if (text_.unquoted.empty()) text_.unquoted.emplace_back(field);
        text_.fields.push_back(field);
      } else {
        text_.fields.push_back(without_space(line.substr(0, end)));
      }
      if (end == line.size()) break;
      line.remove_prefix(end + 1);
    }
    end_row();
    return true;
  }
  void end_row() {
    const std::size_t first = row_end_;
    row_end_ = text_.fields.size();
    rows_.push_back({line_, {text_.fields.data() + first, row_end_ - first}});
  }
  static std::string_view without_space(std::string_view field) {
    while (!field.empty() && is_space(field.front())) field.remove_prefix(1);
    while (!field.empty() && is_space(field.back())) field.remove_suffix(1);
    return field;
  }
  static bool is_space(char c) { return c == ' ' || c == '\t'; }

  bool parse(std::string_view text) {
    return csv_parse(&parser_, text.data(), text.size(), on_field, on_row, this) == text.size();
  }
  static void on_field(void* field, std::size_t size, void* self) {
    DelimitedText& text = static_cast<RowParser*>(self)->text_;
    text.unquoted.emplace_back(static_cast<const char*>(field), size);
    text.fields.emplace_back(text.unquoted.back());
  }
  static void on_row(int /*terminator*/, void* self) {
    auto* parser = static_cast<RowParser*>(self);
    parser->end_row();
    parser->open_ = false;
  }

  DelimitedText& text_;
  char separator_;
  csv_parser parser_{};
  int line_ = 0;
  std::size_t row_end_ = 0;  ///< of the last row, in text_.fields
  std::vector<DelimitedRow> rows_;
  bool open_ = false;
};

/// Length of the mark before a comment: '#', and "//" where machines write the table. 0 without
/// one.
std::size_t comment_mark(std::string_view line, const DelimitedOptions& options) {
  if (line.starts_with('#')) return 1;
  return options.ragged && line.starts_with("//") ? 2 : 0;
}

/// Rows, and comments into `comments`. Throws for long lines and misplaced quotes.
std::vector<DelimitedRow> read_rows(DelimitedText& text, char separator, std::string_view where,
                                    const DelimitedOptions& options,
                                    std::vector<DelimitedComment>& comments) {
  RowParser parser(text, separator);
  LineReader lines(text.text);
  std::string_view line;
  while (lines.next(line)) {
    if (line.size() > options.longest_line) {
      throw bad_input(at_line(where, lines.number()),
                      fmt::format("the line is {} bytes long", line.size()),
                      fmt::format("at most {} bytes a line", options.longest_line));
    }
    if (!parser.inside_row()) {
      if (is_blank(line)) continue;
      if (const std::size_t mark = comment_mark(line, options); mark > 0) {
        comments.push_back({lines.number(), std::string(line.substr(mark))});
        continue;
      }
    }
    if (!parser.feed(line, lines.number())) {
      throw bad_input(at_line(where, lines.number()), "a quote stands where none belongs",
                      "fields quoted as a whole, and quotes inside them doubled");
    }
  }
  if (parser.inside_row() || !parser.finish()) {
    throw bad_input(at_line(where, parser.row_line()), "a quoted field is never closed",
                    "a second quote");
  }
  return parser.take_rows();
}

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

bool uses_decimal_comma(const std::vector<DelimitedRow>& rows) {
  bool comma = false;
  for (const DelimitedRow& row : rows) {
    for (const std::string_view field : row.fields) {
      const bool has_comma = field.find(',') != std::string_view::npos;
      if (has_comma && is_number(field, true)) comma = true;
      if (field.find('.') != std::string_view::npos && is_number(field, false)) return false;
    }
  }
  return comma;
}

}  // namespace

std::string_view encoding_name(Encoding encoding) noexcept {
  static constexpr auto kNames = std::to_array<Word<Encoding>>({
      {Encoding::utf8, "UTF-8"},
      {Encoding::utf8_with_mark, "UTF-8 with byte order mark"},
      {Encoding::utf16_little_endian, "UTF-16 LE"},
      {Encoding::utf16_big_endian, "UTF-16 BE"},
      {Encoding::latin1, "latin-1"},
  });
  return word_for(kNames, encoding);
}

std::string_view separator_name(char separator) noexcept {
  switch (separator) {
    case '\t':
      return "tab";
    case ';':
      return "semicolon";
    case ' ':
      return "blank";
    default:
      return "comma";
  }
}

DelimitedTable parse_delimited(std::string_view bytes, std::string_view where,
                               const DelimitedOptions& options) {
  Decoded decoded = decode(bytes, options.latin1, where);
  require_text(decoded.text, where);
  const auto text = std::make_shared<DelimitedText>();
  text->text = std::move(decoded.text);
  DelimitedTable table;
  table.text = text;
  table.encoding = decoded.encoding;
  table.separator = options.separator ? *options.separator : find_separator(text->text);
  table.rows = read_rows(*text, table.separator, where, options, table.comments);
  if (table.rows.empty()) throw bad_input(where, "no rows", "at least one row of fields");
  if (!options.ragged) require_same_width(table.rows, where);
  table.decimal_comma = options.decimal_comma.value_or(uses_decimal_comma(table.rows));
  if (table.decimal_comma && table.separator == ',' && text->unquoted.empty()) {
    throw bad_input(where, "the comma cannot be both separator and decimal sign",
                    "another separator, or numbers in quotes");
  }
  return table;
}

DelimitedTable read_delimited(const std::filesystem::path& path, const DelimitedOptions& options) {
  return parse_delimited(read_file(path), path.string(), options);
}

std::optional<double> find_field_number(std::string_view field, bool decimal_comma) {
  if (!decimal_comma) return find_number(field);
  if (field.find('.') != std::string_view::npos) return std::nullopt;
  std::string with_point(field);
  std::replace(with_point.begin(), with_point.end(), ',', '.');
  return find_number(with_point);
}

double parse_field(std::string_view field, bool decimal_comma, std::string_view where) {
  if (const auto number = find_field_number(field, decimal_comma)) return *number;
  // A point beside a decimal comma is a thousands mark or a mistake: refuse both.
  if (decimal_comma && field.find('.') != std::string_view::npos) {
    throw bad_input(where, fmt::format("'{}' has a point beside decimal commas", printable(field)),
                    "a number such as 12,5");
  }
  return parse_number(field, where);
}

bool is_number(std::string_view field, bool decimal_comma) {
  return find_field_number(field, decimal_comma).has_value();
}

std::string quoted_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos && !text.starts_with('#')) {
    return std::string(text);
  }
  std::string quoted(2 * text.size() + 2, '\0');
  quoted.resize(csv_write(quoted.data(), quoted.size(), text.data(), text.size()));
  return quoted;
}

}  // namespace tpm::files
