#include "tpm/files/import/import_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "tpm/files/import/contact.hpp"
#include "tpm/files/import/machine_header.hpp"
#include "tpm/files/import/specimen_size.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

std::string column_list(const MachineHeader& header) {
  std::string list;
  for (const MachineColumn& column : header.columns) {
    list += fmt::format("{}{}", list.empty() ? "" : ", ", column.label());
  }
  return printable(list, 200);
}

const MachineColumn& column_by_selector(const MachineHeader& header, const std::string& selector,
                                        const std::string& file) {
  for (const MachineColumn& column : header.columns) {
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

const MachineColumn* column_by_title(const MachineHeader& header, ColumnRole role) {
  const MachineColumn* best = nullptr;
  for (const MachineColumn& column : header.columns) {
    if (!column.meaning || column.meaning->role != role) continue;
    if (best == nullptr || column.meaning->rank < best->meaning->rank) best = &column;
  }
  return best;
}

const MachineColumn* find_column(const MachineHeader& header, ColumnRole role,
                                 const std::string& selector, const std::string& file) {
  if (!selector.empty()) return &column_by_selector(header, selector, file);
  return column_by_title(header, role);
}

/// What to add to the command line. The unit itself is for the user to say.
std::string unit_option(const MachineColumn& column, Dimension dimension) {
  const std::string name =
      column.name.empty() ? std::to_string(column.index + 1) : printable(column.name);
  if (dimension == Dimension::dimensionless) {
    return fmt::format("--unit \"{0}=%\", or --unit \"{0}=-\" for a plain number", name);
  }
  const std::string units = units_of(dimension);
  return fmt::format("--unit \"{}=UNIT\" with a unit of {}{}{}", name, dimension_name(dimension),
                     units.empty() ? "" : ": ", units);
}

Unit unit_of(const MachineColumn& column, Dimension dimension, const std::string& file) {
  const std::string where = fmt::format("{}: {}", file, column.label());
  if (is_unit(column.unit) || column.unit.empty()) return parse_unit(column.unit, dimension, where);
  throw bad_input(where, fmt::format("unknown unit '{}'", printable(column.unit)),
                  unit_option(column, dimension));
}

/// A column that is going to be read.
struct Use {
  const MachineColumn* column;
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
    // A strain without a unit may be a plain number or percent.
    const bool plain = dimension == Dimension::dimensionless && use.quantity != Quantity::strain;
    if (!use.column->unit.empty() || plain) continue;
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
Quantity response_quantity(const MachineColumn& column, const ImportOptions& options) {
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
Quantity spectrum_quantity(const MachineColumn& column, bool loss) {
  const bool stiffness = is_unit(column.unit) &&
                         parse_unit(column.unit, column.name).dimension == Dimension::stiffness;
  const auto known = spectrum_quantities(stiffness ? Dimension::stiffness : Dimension::stress);
  return loss ? known.loss : known.storage;
}

bool has_dimension(const MachineColumn& column, Dimension dimension) {
  return is_unit(column.unit) && parse_unit(column.unit, column.name).dimension == dimension;
}

/// An elongation in percent is a strain.
Quantity drive_quantity(const MachineColumn& column, const ImportOptions& options) {
  if (options.drive_quantity) return *options.drive_quantity;
  const Quantity titled = column.meaning && column.meaning->role == ColumnRole::drive
                              ? column.meaning->quantity
                              : Quantity::indentation_depth;
  if (titled == Quantity::strain && has_dimension(column, Dimension::length)) {
    return Quantity::indentation_depth;  // a "deformation" in mm
  }
  const bool relative = titled == Quantity::indentation_depth && !column.unit.empty() &&
                        has_dimension(column, Dimension::dimensionless);
  return relative ? Quantity::strain : titled;
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
  SeriesReader(const DelimitedTable& table, const MachineHeader& header, const std::string& file)
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
    const MachineColumn& column = *use.column;
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
    for (const MachineColumn& column : header_.columns) {
      if (std::find(used_.begin(), used_.end(), column.index) != used_.end()) continue;
      unused += fmt::format("{}{}", unused.empty() ? "" : ", ", column.label());
    }
    if (!unused.empty()) series_.findings.push_back({"not used", printable(unused, 200)});
    return std::move(series_);
  }

 private:
  const DelimitedTable& table_;
  const MachineHeader& header_;
  const std::string& file_;
  ImportedSeries series_;
  std::vector<std::size_t> used_;
};

/// The columns of a spectrum, nothing if the file holds something else: a frequency alone may be
/// that of the sampling, and a column that is named as time, drive or response says what is meant.
std::vector<Use> spectrum_uses(const MachineHeader& header, const std::string& file,
                               const ImportOptions& options) {
  const bool chosen = !options.frequency_column.empty() || !options.storage_column.empty() ||
                      !options.loss_column.empty();
  const bool recording = !options.time_column.empty() || !options.drive_column.empty() ||
                         !options.response_column.empty();
  if (recording && !chosen) return {};
  const MachineColumn* frequency =
      find_column(header, ColumnRole::frequency, options.frequency_column, file);
  const MachineColumn* storage =
      find_column(header, ColumnRole::storage, options.storage_column, file);
  const MachineColumn* loss = find_column(header, ColumnRole::loss, options.loss_column, file);
  const MachineColumn* magnitude =
      chosen ? nullptr : column_by_title(header, ColumnRole::magnitude);
  const MachineColumn* angle = chosen ? nullptr : column_by_title(header, ColumnRole::phase);
  const MachineColumn* tangent =
      chosen ? nullptr : column_by_title(header, ColumnRole::loss_tangent);
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

/// The response of a strain is a stress, if there is one beside a force.
const MachineColumn* response_column(const MachineHeader& header, const MachineColumn* drive,
                                     const ImportOptions& options, const std::string& file) {
  const MachineColumn* found =
      find_column(header, ColumnRole::response, options.response_column, file);
  const bool chosen = !options.response_column.empty() || options.response_quantity;
  if (chosen || drive == nullptr || !is_answered_by_stress(drive_quantity(*drive, options))) {
    return found;
  }
  const auto stress =
      std::find_if(header.columns.begin(), header.columns.end(), [](const MachineColumn& column) {
        return column.meaning && column.meaning->quantity == Quantity::stress &&
               column.meaning->role == ColumnRole::response;
      });
  return stress == header.columns.end() ? found : &*stress;
}

/// A length, or how far the specimen was drawn, becomes a relative length or a strain by its length
/// at rest, a force a stress by its cross section. Says which option is missing.
void resolve_specimen(Use& drive, Use& response, const std::string& file,
                      const ImportOptions& options) {
  const auto unknown = [](const MachineColumn& column) {
    return !column.unit.empty() && !is_unit(column.unit);
  };
  if (unknown(*drive.column) || unknown(*response.column)) return;  // refused when it is read
  const bool length = has_dimension(*drive.column, Dimension::length);
  const bool drawn = drive.quantity == Quantity::indentation_depth &&
                     (options.rest_length_m || response.quantity == Quantity::stress);
  const bool of_length = is_answered_by_stress(drive.quantity) && length;
  const auto missing = [&](const Use& use, const char* what, const char* expected) {
    throw bad_input(fmt::format("{}: {}", file, use.column->label()), what, expected);
  };
  if (drawn || of_length) {
    if (!options.rest_length_m) {
      missing(drive, drawn ? "a displacement beside a stress" : "a length of the specimen",
              "--rest-length with its unloaded length, such as --rest-length \"20 mm\"");
    }
    if (drawn) drive.quantity = Quantity::strain;
    drive.dimension = Dimension::length;
  }
  const bool force = response.quantity == Quantity::contact_force &&
                     has_dimension(*response.column, Dimension::force);
  if (!force || !is_answered_by_stress(drive.quantity)) return;
  if (!options.area_m2) {
    missing(response, "a force beside a strain or relative length",
            "--area with the cross section of the specimen, such as --area \"12 mm^2\"");
  }
  response.quantity = Quantity::stress;
  response.dimension = Dimension::force;
}

std::vector<Use> recording_uses(const MachineHeader& header, const std::string& file,
                                const ImportOptions& options) {
  const MachineColumn* time = find_column(header, ColumnRole::time, options.time_column, file);
  const MachineColumn* drive = find_column(header, ColumnRole::drive, options.drive_column, file);
  const MachineColumn* response = response_column(header, drive, options, file);
  const MachineColumn* sd = find_column(header, ColumnRole::sd, options.sd_column, file);
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
  Use answer{response, observed, Bound::value, options.negate_response};
  if (drive != nullptr && !is_step_response(observed)) {
    Use imposed{drive, drive_quantity(*drive, options), Bound::value, options.negate_drive};
    resolve_specimen(imposed, answer, file, options);
    uses.push_back(imposed);
  }
  uses.push_back(answer);
  if (sd != nullptr) {
    uses.push_back({sd, answer.quantity, Bound::sd, false, answer.dimension});
  }
  return uses;
}

}  // namespace

ImportedSeries read_machine(const DelimitedTable& table, const std::string& file,
                            const ImportOptions& options) {
  const MachineHeader header = read_machine_header(table, file, options);
  std::vector<Use> uses = spectrum_uses(header, file, options);
  const bool spectrum = !uses.empty();
  if (!spectrum) uses = recording_uses(header, file, options);
  require_units(uses, file);
  SeriesReader reader(table, header, file);
  for (const Use& use : uses) reader.add(use);
  ImportedSeries series = reader.take();
  if (spectrum) {
    resolve_phase(series, uses);
  } else {
    divide_by_size(series, options);
    resolve_kept_step(series);
  }
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

}  // namespace tpm::files
