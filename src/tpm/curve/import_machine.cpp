#include "tpm/curve/import_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/curve/contact.hpp"
#include "tpm/curve/header_words.hpp"

namespace tpm {
namespace {

/// A column as the header shows it.
struct Column {
  std::size_t index;
  std::string name;  ///< may be empty
  std::string unit;  ///< may be empty
  std::optional<Recognized> meaning;

  [[nodiscard]] std::string label() const {
    return name.empty() ? fmt::format("column {}", index + 1)
                        : fmt::format("column {} '{}'", index + 1, printable(name));
  }
};

struct Header {
  std::size_t rows = 0;
  std::string sheet;
  std::vector<Column> columns;
};

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
std::string chosen_unit(const Column& column, const ImportOptions& options) {
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

Header read_header(const DelimitedTable& table, const std::string& file,
                   const ImportOptions& options) {
  Header header;
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
    Column column{i, title.name, unit.empty() ? title.unit : unit, recognize_title(title.name)};
    column.unit = chosen_unit(column, options);
    const bool per_second = is_unit(column.unit) && parse_unit(column.unit, {}).symbol == "Hz" &&
                            column.unit.find("Hz") == std::string::npos;
    if (per_second && is_angular(column.name)) column.unit = "rad/s";
    header.columns.push_back(std::move(column));
  }
  return header;
}

std::string column_list(const Header& header) {
  std::string list;
  for (const Column& column : header.columns) {
    list += fmt::format("{}{}", list.empty() ? "" : ", ", column.label());
  }
  return printable(list, 200);
}

const Column& column_by_selector(const Header& header, const std::string& selector,
                                 const std::string& file) {
  for (const Column& column : header.columns) {
    if (column.name == selector) return column;
  }
  std::size_t number = 0;
  const char* end = selector.data() + selector.size();
  const auto parsed = std::from_chars(selector.data(), end, number);
  if (parsed.ec == std::errc{} && parsed.ptr == end && number >= 1 &&
      number <= header.columns.size()) {
    return header.columns[number - 1];
  }
  throw bad_input(file, fmt::format("no column '{}'", printable(selector)), column_list(header));
}

const Column* column_by_title(const Header& header, ColumnRole role) {
  const Column* best = nullptr;
  for (const Column& column : header.columns) {
    if (!column.meaning || column.meaning->role != role) continue;
    if (best == nullptr || column.meaning->rank < best->meaning->rank) best = &column;
  }
  return best;
}

const Column* find_column(const Header& header, ColumnRole role, const std::string& selector,
                          const std::string& file) {
  if (!selector.empty()) return &column_by_selector(header, selector, file);
  return column_by_title(header, role);
}

/// What to add to the command line. The unit itself is for the user to say.
std::string unit_option(const Column& column, Dimension dimension) {
  const std::string units = units_of(dimension);
  return fmt::format(
      "--unit \"{}=UNIT\" with a unit of {}{}{}",
      column.name.empty() ? std::to_string(column.index + 1) : printable(column.name),
      dimension_name(dimension), units.empty() ? "" : ": ", units);
}

Unit unit_of(const Column& column, Dimension dimension, const std::string& file) {
  const std::string where = fmt::format("{}: {}", file, column.label());
  if (is_unit(column.unit) || column.unit.empty()) return parse_unit(column.unit, dimension, where);
  throw bad_input(where, fmt::format("unknown unit '{}'", printable(column.unit)),
                  unit_option(column, dimension));
}

/// A column that is going to be read.
struct Use {
  const Column* column;
  Quantity quantity;
  Bound bound;
  bool negate;
  std::optional<Dimension> dimension = std::nullopt;  ///< if it is not that of the quantity
};

Dimension dimension_of(const Use& use) {
  return use.dimension.value_or(quantity_dimension(use.quantity));
}

/// One message for all columns: what to add to the command line is said once.
void require_units(const std::vector<Use>& uses, const std::string& file) {
  std::string labels;
  std::string options;
  std::size_t missing = 0;
  for (const Use& use : uses) {
    const Dimension dimension = dimension_of(use);
    if (!use.column->unit.empty() || dimension == Dimension::dimensionless) continue;
    ++missing;
    labels += fmt::format("{}{}", labels.empty() ? "" : ", ", use.column->label());
    options +=
        fmt::format("{}{}", options.empty() ? "" : "; ", unit_option(*use.column, dimension));
  }
  if (missing == 0) return;
  throw bad_input(fmt::format("{}: {}", file, labels),
                  missing == 1 ? "has no unit" : "have no unit", options);
}

/// A column titled "F" in kPa holds a stress: the unit says what the title cannot.
Quantity response_quantity(const Column& column, const ImportOptions& options) {
  if (options.response_quantity) return *options.response_quantity;
  const Quantity titled = column.meaning && column.meaning->role == ColumnRole::response
                              ? column.meaning->quantity
                              : Quantity::contact_force;
  if (is_step_response(titled)) return titled;
  const auto dimension = is_unit(column.unit)
                             ? std::optional(parse_unit(column.unit, column.name).dimension)
                             : std::nullopt;
  if (dimension == Dimension::compliance) return Quantity::creep_compliance;
  if (dimension == Dimension::stress) return Quantity::stress;
  return titled;
}

/// Storage and loss in N/m are dynamic stiffnesses, else moduli.
Quantity spectrum_quantity(const Column& column, bool loss) {
  const bool stiffness = is_unit(column.unit) &&
                         parse_unit(column.unit, column.name).dimension == Dimension::stiffness;
  const auto known = spectrum_quantities(stiffness ? Dimension::stiffness : Dimension::stress);
  return loss ? known.loss : known.storage;
}

Quantity drive_quantity(const Column& column, const ImportOptions& options) {
  if (options.drive_quantity) return *options.drive_quantity;
  return column.meaning && column.meaning->role == ColumnRole::drive ? column.meaning->quantity
                                                                     : Quantity::indentation_depth;
}

std::string finding_name(const Use& use) {
  if (use.dimension == Dimension::angle) return "phase_angle";
  if (use.column->meaning && use.column->meaning->role == ColumnRole::loss_tangent) {
    return "loss_tangent";
  }
  return std::string(quantity_name(use.quantity));
}

/// Builds the series column by column and says which column became what.
class SeriesReader {
 public:
  SeriesReader(const DelimitedTable& table, const Header& header, const std::string& file)
      : table_(table), header_(header), file_(file) {
    series_.lines.reserve(table.rows.size() - header.rows);
    for (std::size_t i = header.rows; i < table.rows.size(); ++i) {
      if (table.rows[i].fields.size() != header.columns.size()) {
        throw bad_input(fmt::format("{}:{}", file, table.rows[i].line),
                        fmt::format("{} fields in this row", table.rows[i].fields.size()),
                        fmt::format("{} as in the first row of samples", header.columns.size()));
      }
      series_.lines.push_back(table.rows[i].line);
    }
  }

