#include "tpm/files/import/machine_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/unit_words.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

bool has_dimension(const MachineColumn& column, Dimension dimension) {
  return is_unit(column.unit) && parse_unit(column.unit, column.name).dimension == dimension;
}

}  // namespace

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

namespace {

/// Refuses a voltage: what a volt stands for is not in the file, and no unit is near to it.
void refuse_voltage(const MachineColumn& column, Dimension dimension, const std::string& where,
                    const std::string& name) {
  constexpr std::array kVoltages{"V", "mV", "uV", "kV", "volt", "volts", "Volt", "Volts"};
  if (std::ranges::find(kVoltages, column.unit) == kVoltages.end()) return;
  const std::string_view quantity = dimension_name(dimension);
  const Unit unit = shown_unit(dimension);
  std::string expected = fmt::format(
      "a calibrated column: multiply it by the {} per volt of the sensor, and state its unit, such "
      "as --unit \"{}={}\"",
      quantity, name, unit.symbol);
  if (dimension == Dimension::force) {
    expected +=
        "; of a cantilever, title it Deflection and state --deflection-sensitivity and "
        "--spring-constant";
  }
  throw bad_input(where,
                  fmt::format("'{}' is a voltage, and the file has no calibration that makes it a "
                              "{}",
                              printable(column.unit), quantity),
                  expected);
}

}  // namespace

Unit unit_of(const MachineColumn& column, Dimension dimension, const std::string& file) {
  const std::string where = fmt::format("{}: {}", file, column.label());
  const std::string name =
      column.name.empty() ? std::to_string(column.index + 1) : printable(column.name);
  if (!column.unit_readings.empty()) {
    const std::string either = fmt::format("{}", fmt::join(column.unit_readings, " or "));
    const auto same_letter = [](unsigned char a, unsigned char b) {
      return std::tolower(a) == std::tolower(b);
    };
    const bool two_rows =
        !std::ranges::equal(column.unit_readings.front(), column.unit_readings.back(), same_letter);
    throw bad_input(
        where,
        two_rows ? fmt::format("unit {} in its title, and {} in the row of units",
                               printable(column.unit_readings.front()), printable(column.unit))
                 : fmt::format("unit '{}' may be {}", printable(column.unit), either),
        fmt::format("--unit \"{0}={1}\" or --unit \"{0}={2}\"", name, column.unit_readings.front(),
                    column.unit_readings.back()));
  }
  const bool known = is_unit(column.unit);
  const bool fits = known && parse_unit(column.unit, where).dimension == dimension;
  if (fits || column.unit.empty()) return parse_unit(column.unit, dimension, where);
  if (known) {
    const Dimension other = parse_unit(column.unit, where).dimension;
    throw bad_input(
        where, fmt::format("'{}' is a unit of {}", printable(column.unit), dimension_name(other)),
        unit_option(column, dimension));
  }
  refuse_voltage(column, dimension, where, name);
  const auto force = dimension == Dimension::force ? force_of_weight(column.unit) : std::nullopt;
  if (force) {
    throw bad_input(where, fmt::format("unknown unit '{}' of a force", printable(column.unit)),
                    fmt::format("--unit \"{}={}\" for the weight of such a mass, or another unit "
                                "of force: {}",
                                name, *force, units_of(dimension)));
  }
  throw bad_input(where, fmt::format("unknown unit '{}'", printable(column.unit)),
                  unit_option(column, dimension));
}

Dimension dimension_of(const ColumnUse& use) {
  return use.dimension.value_or(quantity_dimension(use.quantity));
}

void require_units(const std::vector<ColumnUse>& uses, const std::string& file) {
  std::string labels;
  std::string options;
  std::size_t missing = 0;
  for (const ColumnUse& use : uses) {
    const Dimension dimension = dimension_of(use);
    // A strain without a unit may be a plain number or percent.
    const bool plain = dimension == Dimension::dimensionless && use.quantity != Quantity::strain;
    const bool clock = use.quantity == Quantity::time && use.clock;
    if (!use.column->unit.empty() || plain || clock) continue;
    ++missing;
    labels += fmt::format("{}{}", labels.empty() ? "" : ", ", use.column->label());
    options +=
        fmt::format("{}{}", options.empty() ? "" : "; ", unit_option(*use.column, dimension));
    // A column titled "Force" may hold a stress (response_quantity), as of muscle.
    if (use.quantity == Quantity::contact_force) options += ", or of stress, such as kPa";
  }
  if (missing == 0) return;
  throw bad_input(fmt::format("{}: {}", file, labels),
                  missing == 1 ? "has no unit" : "have no unit", options);
}

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
  if (dimension == Dimension::force && titled == Quantity::stress) return Quantity::contact_force;
  return titled;
}

bool is_compliance(const MachineColumn& column) {
  return has_dimension(column, Dimension::compliance);
}

