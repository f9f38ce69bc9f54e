#include "tpm/files/import/column_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/clock_text.hpp"
#include "tpm/files/import/refused_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

/// Titles of the same column of several specimens: without their number.
std::string title_key(const MachineColumn& column) {
  std::string key = column.name;
  const auto last = key.find_last_not_of("0123456789 _#()[]");
  key.resize(last == std::string::npos ? 0 : last + 1);
  return fmt::format("{}/{}", static_cast<int>(column.meaning->role), key);
}

double si_factor(const MachineColumn& column) {
  return is_unit(column.unit) ? parse_unit(column.unit, {}).to_si : 1.0;
}

std::string_view noun_of(ColumnRole role) noexcept {
  switch (role) {
    case ColumnRole::time:
      return "the time";
    case ColumnRole::drive:
    case ColumnRole::height:
      return "what was imposed";
    case ColumnRole::response:
    case ColumnRole::deflection:
      return "the response";
    case ColumnRole::sd:
      return "the standard deviation";
    case ColumnRole::frequency:
      return "the frequency";
    default:
      return "this part of the spectrum";
  }
}

}  // namespace

std::optional<double> find_cell_number(std::string_view field, NumberStyle style) {
  if (const auto number = find_styled_number(field, style)) return number;
  return find_clock_seconds(field);
}

ColumnChoice::ColumnChoice(const DelimitedTable& table, const MachineHeader& header,
                           const std::string& file)
    : table_(table), header_(header), file_(file), of_others_(header.columns.size(), false) {
  count_specimens();
}

/// Each title that means something stands there as often as every other one.
void ColumnChoice::count_specimens() {
  std::map<std::string, std::vector<std::size_t>> places;
  for (const MachineColumn& column : header_.columns) {
    if (!column.meaning) continue;
    places[title_key(column)].push_back(column.index);
  }
  constexpr std::size_t kLeastTitles = 2;
  if (places.size() < kLeastTitles) return;
  const std::size_t times = places.begin()->second.size();
  const bool alike = std::all_of(places.begin(), places.end(), [times](const auto& title) {
    return title.second.size() == times;
  });
  if (!alike || times < 2) return;
  specimens_ = times;
  for (const auto& [key, columns] : places) {
    for (std::size_t i = 1; i < columns.size(); ++i) of_others_[columns[i]] = true;
  }
}

std::string ColumnChoice::list() const {
  const auto labels = mapped<std::string>(header_.columns, &MachineColumn::label);
  return printable(fmt::format("{}", fmt::join(labels, ", ")), 200);
}

std::string ColumnChoice::list_of(std::initializer_list<Dimension> may_be,
                                  std::initializer_list<const MachineColumn*> without) const {
  std::vector<std::string> labels;
  for (const MachineColumn& column : header_.columns) {
    if (std::ranges::find(without, &column) != without.end()) continue;
    if (names_another_quantity(title_words(column.title))) continue;
    const bool known = is_unit(column.unit);
    const auto fits = [&column](Dimension d) { return parse_unit(column.unit, {}).dimension == d; };
    if (known && std::ranges::none_of(may_be, fits)) continue;
    labels.push_back(column.label());
  }
  return printable(fmt::format("{}", fmt::join(labels, ", ")), 200);
}

const MachineColumn& ColumnChoice::by_selector(const std::string& selector) const {
  for (const MachineColumn& column : header_.columns) {
    if (selector == column.name || selector == column.title) return column;
  }
  for (const MachineColumn& column : header_.columns) {
    if (column.has_number(selector)) return column;
  }
  const auto names = mapped<std::string>(header_.columns, &MachineColumn::name);
  throw bad_input(
      file_, fmt::format("no column '{}'{}", printable(selector), did_you_mean(selector, names)),
      list());
}

