#pragma once
#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Divides columns in the units of the machine by the size of the specimen: a length or an
/// elongation by its length at rest, a force by its cross section, so that the series holds
/// relative lengths or strains and stresses.
void divide_by_size(ImportedSeries& series, const ImportOptions& options);

/// Turns a strain that is kept from the first sample on, and its stress, into a relaxation modulus,
/// and a stress that is kept, and its strain, into a creep compliance. Kept means within 2 %. Other
/// series stay as they are.
void resolve_kept_step(ImportedSeries& series);

}  // namespace tpm::files
