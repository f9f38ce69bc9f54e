#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/session_keys.hpp"

namespace tpm::haptics {

/// Puts the motion itself in place of the name of a recording in the block `motion`: depths from
/// the law's contact point on, evenly spaced in time, linear between the samples of the recording;
/// and for how long the first depth has to be held until the law is in equilibrium under it.
/// @param folder that the name is relative to
void embed_motion(Json& session, const LawFile& law, double period_s,
                  const std::filesystem::path& folder, const DocumentPlace& place);

/// The phases that the blocks `indentations`, `slides`, `creep` and `motion` lead to. Throws
/// Error(bad_input).
[[nodiscard]] std::vector<SessionPhase> phases_of(const SessionKeys& session,
                                                  const DocumentPlace& place);

}  // namespace tpm::haptics
