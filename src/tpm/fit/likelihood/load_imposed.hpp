#pragma once
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/law.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// True if a recording is one of creep: its drive is the stress of a law and its response the
/// strain, or its drive the force of an indentation and its response the depth.
[[nodiscard]] bool is_load_imposed(const Recording& recording) noexcept;

/// "force" of an indentation, "stress" of a strain: what was imposed in creep.
[[nodiscard]] std::string_view load_word(const Recording& recording) noexcept;

/// "depth" of an indentation, or "strain": what answers.
[[nodiscard]] std::string_view answer_word(const Recording& recording) noexcept;

/// A recording of stress over strain, or of force over depth, in which the load was imposed: drive
/// and response change places. Standard deviations of the load say nothing of what answers it and
/// are left out. Of an indentation the force before contact becomes its mean: without a force its
/// noise would lift the probe off.
[[nodiscard]] Recording with_imposed_load(Recording recording);

/// Samples of an indentation under an imposed force in which it rests before it rises: the probe
/// has not touched, and no law says what the depth is. None if it rests under a preload.
[[nodiscard]] std::size_t samples_before_load(const Recording& recording);

/// Drive and response of the law that a recording is fitted with, whichever was imposed.
[[nodiscard]] Quantity law_drive(const Recording& recording) noexcept;
[[nodiscard]] Quantity law_response(const Recording& recording) noexcept;

/// Imposed history, as a law is asked about it: at rest before the first sample.
[[nodiscard]] Protocol imposed_history(const Recording& recording);

/// Throws Error(bad_input), naming the recording, if it is one of creep.
/// @param what takes an imposed strain only: "identification"
void require_imposed_motion(const Recording& recording, std::string_view name,
                            std::string_view what);

}  // namespace tpm::fit
