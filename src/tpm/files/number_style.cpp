#include "tpm/files/number_style.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/delimited.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

constexpr auto kThousandsNames = std::to_array<Word<ThousandsMark>>({
    {ThousandsMark::none, "none"},
    {ThousandsMark::comma, "comma"},
    {ThousandsMark::point, "point"},
    {ThousandsMark::apostrophe, "apostrophe"},
    {ThousandsMark::space, "space"},
});

struct WrittenMark {
  std::string_view text;
  ThousandsMark mark;
};

constexpr auto kMarks = std::to_array<WrittenMark>({
    {",", ThousandsMark::comma},
    {".", ThousandsMark::point},
    {"'", ThousandsMark::apostrophe},
    {"\xE2\x80\x99", ThousandsMark::apostrophe},  // right single quotation mark
    {" ", ThousandsMark::space},
    {"\xC2\xA0", ThousandsMark::space},      // no-break space
    {"\xE2\x80\xAF", ThousandsMark::space},  // narrow no-break space
    {"\xE2\x80\x89", ThousandsMark::space},  // thin space
});

constexpr std::string_view kMinusSign = "\xE2\x88\x92";

bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}

constexpr std::size_t kMostMarks = 8;

/// A number taken apart: groups of digits with marks between them.
struct WrittenNumber {
  std::array<ThousandsMark, kMostMarks> marks{};
  std::array<std::size_t, kMostMarks + 1> digits{};  ///< of the group before each mark, and behind
  std::size_t count = 0;                             ///< of the marks
  bool leading_zero = false;
  bool exponent = false;

  [[nodiscard]] bool has(ThousandsMark mark) const {
    return std::find(marks.begin(), marks.begin() + static_cast<std::ptrdiff_t>(count), mark) !=
           marks.begin() + static_cast<std::ptrdiff_t>(count);
  }
};

std::string_view without_sign(std::string_view text) noexcept {
  if (text.starts_with(kMinusSign)) return text.substr(kMinusSign.size());
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
  return text;
}

/// "e5", "E-03"; false for anything else, also for nothing.
bool is_exponent(std::string_view text) noexcept {
  if (text.empty() || (text.front() != 'e' && text.front() != 'E')) return false;
  text = without_sign(text.substr(1));
  return !text.empty() && std::all_of(text.begin(), text.end(), is_digit);
}

std::optional<WrittenNumber> take_apart(std::string_view field) {
  std::string_view text = without_sign(field);
  WrittenNumber number;
  number.leading_zero = text.starts_with('0');
  std::size_t all = 0;
  while (!text.empty()) {
    if (is_digit(text.front())) {
      ++number.digits[number.count];
      ++all;
      text.remove_prefix(1);
      continue;
    }
    const auto* mark = std::find_if(kMarks.begin(), kMarks.end(),
                                    [&](const WrittenMark& m) { return text.starts_with(m.text); });
    if (mark != kMarks.end()) {
      if (number.count == kMostMarks) return std::nullopt;
      number.marks[number.count++] = mark->mark;
      text.remove_prefix(mark->text.size());
      continue;
    }
    if (all == 0 || !is_exponent(text)) return std::nullopt;
    number.exponent = true;
    break;
  }
  if (all == 0) return std::nullopt;
  return number;
}

/// "-12.5": a sign, digits and a point between them at most.
bool is_plain_decimal(std::string_view field) noexcept {
  if (!field.empty() && field.front() == '-') field.remove_prefix(1);
  if (field.empty() || !is_digit(field.front()) || !is_digit(field.back())) return false;
  bool point = false;
  for (const char c : field) {
    if (c == '.' && !point) {
      point = true;
    } else if (!is_digit(c)) {
      return false;
    }
  }
  return true;
}

std::string_view styled_field(const StyledColumn& column, std::size_t row) {
  const auto fields = column.first[row].fields;
  return column.index < fields.size() ? fields[column.index] : std::string_view();
}

ThousandsMark decimal_mark(bool comma) noexcept {
  return comma ? ThousandsMark::comma : ThousandsMark::point;
}

/// True if the marks of a number can be read with this decimal sign: all but it stand between
/// groups of three digits and are of one kind (`allowed`, or any if none is given).
bool fits(const WrittenNumber& number, bool decimal_comma, std::optional<ThousandsMark> allowed) {
  const ThousandsMark decimal = decimal_mark(decimal_comma);
  std::size_t groups = number.count;
  if (groups > 0 && number.marks[groups - 1] == decimal) --groups;
  constexpr std::size_t kGroup = 3;
  for (std::size_t i = 0; i < groups; ++i) {
    const ThousandsMark mark = number.marks[i];
    if (mark == decimal || mark != number.marks[0]) return false;
    if (allowed && mark != *allowed) return false;
    if (number.digits[i + 1] != kGroup) return false;
  }
  if (groups == 0) return true;
  const bool whole = groups == number.count;
  return number.digits[0] >= 1 && number.digits[0] <= kGroup && !number.leading_zero &&
         !(whole && number.exponent);
}

