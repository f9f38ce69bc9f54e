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

namespace tpm::haptics {

struct HilSession;  // the content of a session file

/// Options of a session run.
struct SessionRequest {
  std::filesystem::path recording;  ///< file for the records of all periods
  /// Real time; otherwise virtual time, as fast as possible with the same bits on each run, which
  /// is refused on a device with motors.
  bool real_time = false;
  RealTimeWish wish = RealTimeWish::ignore;
  /// Device kind whose limits of force, stiffness and delay apply (`tpm hil devices` lists them).
  /// Empty: that of `device_file`, else "virtual" for Session::simulated_device() and "omega7" for
  /// every other device.
  std::string limits;
  /// Measurements of the device (schemas/device.schema.json, `tpm hil identify`). Without it
  /// hardware counts as 20 ms late and free of friction, and stiff tissues are refused. A device
  /// with another serial number or name than the file is refused before a force; a simulated one
  /// stands for that of the file.
  std::filesystem::path device_file;
  bool may_move = false;              ///< the device may move by itself to initialise
  std::function<bool()> interrupted;  ///< true ends the session with the cause `signal`
  /// Called with every record, on the thread that writes them.
  std::function<void(const ServoRecord&)> watcher;
};

/// Result of a session.
struct SessionSummary {
  DeviceIdentity device;
  std::string model;      ///< description of the model
  std::string rendering;  ///< passive or stable, one line
  ServoOutcome outcome;
};

/// Comparison of the commanded forces of a recording with the reference for its motion.
struct SessionCheck {
  std::string reference;            ///< in words
  std::size_t instants = 0;         ///< number of compared instants
  double rms_N = 0.0, max_N = 0.0;  ///< commanded less reference
  double peak_N = 0.0;              ///< largest force of the reference
  double reference_error_N = 0.0;   ///< error estimate of the reference
  bool whole = true;                ///< neither the end of the recording nor a row is missing
  /// Parts that were not compared, the cause of an early end, findings of the device.
  std::vector<Remark> remarks;
};

/// A session with a haptic device: tissue, loop and phases (schemas/hil.schema.json,
/// docs/haptics.md). Copies share one immutable session.
class Session {
 public:
  /// Reads a session. Throws Error(bad_input) with the key.
  /// @param law a law file that replaces the session's model; none if empty
  explicit Session(const std::filesystem::path& file, const std::filesystem::path& law = {});

  [[nodiscard]] const std::string& title() const;
  [[nodiscard]] double duration_s() const;
  /// Settings of the loop: period, push, limits, start gate.
  [[nodiscard]] const SessionServo& servo() const;

  /// The model of the tissue, at rest, for your own loop. One thread may step it.
  /// Throws Error(bad_input) if the model cannot represent the scene, Error(answer_is_no) if no
  /// planned model is accurate and fast enough.
  [[nodiscard]] std::shared_ptr<ContactModel> contact() const;

  /// A simulated device whose operator follows the phases of the session.
  [[nodiscard]] std::shared_ptr<HapticDevice> simulated_device() const;

  /// Runs the session on a device and records it. Forces begin when the tool is in place.
  /// Throws Error(answer_is_no) if the rendering would be unstable, Error(environment) if the
  /// device or a file fails before the loop begins. Later failures are reported in the outcome.
  SessionSummary run(const std::shared_ptr<HapticDevice>& device,
                     const SessionRequest& request) const;

 private:
  std::shared_ptr<const HilSession> session_;
};

/// Recomputes a recorded session with its reference, the full network or the law itself, and
/// compares the forces. Throws Error(bad_input) if the recording is empty or unreadable.
[[nodiscard]] SessionCheck verify_session(const std::filesystem::path& recording);

}  // namespace tpm::haptics
