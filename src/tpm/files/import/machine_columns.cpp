#include "tpm/files/import/machine_columns.hpp"

#include <fmt/format.h>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/unit_words.hpp"
#include "tpmkit/error.hpp"

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

Unit unit_of(const MachineColumn& column, Dimension dimension, const std::string& file) {
  const std::string where = fmt::format("{}: {}", file, column.label());
  const std::string name =
      column.name.empty() ? std::to_string(column.index + 1) : printable(column.name);
  if (!column.unit_readings.empty()) {
    throw bad_input(where,
                    fmt::format("unit '{}' may be {}", printable(column.unit),
                                fmt::join(column.unit_readings, " or ")),
                    fmt::format("--unit \"{0}={1}\" or --unit \"{0}={2}\"", name,
                                column.unit_readings.front(), column.unit_readings.back()));
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
  if (use.dimension == Dimension::angle) return "phase_angle";
  if (use.column->meaning && use.column->meaning->role == ColumnRole::loss_tangent) {
    return "loss_tangent";
  }
  return std::string(quantity_name(use.quantity));
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

}  // namespace tpm::files
