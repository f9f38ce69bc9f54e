#pragma once
#include <vector>

#include "tpm/files/import/machine_header.hpp"

namespace tpm::files {

/// What the unit says of a column whose title says nothing or something else: "f [Hz]", "w
/// [rad/s]", "J [1/Pa]"; "x [mm]" is a displacement and "y [N]" a force; with a time beside it
/// "G [Pa]" and "E [Pa]" are relaxation moduli.
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
