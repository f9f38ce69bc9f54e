#pragma once
#include <Eigen/Core>

#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::fit {

/// Finds readings that stand at a limit of the force cell: a run at the largest or smallest reading
/// of the ramp and hold that is longer than rounding makes (clipped_run), and that a tissue without
/// relaxation under a drive at rest would not make. Sets clipped_above or clipped_below, and says
/// it first among the words of the phases.
void find_clipping(PreparedRecording& recording);

/// True if a reading stands at a limit that was found.
[[nodiscard]] bool is_clipped(const PreparedRecording& recording, double reading);
/// Of each sample.
[[nodiscard]] Eigen::Array<bool, Eigen::Dynamic, 1> clipped_readings(
    const PreparedRecording& recording);

}  // namespace tpm::fit
