#pragma once
#include <string>
#include <string_view>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Reads one force curve of a JPK atomic force microscope (.jpk-force): a ZIP archive with the
/// segments that the instrument ran (extend, pause, retract), each with its channels.
///
///     force      F = k s (V - V0)
///     depth      delta = z(0) + d(0) - z - d,   d = s (V - V0)
///
/// V is the deflection signal `vDeflection`, s the sensitivity (m/V) and k the spring constant
/// (N/m) of the file, V0 the baseline that the instrument measured before the curve (0 if it did
/// not), z the height of the cantilever: the measured one (measuredHeight, capacitiveSensorHeight
/// or strainGaugeHeight) where there is one, else that of the piezo (height). Heights fall towards
/// the specimen. The depth is that of the tip, counted from the first sample: contact is found
/// later, or here by options.contact_force_N.
///
/// A segment has its samples at equal steps of its duration, and segments follow each other. The
/// shape of the tip does not stand in such files. Throws Error(bad_input) for a map of curves, a
/// damaged file, a channel that is not calibrated, and options that are not about such files.
[[nodiscard]] ImportedSeries read_jpk(std::string_view bytes, const std::string& file,
                                      const ImportOptions& options);

}  // namespace tpm::files
