#include "tpm/files/import/column_title.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/header_words.hpp"
#include "tpm/files/unit_words.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

bool is_plain_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Units of what no recording of a force holds: in brackets they tell that a title means that.
bool is_foreign_unit(std::string_view text) {
  constexpr auto kForeign = std::to_array<std::string_view>(
      {"\xC2\xB0"
       "C",
       "degC", "deg C",
       "\xC2\xB0"
       "F",
       "degF", "V", "mV", "mA", "W", "J", "mJ", "Nm", "N m", "N.m", "mNm", "rpm", "1/min"});
  return std::find(kForeign.begin(), kForeign.end(), text) != kForeign.end();
}

/// True for a unit of what the title says, whatever its capitals.
bool is_unit_in_other_capitals(std::string_view name, std::string_view unit) {
  const auto meaning = recognize_title(name);
  return meaning && !units_in_any_case(unit, [&meaning](Dimension dimension) {
                       return is_dimension_of(*meaning, dimension);
                     }).empty();
}

/// Without brackets a single letter may be an index, except an "S" behind a time, and "Time Min"
/// the shortest time.
bool is_bare_unit_in_other_capitals(std::string_view name, std::string_view unit) {
  const auto meaning = recognize_title(name);
  const bool time = meaning && meaning->role == ColumnRole::time;
  if (unit.size() == 1 ? !time : unit == "MIN" || unit == "Min") return false;
  return is_unit_in_other_capitals(name, unit);
}

std::optional<ColumnTitle> split_before(std::string_view title, std::size_t end,
                                        std::size_t begin) {
  const std::string unit = written_unit(trimmed(title.substr(begin)));
  const std::string_view name = trimmed(title.substr(0, end));
  if (unit.empty() || is_plain_number(unit)) return std::nullopt;
  const bool known =
      is_unit(unit) || is_foreign_unit(unit) || is_bare_unit_in_other_capitals(name, unit);
  return known ? std::optional(ColumnTitle{std::string(name), unit}) : std::nullopt;
}

/// The text before and after the last separator, if a unit stands after it.
std::optional<ColumnTitle> split_at(std::string_view title, std::string_view separator) {
  const auto cut = title.rfind(separator);
  if (cut == std::string_view::npos || cut == 0) return std::nullopt;
  return split_before(title, cut, cut + separator.size());
}

/// Takes a title apart only if its name is known and its unit is one of what the name says.
std::optional<ColumnTitle> if_fitting(std::optional<ColumnTitle> split) {
  if (!split) return std::nullopt;
  const auto meaning = recognize_title(split->name);
  if (!meaning) return std::nullopt;
  const bool fits = is_unit(split->unit)
                        ? is_dimension_of(*meaning, parse_unit(split->unit, {}).dimension)
                        : is_unit_in_other_capitals(split->name, split->unit);
  return fits || is_foreign_unit(split->unit) ? split : std::nullopt;
}

/// A unit behind a mark that also stands inside names ("Force N", "Force/N", "step-1").
std::optional<ColumnTitle> split_known(std::string_view title, std::string_view separator) {
  return if_fitting(split_at(title, separator));
}

/// "forceN", "depthMm": the unit begins with the last capital behind a small letter.
std::optional<ColumnTitle> split_at_capital(std::string_view title) {
  for (std::size_t i = title.size(); i-- > 1;) {
    const auto is_small = [](char c) { return c >= 'a' && c <= 'z'; };
    const bool capital = title[i] >= 'A' && title[i] <= 'Z';
    if (capital && is_small(title[i - 1])) return if_fitting(split_before(title, i, i));
  }
  return std::nullopt;
}

/// "d/mm", "P mN": a unit behind the symbol of a quantity, unless both are one unit ("N/m").
std::optional<ColumnTitle> split_symbol(std::string_view title) {
  if (is_unit(title) || title.size() < 3 || (title[1] != '/' && title[1] != ' ')) {
    return std::nullopt;
  }
  const char symbol = title.front();
  const bool letter = (symbol >= 'a' && symbol <= 'z') || (symbol >= 'A' && symbol <= 'Z');
  const std::string unit = written_unit(trimmed(title.substr(2)));
  if (!letter || !is_unit(unit)) return std::nullopt;
  // "f" alone is a force, and "f/Hz" a frequency.
  const bool frequency = parse_unit(unit, {}).dimension == Dimension::frequency;
  if (recognize_title(title.substr(0, 1)) && !frequency) return std::nullopt;
  if (is_plain_number(unit)) return std::nullopt;
  return ColumnTitle{std::string(1, symbol), unit};
}

}  // namespace

std::string_view without_brackets(std::string_view cell) noexcept {
  const std::string_view text = trimmed(cell);
  const bool bracketed = text.size() > 1 && ((text.front() == '(' && text.back() == ')') ||
                                             (text.front() == '[' && text.back() == ']'));
  return bracketed ? trimmed(text.substr(1, text.size() - 2)) : text;
}

ColumnTitle split_title(std::string_view title) {
  std::string_view text = trimmed(title);
  while (text.starts_with('#') || text.starts_with('%')) text = trimmed(text.substr(1));
  const auto open = text.find_last_of("([");
  if (open != std::string_view::npos && open > 0) {
    // "Load (N) Ch. 1": the unit may stand inside the title.
    const auto close = text.find(text[open] == '[' ? ']' : ')', open);
    const std::string unit = close == std::string_view::npos
                                 ? std::string()
                                 : written_unit(trimmed(text.substr(open + 1, close - open - 1)));
    const bool square = text[open] == '[';
    std::string_view before = trimmed(text.substr(0, open));
    if (before.size() > 1 && before.back() == '/') {  // "J/(1/Pa)"
      before = trimmed(before.substr(0, before.size() - 1));
    }
    const bool number = is_plain_number(unit) && !(square && unit == "1");
    if (!unit.empty() && !number &&
        (square || is_unit(unit) || is_foreign_unit(unit) || force_of_weight(unit) ||
         is_unit_in_other_capitals(before, unit))) {
      const std::string_view after = trimmed(text.substr(close + 1));
      return {fmt::format("{}{}{}", before, after.empty() ? "" : " ", after), unit};
    }
  }
  for (const std::string_view separator : {" / ", ", ", " in ", " en ", "_"}) {
    if (auto split = split_at(text, separator)) return *split;
  }
  for (const std::string_view separator : {"/", ",", ":", " ", "-"}) {
    if (auto split = split_known(text, separator)) return *split;
  }
  if (auto split = split_at_capital(text)) return *split;
  if (auto split = split_symbol(text)) return *split;
  return {std::string(text), {}};
}

}  // namespace tpm::files