Quantity spectrum_quantity(const MachineColumn& column, bool loss) {
  const bool stiffness = is_unit(column.unit) &&
                         parse_unit(column.unit, column.name).dimension == Dimension::stiffness;
  const auto known = spectrum_quantities(stiffness ? Dimension::stiffness : Dimension::stress);
  return loss ? known.loss : known.storage;
}

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

std::string finding_name(const ColumnUse& use) {
  if (use.dimension == Dimension::compliance) {
    const bool loss = use.quantity == spectrum_quantities(Dimension::stress).loss;
    return loss ? "loss_compliance" : "storage_compliance";
  }
  if (use.dimension == Dimension::angle) return "phase_angle";
  if (use.taken_away) return "deflection";
  if (use.column->meaning && use.column->meaning->role == ColumnRole::loss_tangent) {
    return "loss_tangent";
  }
  return std::string(quantity_name(use.quantity));
}

void resolve_compliances(ImportedSeries& series, const std::string& file) {
  const SpectrumQuantities moduli = spectrum_quantities(Dimension::stress);
  std::vector<ImportedColumn*> parts;
  for (ImportedColumn& column : series.columns) {
    if (column.unit.dimension == Dimension::compliance) parts.push_back(&column);
  }
  if (parts.empty()) return;
  if (parts.size() != 2 || parts[0]->quantity != moduli.storage ||
      parts[1]->quantity != moduli.loss) {
    throw bad_input(file, "a compliance beside another kind of column",
                    "storage and loss compliance (J' and J''), or storage and loss modulus");
  }
  for (std::size_t i = 0; i < parts[0]->values.size(); ++i) {
    const double storage = parts[0]->values[i] * parts[0]->unit.to_si;
    const double loss = parts[1]->values[i] * parts[1]->unit.to_si;
    const double square = storage * storage + loss * loss;
    parts[0]->values[i] = storage / square;
    parts[1]->values[i] = loss / square;
  }
  for (ImportedColumn* part : parts) {
    part->unit = parse_unit(si_symbol(Dimension::stress), Dimension::stress, {});
    part->shifted = true;  // converted: not the digits of the file
  }
  series.findings.push_back(
      ImportFinding::told_of("converted", "compliances to storage and loss modulus"));
}

void require_more_than_ratio(const MachineHeader& header, const std::string& file) {
  for (const MachineColumn& column : header.columns) {
    if (!is_normalised(column.name)) continue;
    throw bad_input(
        fmt::format("{}: {}", file, column.label()), "a share of another reading, by its title",
        fmt::format("the modulus or compliance itself with its unit; or, to fit the shares as if "
                    "they were Pa, --response {0} --response-quantity relaxation_modulus --unit "
                    "{0}=Pa",
                    column.index + 1));
  }
}

void tell_unread_deviations(const MachineHeader& header, ImportedSeries& series) {
  for (const MachineColumn& column : header.columns) {
    if (!column.meaning || column.meaning->role != ColumnRole::sd) continue;
    series.findings.push_back(ImportFinding::told_of(
        "not read",
        fmt::format("{}: standard deviations of a spectrum need a description", column.label())));
  }
}

void resolve_specimen(ColumnUse& drive, ColumnUse& response, const std::string& file,
                      const ImportOptions& options) {
  const auto unknown = [](const MachineColumn& column) {
    return !column.unit.empty() && !is_unit(column.unit);
  };
  if (unknown(*drive.column) || unknown(*response.column)) return;  // refused when it is read
  const bool length = has_dimension(*drive.column, Dimension::length);
  const bool drawn = drive.quantity == Quantity::indentation_depth &&
                     (options.rest_length_m || response.quantity == Quantity::stress);
  const bool of_length = is_answered_by_stress(drive.quantity) && length;
  const auto missing = [&](const ColumnUse& use, const char* what, const char* expected) {
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

void divide_by_size(ImportedSeries& series, const ImportOptions& options) {
  for (ImportedColumn& column : series.columns) {
    const Dimension wanted = quantity_dimension(column.quantity);
    if (column.unit.dimension == wanted) continue;
    const bool length = column.unit.dimension == Dimension::length;
    if (!length && column.unit.dimension != Dimension::force) continue;
    const double size = length ? options.rest_length_m.value() : options.area_m2.value();
    for (double& value : column.values) value *= column.unit.to_si / size;
    series.findings.push_back(ImportFinding::told_of(
        "converted",
        fmt::format("{} to {} by a {} of {} {}", column.unit.symbol, quantity_name(column.quantity),
                    length ? "length at rest" : "cross section",
                    significant(length ? 1e3 * size : 1e6 * size, 6), length ? "mm" : "mm^2")));
    column.unit = parse_unit(si_symbol(wanted), wanted, {});
    column.shifted = true;  // converted: not the digits of the file
  }
}

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