std::optional<double> value_in(std::string_view field, const WrittenNumber& number,
                               bool decimal_comma) {
  constexpr std::size_t kLongest = 64;
  if (field.size() > kLongest) return std::nullopt;
  std::string plain;
  plain.reserve(field.size());
  if (field.starts_with(kMinusSign)) plain += '-';
  const ThousandsMark decimal = decimal_mark(decimal_comma);
  std::size_t mark = 0;
  std::string_view text = field.starts_with(kMinusSign) ? field.substr(kMinusSign.size()) : field;
  while (!text.empty()) {
    const auto* written = std::find_if(kMarks.begin(), kMarks.end(), [&](const WrittenMark& m) {
      return text.starts_with(m.text);
    });
    if (written == kMarks.end()) {
      plain += text.front();
      text.remove_prefix(1);
      continue;
    }
    if (number.marks[mark++] == decimal) plain += '.';
    text.remove_prefix(written->text.size());
  }
  return find_number(plain);
}

/// Evidence of one column's numbers.
struct ColumnEvidence {
  const StyledColumn* column = nullptr;
  std::array<std::size_t, 2> sure{};    ///< numbers that only a decimal point, or comma, explains
  std::array<std::size_t, 2> either{};  ///< one point, or comma, before exactly three digits
  bool small = false;                   ///< a plain number other than 0 below 1000
  bool large = false;                   ///< a plain number of four digits or more

  /// The mark that fits both readings.
  [[nodiscard]] bool comma() const { return either[1] > 0; }
  [[nodiscard]] bool is_open() const {
    return sure[0] + sure[1] == 0 && (either[0] > 0) != (either[1] > 0);
  }
};

ColumnEvidence evidence_of(const StyledColumn& column) {
  ColumnEvidence found;
  found.column = &column;
  for (std::size_t row = 0; row < column.rows; ++row) {
    const std::string_view field = styled_field(column, row);
    const auto number = take_apart(field);
    if (!number) continue;
    if (number->count == 0) {
      constexpr std::size_t kThousand = 4;
      const bool large = number->digits[0] >= kThousand && !number->leading_zero;
      found.large |= large;
      found.small |= !large && field.find_first_of("123456789") != std::string_view::npos;
      continue;
    }
    const bool point = fits(*number, false, std::nullopt);
    const bool comma = fits(*number, true, std::nullopt);
    if (point && comma) {
      // A mark of thousands that is no decimal sign ("1'002") tells nothing.
      if (number->has(ThousandsMark::point)) ++found.either[0];
      if (number->has(ThousandsMark::comma)) ++found.either[1];
    } else if (point || comma) {
      ++found.sure[comma ? 1 : 0];
      break;  // one number is enough: a contradiction is refused where it is read
    }
  }
  return found;
}

/// Total variation of a curve as a multiple of its range.
double roughness(const StyledColumn& column, bool decimal_comma) {
  double path = 0.0, low = 0.0, high = 0.0, before = 0.0;
  bool first = true;
  for (std::size_t row = 0; row < column.rows; ++row) {
    const std::string_view field = styled_field(column, row);
    const auto number = take_apart(field);
    if (!number || !fits(*number, decimal_comma, std::nullopt)) continue;
    const auto value = value_in(field, *number, decimal_comma);
    if (!value) continue;
    if (first) low = high = *value;
    if (!first) path += std::abs(*value - before);
    low = std::min(low, *value);
    high = std::max(high, *value);
    before = *value;
    first = false;
  }
  return high > low ? path / (high - low) : 0.0;
}

/// True if the mark of an open column is its decimal sign; empty if both readings are as likely.
std::optional<bool> mark_is_decimal(const ColumnEvidence& column) {
  if (column.large) return true;  // 1000 stands there without a mark
  // Only numbers below 1000 beside marked ones can tell the readings apart.
  if (!column.small) return std::nullopt;
  constexpr double kClearly = 1.2;
  const double as_decimal = roughness(*column.column, column.comma());
  const double as_thousands = roughness(*column.column, !column.comma());
  if (as_thousands * kClearly < as_decimal) return false;
  if (as_decimal * kClearly < as_thousands) return true;
  return std::nullopt;
}

std::string choice_words(bool comma) {
  return fmt::format("--thousands {0} or --decimal {0}", comma ? "comma" : "point");
}

Error contradiction(std::string_view file, const StyledColumn& points, const StyledColumn& commas) {
  return bad_input(
      fmt::format("{}: {}, {}", file, points.label, commas.label),
      "one has decimal points, the other decimal commas (or marks of thousands)",
      "one style in the file, or --decimal and --thousands (point or comma, one each)");
}

