#pragma once
#include "tpm/haptics/session/session.hpp"
#include "tpmkit/formulation.hpp"

namespace tpm::haptics {

/// Makes what the servo loop of a session steps: a role of a formulation
/// (formulation/formulation.hpp). Formulations with the capability `servo` and candidates for plans
/// that a loop can step need no such role (offered_loop).
class LoopMaker {
 public:
  LoopMaker() = default;
  LoopMaker(const LoopMaker&) = delete;
  LoopMaker& operator=(const LoopMaker&) = delete;
  virtual ~LoopMaker() = default;
  /// The model of a session, its stiffness still to come.
  /// Throws Error(bad_input) if the scene is not one that the model can stand for.
  [[nodiscard]] virtual LoopModel loop(const HilSession& session) const = 0;
};

/// A session can name it as its model.
[[nodiscard]] bool for_sessions(const Formulation& formulation);

/// The first candidate of a formulation for plans that answers the session's deepest push and
/// has valid forces along it at the session's slowest rate, not verified; the last one if none
/// has (the session then stops by itself). Throws Error(bad_input) with the reason where
/// none does.
[[nodiscard]] LoopModel offered_loop(const Formulation& formulation, const HilSession& session);

}  // namespace tpm::haptics
