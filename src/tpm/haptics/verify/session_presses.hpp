#pragma once
#include <string>
#include <vector>

#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::haptics {

/// One press of a session as a recording that a law can be compared with: depth of the tool below
/// the surface as the device read it, and the force that was sent to the hand.
struct SessionPress {
  fit::PreparedRecording recording;  ///< "session.tpmrec: indent to 4 mm at 2 mm/s", with its hold
  std::vector<Knot> earlier;         ///< the motion from the session's start to the press
};

/// All presses that a session asked for and that were made to their end; of longer ones every few
/// rows, at least 2,000. Throws Error(bad_input) for a session without one, and for a tool that
/// moved in space.
/// @param sha256 of the recording's bytes
[[nodiscard]] std::vector<SessionPress> session_presses(const HilRecording& recording,
                                                        const std::string& sha256);

}  // namespace tpm::haptics
