#include "tpm/files/import/machine_header.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpmkit/error.hpp"

namespace tpm::files {

std::string MachineColumn::label() const {
  return name.empty() ? fmt::format("column {}", index + 1)
                      : fmt::format("column {} '{}'", index + 1, printable(name));
}

namespace {

bool holds_samples(const DelimitedRow& row, bool decimal_comma) {
  std::size_t filled = 0;
  std::size_t numbers = 0;
  for (const std::string_view field : row.fields) {
    if (field.empty()) continue;
    ++filled;
    if (is_number(field, decimal_comma)) ++numbers;
  }
  return numbers >= 2 && 2 * numbers > filled;
}

std::size_t count_header_rows(const DelimitedTable& table, const std::string& file) {
  const auto& rows = table.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    // One row of numbers may be specimen data in the header; samples come in rows of one width.
    const bool last = i + 1 == rows.size();
    if (holds_samples(rows[i], table.decimal_comma) &&
        (last || (rows[i].fields.size() == rows[i + 1].fields.size() &&
                  holds_samples(rows[i + 1], table.decimal_comma)))) {
      return i;
    }
  }
  throw bad_input(file, "no row with two or more numbers",
                  "samples, or another separator or decimal sign");
}

bool is_bracketed(std::string_view cell) {
  return without_brackets(cell).size() < cell.size();
}

/// A row of units: all cells are units or stand in brackets, or at least half of them are units and
/// none is a title. A cell that is no unit is refused by whoever reads its column.
bool is_unit_row(const DelimitedRow& row) {
  std::size_t filled = 0, units = 0, brackets = 0, titles = 0;
  for (const std::string_view field : row.fields) {
    if (field.empty() || field == "-") continue;
    ++filled;
    const bool unit = is_unit(without_brackets(field));
    if (unit) ++units;
    if (is_bracketed(field)) ++brackets;
    if (!unit && recognize_title(split_title(field).name)) ++titles;
  }
  if (filled == 0) return false;
  return units == filled || brackets == filled || (2 * units >= filled && titles == 0);
}

bool is_blank(const DelimitedRow& row) {
  return std::all_of(row.fields.begin(), row.fields.end(),
                     [](std::string_view field) { return field.empty(); });
}

std::size_t recognized_titles(const DelimitedRow& row) {
  return static_cast<std::size_t>(std::count_if(
      row.fields.begin(), row.fields.end(),
      [](std::string_view field) { return recognize_title(split_title(field).name).has_value(); }));
}

std::string field_or_empty(const DelimitedRow& row, std::size_t index) {
  return std::string(index < row.fields.size() ? row.fields[index] : std::string_view());
}

/// A row above the titles that repeats one text names the sheet.
std::string sheet_name(const DelimitedRow& row) {
  std::string name;
  for (const std::string_view field : row.fields) {
    if (field.empty()) continue;
    if (!name.empty() && field != name) return {};
    name = field;
  }
  return name;
}

/// Units given by name or number go before those of the file.
std::string chosen_unit(const MachineColumn& column, const ImportOptions& options) {
  for (const auto& [selector, unit] : options.units) {
    if (selector == column.name || selector == std::to_string(column.index + 1)) return unit;
  }
  return column.unit;
}

/// Where titles and units stand; null if nowhere.
struct HeaderRows {
  const DelimitedRow* titles = nullptr;
  const DelimitedRow* units = nullptr;
};

/// Units and titles stand in any order, with blank rows and rows of other things between them.
/// Titles are the row with the most names that are known; of several, the one nearest to the
/// samples.
HeaderRows header_rows(const DelimitedTable& table, std::size_t count) {
  HeaderRows found;
  std::size_t most = 0;
  for (std::size_t i = count; i-- > 0;) {
    const DelimitedRow& row = table.rows[i];
    if (is_blank(row)) continue;
    if (is_unit_row(row)) {
      if (found.units == nullptr) found.units = &row;
      continue;
    }
    const std::size_t names = recognized_titles(row);
    if (found.titles != nullptr && names <= most) continue;
    found.titles = &row;
    most = names;
  }
  return found;
}

/// What the unit says of a column whose title says nothing or something else: "f [Hz]", "w
/// [rad/s]", "J [1/Pa]"; with a time beside it "G [Pa]" and "E [Pa]" are relaxation moduli.
void recognize_by_unit(MachineColumn& column, bool timed) {
  if (!is_unit(column.unit)) return;
  const Dimension dimension = parse_unit(column.unit, {}).dimension;
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

}  // namespace

MachineHeader read_machine_header(const DelimitedTable& table, const std::string& file,
                                  const ImportOptions& options) {
  MachineHeader header;
  header.rows = options.header_rows ? static_cast<std::size_t>(*options.header_rows)
                                    : count_header_rows(table, file);
  if (header.rows >= table.rows.size()) {
    throw bad_input(file,
                    fmt::format("{} header rows but only {} rows", header.rows, table.rows.size()),
                    "samples below the header");
  }
  const HeaderRows rows = header_rows(table, header.rows);
  for (std::size_t i = header.rows; i-- > 0 && header.sheet.empty();) {
    const DelimitedRow& row = table.rows[i];
    if (&row != rows.units && &row != rows.titles) header.sheet = sheet_name(row);
  }
  for (std::size_t i = 0; i < table.rows[header.rows].fields.size(); ++i) {
    const ColumnTitle title =
        split_title(rows.titles == nullptr ? std::string() : field_or_empty(*rows.titles, i));
    const std::string cell = rows.units == nullptr ? std::string() : field_or_empty(*rows.units, i);
    const std::string unit(without_brackets(cell));
    MachineColumn column{i, title.name, unit.empty() ? title.unit : unit,
                         recognize_title(title.name)};
    column.unit = chosen_unit(column, options);
    const bool per_second = is_unit(column.unit) && parse_unit(column.unit, {}).symbol == "Hz" &&
                            column.unit.find("Hz") == std::string::npos;
    if (per_second && is_angular(column.name)) column.unit = "rad/s";
    header.columns.push_back(std::move(column));
  }
  const bool timed =
      std::any_of(header.columns.begin(), header.columns.end(), [](const MachineColumn& column) {
        return column.meaning && column.meaning->role == ColumnRole::time;
      });
  for (MachineColumn& column : header.columns) recognize_by_unit(column, timed);
  return header;
}

}  // namespace tpm::files
