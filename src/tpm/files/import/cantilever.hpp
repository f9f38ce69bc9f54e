#pragma once
#include <string>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/files/import/machine_header.hpp"

namespace tpm::files {

/// True for a column of the deflection of a cantilever.
[[nodiscard]] bool is_deflection(const MachineColumn& column);

/// Where a column of a series came from.
struct CantileverColumn {
  const MachineColumn* column;
  bool volts;  ///< the signal of the detector
};

/// Turns the table of an AFM into force over depth: force = k d and depth = height - d, with the
/// spring constant k and the deflection d of the cantilever; of a force and a height, d = force/k.
/// A signal in volts becomes d by the deflection sensitivity. Without a spring constant a height
/// beside a force stays as it is, with a warning: the deflection is still in it.
///
/// Series without a height and a deflection stay as they are. Throws Error(bad_input), naming the
/// option, for what is missing, and if the height falls where the force rises.
/// @param columns of the series, in the same order
void resolve_cantilever(ImportedSeries& series, const std::vector<CantileverColumn>& columns,
                        const std::string& file, const ImportOptions& options);

}  // namespace tpm::files
