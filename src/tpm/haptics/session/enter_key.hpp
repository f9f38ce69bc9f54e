#pragma once
#include <functional>

#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {

/// Lets Enter act on a session: where the session waits for its operator it begins, after that each
/// Enter sets a marker. Call the returned function regularly; it reads one line if there is one,
/// and never waits.
/// @param terminal file descriptor whose lines are read
/// @param session, options told what Enter did, as long as the session runs
[[nodiscard]] std::function<void()> watch_enter(int terminal, HilSession& session,
                                                SessionRunOptions& options);

}  // namespace tpm::haptics
