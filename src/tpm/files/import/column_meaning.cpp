#include "tpm/files/import/column_meaning.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tpm/files/unit_words.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

/// Sizes of the specimen, which no machine moves.
bool is_size_of_specimen(std::string_view name) {
  constexpr auto kSizes = std::to_array<std::string_view>(
      {"thick", "width", "diameter", "radius", "gauge", "gage", "dicke", "breite", "durchmesser",
       "radio", "rayon", "epaisseur", "largeur"});
  std::string small(name);
  std::ranges::transform(small, small.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::any_of(
      kSizes, [&small](std::string_view size) { return small.find(size) != std::string::npos; });
}

constexpr int kLast = 9;  // behind every title
constexpr Recognized kLoneTime{ColumnRole::time, Quantity::time, kLast};
constexpr Recognized kLoneDrive{ColumnRole::drive, Quantity::indentation_depth, kLast};
constexpr Recognized kLoneForce{ColumnRole::response, Quantity::contact_force, kLast};

std::optional<Recognized> meaning_of_dimension(Dimension dimension) {
  if (dimension == Dimension::time) return kLoneTime;
  if (dimension == Dimension::length) return kLoneDrive;
  return dimension == Dimension::force ? std::optional(kLoneForce) : std::nullopt;
}

/// The title says what a spectrum holds and its unit says otherwise: "delta [mm]" is no phase.
bool is_misread_letter(const MachineColumn& column) {
  if (!column.misfit || !column.meaning || !is_unit(column.unit)) return false;
  switch (column.meaning->role) {
    case ColumnRole::frequency:
    case ColumnRole::storage:
    case ColumnRole::loss:
    case ColumnRole::magnitude:
    case ColumnRole::phase:
    case ColumnRole::loss_tangent:
      return true;
    default:
      return false;
  }
}

/// The only column without a meaning that has a unit of this dimension.
MachineColumn* lone_column(std::vector<MachineColumn>& columns, Dimension dimension) {
  MachineColumn* lone = nullptr;
  for (MachineColumn& column : columns) {
    const bool known = column.meaning && !is_misread_letter(column);
    if (known || column.refused || is_size_of_specimen(column.name)) continue;
    if (!is_unit(column.unit) || parse_unit(column.unit, {}).dimension != dimension) continue;
    if (lone != nullptr) return nullptr;
    lone = &column;
  }
  return lone;
}

}  // namespace

void recognize_by_unit(MachineColumn& column, bool timed) {
  if (!is_unit(column.unit)) return;
  const Dimension dimension = parse_unit(column.unit, {}).dimension;
  const bool axis = column.meaning && (column.meaning->quantity == Quantity::abscissa ||
                                       column.meaning->quantity == Quantity::ordinate);
  const bool imposed = column.meaning && column.meaning->role == ColumnRole::drive;
  const bool observed = column.meaning && column.meaning->role == ColumnRole::response;
  if (axis && (imposed || observed)) {
    if (const auto meaning = meaning_of_dimension(dimension)) column.meaning = meaning;
  }
  const bool letter = column.name.size() == 1;
  const bool named = column.unit.find("Hz") != std::string::npos ||
                     column.unit.find("rad") != std::string::npos;  // 1/s may be a shear rate
  if (dimension == Dimension::frequency && named && (!column.meaning || letter)) {
    column.meaning = Recognized{ColumnRole::frequency, Quantity::frequency, 1};
  }
  if (column.meaning) return;
  if (dimension == Dimension::compliance) {
    column.meaning = Recognized{ColumnRole::response, Quantity::creep_compliance, 3};
  }
  const bool modulus = column.name == "G" || column.name == "E";
  if (timed && modulus && dimension == Dimension::stress) {
    column.meaning = Recognized{ColumnRole::response, Quantity::relaxation_modulus, 3};
  }
}

void recognize_lone_columns(std::vector<MachineColumn>& columns) {
  const auto has = [&columns](std::initializer_list<ColumnRole> roles) {
    return std::ranges::any_of(columns, [roles](const MachineColumn& column) {
      return column.meaning && std::ranges::find(roles, column.meaning->role) != roles.end();
    });
  };
  std::vector<std::pair<MachineColumn*, Recognized>> found;
  const auto add = [&](std::initializer_list<ColumnRole> roles, Dimension dimension) {
    if (has(roles)) return true;
    found.emplace_back(lone_column(columns, dimension), meaning_of_dimension(dimension).value());
    return found.back().first != nullptr;
  };
  const bool all = add({ColumnRole::time}, Dimension::time) &&
                   add({ColumnRole::drive, ColumnRole::height}, Dimension::length) &&
                   add({ColumnRole::response, ColumnRole::deflection}, Dimension::force);
  if (!all) return;
  for (const auto& [column, meaning] : found) {
    column->meaning = meaning;
    column->misfit = false;
  }
}

void doubt_capital_t(MachineColumn& column) {
  const std::string name = column.name.substr(0, column.name.find_first_of(" ([0123456789"));
  if (name != "T" || !column.meaning || column.meaning->role != ColumnRole::time) return;
  if (is_unit(column.unit) && parse_unit(column.unit, {}).dimension == Dimension::time) return;
  if (column.unit.empty() && column.name.find('(') == std::string::npos) {
    column.meaning->rank = 1;
    return;
  }
  column.refused = RefusedTitle{*column.meaning, "'T' may be a temperature"};
  column.meaning.reset();
}

void doubt_unit(MachineColumn& column) {
  if (!column.meaning || column.unit.empty()) return;
  const bool fits = is_unit(column.unit) &&
                    is_dimension_of(*column.meaning, parse_unit(column.unit, {}).dimension);
  column.misfit = !fits && column.meaning->role != ColumnRole::deflection;
}

void read_capitals_of_unit(MachineColumn& column) {
  if (!column.meaning || column.unit.empty() || column.unit_is_chosen) return;
  const auto fits = [&column](Dimension dimension) {
    return is_dimension_of(*column.meaning, dimension);
  };
  std::vector<std::string> readings = units_in_any_case(column.unit, fits);
  const auto has_small = [](std::string_view text) {
    return std::ranges::any_of(text, [](char c) { return c >= 'a' && c <= 'z'; });
  };
  // In "STRESS [PA]" nothing tells the capitals apart, and no specimen bears meganewtons.
  const bool shouted = !has_small(column.unit) && !has_small(column.name) && column.name.size() > 1;
  const bool as_written =
      column.unit != "MN" && std::ranges::find(readings, column.unit) != readings.end();
  if (readings.empty() || (as_written && !shouted)) return;
  if (readings.size() == 1) {
    column.unit = readings.front();
  } else {
    column.unit_readings = std::move(readings);
  }
}

}  // namespace tpm::files
