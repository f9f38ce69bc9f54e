#pragma once
#include "tpm/haptics/session/session.hpp"

namespace tpm::haptics {

/// The model that a plan picks for a session: its deepest push at its fastest rate with its longest
/// rest, at its rate and within its tolerance, the contact guided along the push as in the loop.
/// Operations cost what they nominally do, so that a session's model does not depend on a machine.
/// Throws as make_loop_model().
[[nodiscard]] LoopModel planned_model(const HilSession& session, const PlanningTold& told);

}  // namespace tpm::haptics
