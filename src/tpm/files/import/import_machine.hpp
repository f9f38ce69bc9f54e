#pragma once
#include <string>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Reads the export of a testing machine: any number of header rows (found where the numbers begin,
/// or options.header_rows), among them one with titles and perhaps one with units, then samples.
/// Titles are recognised in five languages; where several columns fit, the one closest to the
/// specimen is taken and the others are named in the findings.
[[nodiscard]] ImportedSeries read_machine(const DelimitedTable& table, const std::string& file,
                                          const ImportOptions& options);

}  // namespace tpm::files
