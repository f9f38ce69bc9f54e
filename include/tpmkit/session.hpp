#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpmkit/contact_model.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm {

struct HilSession;  // a session as it was read

/// How a session is run.
struct SessionRequest {
  std::filesystem::path recording;  ///< every period of the session is written there
  /// On the clock; else in virtual time: as fast as it goes, the same bits each time.
  bool real_time = false;
  RealTimeWish wish = RealTimeWish::ignore;
  /// Whose limits of force, stiffness and delay apply: a kind that `tpm hil devices` lists.
  std::string limits = "omega7";
  bool may_move = false;              ///< the device may move by itself to initialise
  std::function<bool()> interrupted;  ///< true ends the session with the cause `signal`
  /// Sees every record, on the thread that writes them.
  std::function<void(const ServoRecord&)> watcher;
};

/// How a session went.
struct SessionSummary {
  DeviceIdentity device;
  std::string model;      ///< what was stepped, for people
  std::string rendering;  ///< passive or stable, one line
  ServoOutcome outcome;
};

/// What a recording commanded against the reference computed from its motion.
struct SessionCheck {
  std::string reference;            ///< in words
  std::size_t instants = 0;         ///< that were compared
  double rms_N = 0.0, max_N = 0.0;  ///< commanded less reference
  double peak_N = 0.0;              ///< largest force of the reference
  double reference_error_N = 0.0;   ///< of the reference, as it estimates
};

/// A session with a haptic device: tissue, loop and phases (schemas/hil.schema.json,
/// docs/haptics.md). Copies share one session, which never changes.
class Session {
 public:
  /// Reads a session. Throws Error(bad_input) with the key.
  /// @param law a law file that takes the place of the session's model; none if empty
  explicit Session(const std::filesystem::path& file, const std::filesystem::path& law = {});

  [[nodiscard]] const std::string& title() const;
  [[nodiscard]] double duration_s() const;
  /// What the session states of its loop: period, push, limits, start gate.
  [[nodiscard]] const SessionServo& servo() const;

  /// The tissue as the loop steps it, at rest. For a loop of one's own; one thread steps it.
  /// Throws Error(bad_input) if the scene is not one that the model can stand for,
  /// Error(answer_is_no) if a planned model is not accurate and fast enough.
  [[nodiscard]] std::shared_ptr<ContactModel> contact() const;

  /// The device that the library simulates, with a hand that follows the session's phases.
  [[nodiscard]] std::shared_ptr<HapticDevice> simulated_device() const;

  /// Runs the session on a device and records it. A rendering that would be unstable is refused;
  /// forces begin when the tool is in place.
  /// Throws Error(answer_is_no) for a rendering that is refused, Error(environment) before the loop
  /// begins; what happens later is in the outcome.
  SessionSummary run(const std::shared_ptr<HapticDevice>& device,
                     const SessionRequest& request) const;

 private:
  std::shared_ptr<const HilSession> session_;
};

/// Recomputes a recorded session with its reference, the full network or the law itself, and
/// compares. Throws Error(bad_input) for a recording that is empty or damaged beyond use.
[[nodiscard]] SessionCheck verify_session(const std::filesystem::path& recording);

}  // namespace tpm
