#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/files/import/machine_header.hpp"

namespace tpm::files {

/// A column that is going to be read.
struct ColumnUse {
  const MachineColumn* column;
  Quantity quantity;
  Bound bound;
  bool negate;
  std::optional<Dimension> dimension = std::nullopt;  ///< if it is not that of the quantity
  bool clock = false;                                 ///< its fields are "11:09:16.5"
  bool volts = false;  ///< a detector's signal, which the deflection sensitivity makes a length
  bool taken_away =
      false;  ///< a deflection to be taken away from the height (find_deflection_beside)
};

/// The option to add to the command line. The unit itself is for the user to say.
[[nodiscard]] std::string unit_option(const MachineColumn& column, Dimension dimension);

/// The unit of a column. Throws Error(bad_input) for one that is unknown or of another dimension.
[[nodiscard]] Unit unit_of(const MachineColumn& column, Dimension dimension,
                           const std::string& file);

[[nodiscard]] Dimension dimension_of(const ColumnUse& use);

/// Throws Error(bad_input) for columns without a unit: one message for all of them, so that what to
/// add to the command line is said once.
void require_units(const std::vector<ColumnUse>& uses, const std::string& file);

/// A column titled "F" in kPa holds a stress: the unit says what the title cannot.
[[nodiscard]] Quantity response_quantity(const MachineColumn& column, const ImportOptions& options);

[[nodiscard]] bool is_compliance(const MachineColumn& column);

/// Storage and loss modulus from storage and loss compliance, G' + iG'' = 1/(J' - iJ''). Throws
/// Error(bad_input) if a compliance has anything else beside it.
void resolve_compliances(ImportedSeries& series, const std::string& file);

/// Refuses a relaxation in shares of its first reading, naming the options that fit it as it is.
void require_more_than_ratio(const MachineHeader& header, const std::string& file);

/// Says which standard deviations of a spectrum are not read: they need a described curve.
void tell_unread_deviations(const MachineHeader& header, ImportedSeries& series);

/// Storage and loss in N/m are dynamic stiffnesses, else moduli.
[[nodiscard]] Quantity spectrum_quantity(const MachineColumn& column, bool loss);

/// An elongation in percent is a strain.
[[nodiscard]] Quantity drive_quantity(const MachineColumn& column, const ImportOptions& options);

/// The name of a column in the findings.
[[nodiscard]] std::string finding_name(const ColumnUse& use);

/// A length, or how far the specimen was drawn, becomes a relative length or a strain by its length
/// at rest, a force a stress by its cross section. Throws Error(bad_input) that names the option
/// that is missing.
void resolve_specimen(ColumnUse& drive, ColumnUse& response, const std::string& file,
                      const ImportOptions& options);

/// Divides columns in the units of the machine by the size of the specimen: a length or an
/// elongation by its length at rest, a force by its cross section, so that the series holds
/// relative lengths or strains and stresses.
void divide_by_size(ImportedSeries& series, const ImportOptions& options);

/// The quantity that the unit tells where the title of a column says nothing or something else: "f
/// [Hz]", "w [rad/s]", "J [1/Pa]"; "x [mm]" is a displacement and "y [N]" a force; with a time
/// beside it "G [Pa]" and "E [Pa]" are relaxation moduli.
void recognize_by_unit(MachineColumn& column, bool timed);

/// "T" is a time only where its unit says so or where nothing contradicts: it may be a temperature.
void doubt_capital_t(MachineColumn& column);

/// Replaces a unit in other capitals by the unit of what the title says: "S" of a time is "s". One
/// that may be two keeps both in unit_readings.
void read_capitals_of_unit(MachineColumn& column);

/// Marks a title whose unit is none of what it says.
void doubt_unit(MachineColumn& column);

/// Of time, drive and response those that no title names: if of each there is one column only that
/// has a unit of it, it is that, whatever its title.
void recognize_lone_columns(std::vector<MachineColumn>& columns);

}  // namespace tpm::files
