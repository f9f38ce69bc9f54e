#pragma once
#include <optional>

#include "tpm/base/remark.hpp"
#include "tpm/fit/recording/prepared_recording.hpp"

namespace tpm::fit {

/// A strain that starts away from 0 counts from where the recording starts, as if the specimen were
/// unloaded there: what a reader must know of it, and of the stress that it then has. None where
/// the strain starts within a hundredth of its range, or within its noise, of 0, or answers a
/// stress.
/// @param recording with its phases
[[nodiscard]] std::optional<Remark> strained_start_remark(const PreparedRecording& recording);

}  // namespace tpm::fit
