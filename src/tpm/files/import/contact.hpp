#pragma once
#include <string>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Leaves out the samples before contact and counts time and depth from there. Contact is the first
/// sample at which the force reaches options.contact_force_N and stays there for
/// options.contact_samples samples; nothing is interpolated. Does nothing but say so if no contact
/// force is given. Throws Error(bad_input) if the force never gets there or the series has no
/// force.
void start_at_contact(ImportedSeries& series, const std::string& file,
                      const ImportOptions& options);

}  // namespace tpm::files