void ColumnChoice::require_column_for_unit(const std::string& selector) const {
  const bool named =
      std::any_of(header_.columns.begin(), header_.columns.end(),
                  [&selector](const MachineColumn& column) { return column.is_named(selector); });
  if (named) return;
  const auto names = mapped<std::string>(header_.columns, &MachineColumn::name);
  throw bad_input(file_,
                  fmt::format("no column '{}', which --unit names{}", printable(selector),
                              did_you_mean(selector, names)),
                  list());
}

/// Up to rounding, in SI.
bool ColumnChoice::same_numbers(const MachineColumn& a, const MachineColumn& b) const {
  constexpr double kRounding = 1e-4;  // of the range
  double farthest = 0.0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = header_.block.first; i < header_.block.end; ++i) {
    const auto x = find_cell_number(field_at(table_.rows[i], a.index), header_.style);
    const auto y = find_cell_number(field_at(table_.rows[i], b.index), header_.style);
    if (x.has_value() != y.has_value()) return false;
    if (!x) continue;
    const double first = *x * si_factor(a);
    farthest = std::max(farthest, std::abs(first - *y * si_factor(b)));
    low = std::min(low, first);
    high = std::max(high, first);
  }
  return farthest <= kRounding * std::max(high - low, 0.0) || farthest == 0.0;
}

bool ColumnChoice::rises(const MachineColumn& column) const {
  double before = -std::numeric_limits<double>::infinity();
  for (std::size_t i = header_.block.first; i < header_.block.end; ++i) {
    const auto value = find_cell_number(field_at(table_.rows[i], column.index), header_.style);
    if (!value) continue;
    if (*value <= before) return false;
    before = *value;
  }
  return true;
}

const MachineColumn* ColumnChoice::by_title(ColumnRole role, const char* option,
                                            const Condition& condition) const {
  std::vector<const MachineColumn*> known;
  for (const MachineColumn& column : header_.columns) {
    if (!column.meaning || column.meaning->role != role || of_others_[column.index]) continue;
    if (condition && !condition(column)) continue;
    // The time of a step starts anew with each of them: over several it is no time of the file.
    if (role == ColumnRole::time && column.meaning->rank < 0 && !rises(column)) continue;
    known.push_back(&column);
  }
  const bool fits = std::any_of(known.begin(), known.end(), [](auto* c) { return !c->misfit; });
  if (fits) std::erase_if(known, [](const MachineColumn* c) { return c->misfit; });
  const MachineColumn* best = nullptr;
  for (const MachineColumn* column : known) {
    if (best == nullptr || column->meaning->rank < best->meaning->rank) best = column;
  }
  for (const MachineColumn* column : known) {
    if (column == best || column->meaning->rank != best->meaning->rank) continue;
    if (same_numbers(*best, *column)) continue;
    throw bad_input(file_,
                    fmt::format("{} and {} may both be {}, and hold different numbers",
                                best->label(), column->label(), noun_of(role)),
                    fmt::format("{0} {1} or {0} {2}", option, best->index + 1, column->index + 1));
  }
  return best;
}

const MachineColumn* ColumnChoice::find(ColumnRole role, const std::string& selector,
                                        const char* option) const {
  if (!selector.empty()) return &by_selector(selector);
  return by_title(role, option);
}

bool ColumnChoice::is_clock(const MachineColumn& column) const {
  for (std::size_t i = header_.block.first; i < header_.block.end; ++i) {
    const std::string_view field = field_at(table_.rows[i], column.index);
    if (!field.empty()) return is_clock_text(field);
  }
  return false;
}

const MachineColumn* ColumnChoice::lone_clock() const {
  const MachineColumn* lone = nullptr;
  for (const MachineColumn& column : header_.columns) {
    if (column.meaning || column.refused || !is_clock(column)) continue;
    if (lone != nullptr) return nullptr;
    lone = &column;
  }
  return lone;
}

const MachineColumn* ColumnChoice::refused(ColumnRole role) const {
  for (const MachineColumn& column : header_.columns) {
    const bool asked = column.refused && column.refused->asked;
    if (asked && column.refused->meaning.role == role) return &column;
  }
  return nullptr;
}

}  // namespace tpm::files
