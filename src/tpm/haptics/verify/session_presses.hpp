#pragma once
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/fit/validate/comparison.hpp"
#include "tpm/haptics/session/recording.hpp"

namespace tpm::haptics {

/// One press of a session as a recording that a law can be compared with: depth of the tool below
/// the surface as the device read it, and the force that was sent to the hand.
struct SessionPress {
  fit::PreparedRecording recording;  ///< "session.tpmrec: indent to 4 mm at 2 mm/s", with its hold
  fit::SessionMotion motion;         ///< from the session's start, and when the hand was to hold
};

struct SessionPresses {
  std::vector<SessionPress> made;  ///< to their end
  std::vector<Remark> left_out;    ///< those that were not, and why
};

/// All presses that a session asked for; of longer ones every few rows, at least 2,000. Throws
/// Error(bad_input) for a session of which none was made to its end, and for a tool that moved in
/// space.
/// @param sha256 of the recording's bytes
[[nodiscard]] SessionPresses session_presses(const HilRecording& recording,
                                             const std::string& sha256);

}  // namespace tpm::haptics
