#pragma once
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpmkit/curve.hpp"
#include "tpmkit/law.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// Whether a recording is one of creep: its drive is the stress of a law and its response the
/// strain.
[[nodiscard]] bool is_load_imposed(const Recording& recording) noexcept;

/// A recording of stress over strain in which the stress was imposed: drive and response change
/// places. Standard deviations of the stress say nothing of the strain and are left out.
[[nodiscard]] Recording with_imposed_load(Recording recording);

/// Drive and response of the law that a recording is fitted with, whichever was imposed.
[[nodiscard]] Quantity law_drive(const Recording& recording) noexcept;
[[nodiscard]] Quantity law_response(const Recording& recording) noexcept;

/// What was imposed, as a law is asked about it: at rest before the first sample.
[[nodiscard]] Protocol imposed_history(const Recording& recording);

/// Throws Error(bad_input), naming the recording, if it is one of creep.
/// @param what takes an imposed strain only: "identification"
void require_imposed_motion(const Recording& recording, std::string_view name,
                            std::string_view what);

}  // namespace tpm::fit
