#pragma once
#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Divides columns in the units of the machine by the size of the specimen: a length or an
/// elongation by its length at rest, a force by its cross section, so that the series holds
/// relative lengths or strains and stresses.
void divide_by_size(ImportedSeries& series, const ImportOptions& options);

}  // namespace tpm::files
