#pragma once
#include <string>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/files/import/machine_columns.hpp"

namespace tpm::files {

/// True for a column of the deflection of a cantilever.
[[nodiscard]] bool is_deflection(const MachineColumn& column);

/// Where a column of a series came from.
struct CantileverColumn {
  const MachineColumn* column;
  bool volts;       ///< the signal of the detector
  bool taken_away;  ///< find_deflection_beside found it
};

/// The deflection of a cantilever, as a length, beside a height and a force that were found by
/// their titles: the depth is height minus deflection. Null if there is none or more than one, and
/// if an option says the depth otherwise: --spring-constant, or --drive, which takes a column as it
/// is.
[[nodiscard]] const MachineColumn* find_deflection_beside(const std::vector<MachineColumn>& columns,
                                                          const std::vector<ColumnUse>& uses,
                                                          const ImportOptions& options);

/// Turns the table of an AFM into force over depth: force = k d and depth = height - d, with the
/// spring constant k and the deflection d of the cantilever; of a force and a height, d = force/k.
/// A signal in volts becomes d by the deflection sensitivity. Without a spring constant, a
/// deflection that find_deflection_beside found leaves the height and the series; without one, a
/// height beside a force stays as it is, with a warning: the deflection is still in it.
///
/// Series without a height and a deflection stay as they are. Throws Error(bad_input), naming the
/// option, for what is missing, if the height falls where the force rises, and for a deflection to
/// which the force is not proportional by a positive stiffness.
/// @param columns of the series, in the same order
void resolve_cantilever(ImportedSeries& series, const std::vector<CantileverColumn>& columns,
                        const std::string& file, const ImportOptions& options);

}  // namespace tpm::files