  void add(const Use& use) {
    const Column& column = *use.column;
    const Bound bound = use.bound;
    const bool negate = use.negate;
    ImportedColumn imported;
    imported.quantity = use.quantity;
    imported.bound = bound;
    imported.unit = unit_of(column, dimension_of(use), file_);
    imported.values.reserve(series_.lines.size());
    for (std::size_t i = header_.rows; i < table_.rows.size(); ++i) {
      const DelimitedRow& row = table_.rows[i];
      const double value = parse_field_at(row.fields[column.index], table_.decimal_comma, [&] {
        return fmt::format("{}:{}: {}", file_, row.line, column.label());
      });
      imported.values.push_back(negate ? 0.0 - value : value);  // 0, not -0
    }
    series_.findings.push_back(
        {bound == Bound::sd ? "standard deviation" : finding_name(use),
         fmt::format("{}, {}{}", column.label(),
                     imported.unit.symbol.empty() ? "plain number" : imported.unit.symbol,
                     negate ? ", negated" : "")});
    used_.push_back(column.index);
    series_.columns.push_back(std::move(imported));
  }

  [[nodiscard]] ImportedSeries take() {
    std::string unused;
    for (const Column& column : header_.columns) {
      if (std::find(used_.begin(), used_.end(), column.index) != used_.end()) continue;
      unused += fmt::format("{}{}", unused.empty() ? "" : ", ", column.label());
    }
    if (!unused.empty()) series_.findings.push_back({"not used", printable(unused, 200)});
    return std::move(series_);
  }