/// The decimal sign that the columns agree on; none if no column has a mark. `told_by` is a column
/// of each vote.
std::optional<bool> voted_decimal_comma(std::span<const ColumnEvidence> columns,
                                        std::string_view file) {
  std::array<const StyledColumn*, 2> told_by{};
  const auto vote = [&](bool comma, const StyledColumn* column) {
    const StyledColumn*& by = told_by[comma ? 1 : 0];
    if (by == nullptr) by = column;
  };
  for (const ColumnEvidence& column : columns) {
    for (const bool comma : {false, true}) {
      if (column.sure[comma ? 1 : 0] > 0) vote(comma, column.column);
    }
  }
  const bool sure = told_by[0] != nullptr || told_by[1] != nullptr;
  const ColumnEvidence* open = nullptr;
  for (const ColumnEvidence& column : columns) {
    if (!column.is_open()) continue;
    const auto decimal = mark_is_decimal(column);
    if (!decimal && !sure && open == nullptr) open = &column;
    if (decimal) vote(*decimal == column.comma(), column.column);
  }
  if (told_by[0] != nullptr && told_by[1] != nullptr) {
    throw contradiction(file, *told_by[0], *told_by[1]);
  }
  if (told_by[0] != nullptr) return false;
  if (told_by[1] != nullptr) return true;
  if (open == nullptr) return std::nullopt;
  throw bad_input(
      fmt::format("{}: {}", file, open->column->label),
      fmt::format("all {} stand before three digits: they may be decimal signs or marks "
                  "of thousands",
                  open->comma() ? "commas" : "points"),
      choice_words(open->comma()));
}

/// The mark of thousands that the numbers show beside a decimal sign.
ThousandsMark shown_thousands(std::span<const StyledColumn> columns, bool decimal_comma) {
  for (const StyledColumn& column : columns) {
    for (std::size_t row = 0; row < column.rows; ++row) {
      const std::string_view field = styled_field(column, row);
      const auto number = take_apart(field);
      if (!number || number->count == 0 || !fits(*number, decimal_comma, std::nullopt)) continue;
      if (number->marks[0] != decimal_mark(decimal_comma)) return number->marks[0];
    }
  }
  return ThousandsMark::none;
}

}  // namespace

std::string_view thousands_name(ThousandsMark mark) noexcept {
  return word_for(kThousandsNames, mark);
}

ThousandsMark parse_thousands_name(std::string_view text, std::string_view where) {
  return parse_word(kThousandsNames, "mark of thousands", text, where);
}

std::optional<double> find_styled_number(std::string_view field, NumberStyle style) {
  if (!style.decimal_comma) {
    if (const auto plain = find_number(field)) return plain;
  }
  const auto number = take_apart(field);
  if (!number || !fits(*number, style.decimal_comma, style.thousands)) return std::nullopt;
  return value_in(field, *number, style.decimal_comma);
}

double parse_styled_number(std::string_view field, NumberStyle style, std::string_view where) {
  if (const auto number = find_styled_number(field, style)) return *number;
  if (!take_apart(field)) return parse_number(field, where);
  throw bad_input(
      where, fmt::format("'{}' does not fit the other numbers", printable(field)),
      fmt::format("a number with decimal {}s and {}", style.decimal_comma ? "comma" : "point",
                  style.thousands == ThousandsMark::none
                      ? std::string("no mark of thousands")
                      : fmt::format("marks of thousands ({})", thousands_name(style.thousands))));
}

bool is_number_in_some_style(std::string_view field) {
  if (is_plain_decimal(field)) return true;  // nearly all fields of nearly all files
  const auto number = take_apart(field);
  return number && (fits(*number, false, std::nullopt) || fits(*number, true, std::nullopt));
}

NumberStyle find_number_style(std::span<const StyledColumn> columns, const StyleChoice& choice,
                              std::string_view file) {
  NumberStyle style;
  std::optional<bool> comma = choice.decimal_comma;
  if (!comma && choice.thousands == ThousandsMark::comma) comma = false;
  if (!comma && choice.thousands == ThousandsMark::point) comma = true;
  if (!comma) {
    std::vector<ColumnEvidence> evidence;
    evidence.reserve(columns.size());
    for (const StyledColumn& column : columns) evidence.push_back(evidence_of(column));
    comma = voted_decimal_comma(evidence, file);
  }
  style.decimal_comma = comma.value_or(false);
  style.thousands = choice.thousands.value_or(shown_thousands(columns, style.decimal_comma));
  if (style.thousands == decimal_mark(style.decimal_comma)) {
    throw bad_input(file,
                    fmt::format("the {} cannot be both decimal sign and mark of thousands",
                                thousands_name(style.thousands)),
                    "--decimal and --thousands with different signs");
  }
  return style;
}

}  // namespace tpm::files
