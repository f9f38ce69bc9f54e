#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/session_keys.hpp"

namespace tpm::haptics {

/// The block `motion` with the motion of a recording: depths from the law's contact point on,
/// evenly spaced in time, linear between the samples of the recording; and for how long the first
/// depth has to be held until the law is in equilibrium under it. Throws Error(bad_input).
[[nodiscard]] Json embedded_motion(const std::filesystem::path& file, const LawFile& law,
                                   double period_s, const DocumentPlace& place);

/// The phases that the blocks `indentations`, `slides`, `creep` and `motion` lead to. Throws
/// Error(bad_input).
[[nodiscard]] std::vector<SessionPhase> phases_of(const SessionKeys& session,
                                                  const DocumentPlace& place);

}  // namespace tpm::haptics