 private:
  const DelimitedTable& table_;
  const Header& header_;
  const std::string& file_;
  ImportedSeries series_;
  std::vector<std::size_t> used_;
};

/// The columns of a spectrum, nothing if the file holds something else: a frequency alone may be
/// that of the sampling, and a column that is named as time, drive or response says what is meant.
std::vector<Use> spectrum_uses(const Header& header, const std::string& file,
                               const ImportOptions& options) {
  const bool chosen = !options.frequency_column.empty() || !options.storage_column.empty() ||
                      !options.loss_column.empty();
  const bool recording = !options.time_column.empty() || !options.drive_column.empty() ||
                         !options.response_column.empty();
  if (recording && !chosen) return {};
  const Column* frequency =
      find_column(header, ColumnRole::frequency, options.frequency_column, file);
  const Column* storage = find_column(header, ColumnRole::storage, options.storage_column, file);
  const Column* loss = find_column(header, ColumnRole::loss, options.loss_column, file);
  const Column* magnitude = chosen ? nullptr : column_by_title(header, ColumnRole::magnitude);
  const Column* angle = chosen ? nullptr : column_by_title(header, ColumnRole::phase);
  const Column* tangent = chosen ? nullptr : column_by_title(header, ColumnRole::loss_tangent);
  const bool polar = magnitude != nullptr && (angle != nullptr || tangent != nullptr);
  if (!chosen && (frequency == nullptr || (storage == nullptr && loss == nullptr && !polar))) {
    return {};
  }
  if (frequency != nullptr && storage != nullptr && loss == nullptr && tangent != nullptr) {
    return {{frequency, Quantity::frequency, Bound::value, false},
            {storage, spectrum_quantity(*storage, false), Bound::value, false},
            {tangent, Quantity::abscissa, Bound::value, false}};
  }
  if (polar && storage == nullptr && loss == nullptr) {
    Use second{angle, Quantity::abscissa, Bound::value, false, Dimension::angle};
    if (angle == nullptr) second = {tangent, Quantity::abscissa, Bound::value, false};
    return {{frequency, Quantity::frequency, Bound::value, false},
            {magnitude, spectrum_quantity(*magnitude, false), Bound::value, false},
            second};
  }
  for (const auto& [column, words, option] : {std::tuple{frequency, "a frequency", "--frequency"},
                                              std::tuple{storage, "a storage modulus", "--storage"},
                                              std::tuple{loss, "a loss modulus", "--loss"}}) {
    if (column != nullptr) continue;
    throw bad_input(file, fmt::format("no column is recognised as {}", words),
                    fmt::format("{} with one of {}", option, column_list(header)));
  }
  return {{frequency, Quantity::frequency, Bound::value, false},
          {storage, spectrum_quantity(*storage, false), Bound::value, false},
          {loss, spectrum_quantity(*loss, true), Bound::value, false}};
}

/// Storage and loss from the magnitude, or the storage, and from the phase angle or its tangent.
void resolve_phase(ImportedSeries& series, const std::vector<Use>& uses) {
  ImportedColumn& first = series.columns.at(1);
  ImportedColumn& second = series.columns.at(2);
  if (second.quantity != Quantity::abscissa) return;
  const bool polar = uses[1].column->meaning->role == ColumnRole::magnitude;
  const bool angle = second.unit.dimension == Dimension::angle;
  for (std::size_t i = 0; i < first.values.size(); ++i) {
    const double given = second.values[i] * second.unit.to_si;
    const double delta = angle ? given : std::atan(given);
    const double size = polar ? first.values[i] : first.values[i] / std::cos(delta);
    if (polar) first.values[i] = size * std::cos(delta);
    second.values[i] = size * std::sin(delta);
  }
  first.shifted = polar;
  second.shifted = true;  // converted: not the digits of the file
  second.quantity = spectrum_quantities(first.unit.dimension).loss;
  second.unit = first.unit;
  series.findings.push_back({"converted", polar ? "magnitude and phase to storage and loss"
                                                : "storage and loss tangent to loss"});
}

std::vector<Use> recording_uses(const Header& header, const std::string& file,
                                const ImportOptions& options) {
  const Column* time = find_column(header, ColumnRole::time, options.time_column, file);
  const Column* drive = find_column(header, ColumnRole::drive, options.drive_column, file);
  const Column* response = find_column(header, ColumnRole::response, options.response_column, file);
  const Column* sd = find_column(header, ColumnRole::sd, options.sd_column, file);
  if (response == nullptr) {
    throw bad_input(file, "no column is recognised as a force, stress, modulus or compliance",
                    fmt::format("--response with one of {}", column_list(header)));
  }
  if (time == nullptr && drive == nullptr) {
    throw bad_input(file, "no column is recognised as time or displacement",
                    fmt::format("--time or --drive with one of {}", column_list(header)));
  }

  const Quantity observed = response_quantity(*response, options);
  std::vector<Use> uses;
  if (time != nullptr) uses.push_back({time, Quantity::time, Bound::value, false});
  if (drive != nullptr && !is_step_response(observed)) {
    uses.push_back({drive, drive_quantity(*drive, options), Bound::value, options.negate_drive});
  }
  uses.push_back({response, observed, Bound::value, options.negate_response});
  if (sd != nullptr) uses.push_back({sd, observed, Bound::sd, false});
  return uses;
}

}  // namespace

ImportedSeries read_machine(const DelimitedTable& table, const std::string& file,
                            const ImportOptions& options) {
  const Header header = read_header(table, file, options);
  std::vector<Use> uses = spectrum_uses(header, file, options);
  const bool spectrum = !uses.empty();
  if (!spectrum) uses = recording_uses(header, file, options);
  require_units(uses, file);
  SeriesReader reader(table, header, file);
  for (const Use& use : uses) reader.add(use);
  ImportedSeries series = reader.take();
  if (spectrum) resolve_phase(series, uses);
  series.name = header.sheet;
  series.findings.insert(
      series.findings.begin(),
      {"header rows", fmt::format("{}{}{}", header.rows, header.sheet.empty() ? "" : ", sheet ",
                                  printable(header.sheet))});
  const bool step = !spectrum && is_step_response(series.columns.back().bound == Bound::sd
                                                      ? series.columns.at(1).quantity
                                                      : series.columns.back().quantity);
  if (!spectrum && !step) start_at_contact(series, file, options);
  return series;
}

}  // namespace tpm
