#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/haptics/session/recording_keys.hpp"
#include "tpm/haptics/session/session.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

/// Header before the rows of a recording: format, session with its scene, device, model, what
/// was known of its rendering before (RenderingCheck).
[[nodiscard]] Json recording_header(const HilSession& session, const DeviceIdentity& device,
                                    const LoopModel& model, bool real_time,
                                    const SessionNotes& notes = {}, const Json& rendering = {});

/// Footer behind them: how the session ended.
[[nodiscard]] Json recording_closing(const ServoOutcome& outcome);

[[nodiscard]] Json to_json(const DeviceIdentity& device);
[[nodiscard]] Json to_json(const ServoCounts& counts);

/// A recorded session.
struct HilRecording {
  std::string name;  ///< of the file, without folders
  Json header;
  RecordingHeader opened;  ///< the header, read
  HilSession session;
  std::vector<ServoRecord> rows;
  bool closed = false;      ///< the session came to an end, of whatever cause
  Json closing;             ///< null unless closed
  RecordingClosing ended;   ///< the same, read
  std::size_t damaged = 0;  ///< rows that were written and are not whole; left out

  /// Nothing is missing: neither the end nor a row.
  [[nodiscard]] bool whole() const { return closed && damaged == 0; }
  /// Why the session ended, as to_string(StopCause); "cut off" without a closing record.
  [[nodiscard]] std::string cause() const { return closed ? ended.cause : "cut off"; }
  /// Of the end: of the last row.
  [[nodiscard]] double end_s() const;
  /// The device was simulated, replayed, or may be: no motor is known to have moved.
  [[nodiscard]] bool simulated() const { return opened.simulated_device; }
  [[nodiscard]] double time_s(const ServoRecord& row) const;
  /// Force sent to the device against the push, N.
  [[nodiscard]] double commanded_N(const ServoRecord& row) const;
};

/// Reads a recording, also of a session that was cut off. Header and closing record are checked
/// against schemas/hil_recording.schema.json and hil_closing.schema.json, the session within the
/// header as that of a file. Throws Error(bad_input) with the key.
[[nodiscard]] HilRecording read_recording(const std::filesystem::path& file);

/// Missing part of a recording, one line for a person; empty if nothing is.
[[nodiscard]] std::string damage_line(const HilRecording& recording);

/// Cause of the end of a session before its last phase, one line; empty if the session came to its
/// last phase, or if the recording does not tell (damage_line()).
[[nodiscard]] std::string early_end_line(const HilRecording& recording);

/// Reservations about the numbers of a recording, one line each: missing parts, an early end, rows
/// that found no room, findings of the device.
[[nodiscard]] std::vector<Remark> recording_remarks(const HilRecording& recording);

/// "SIMULATED DEVICE" in words that suit the recording, or what the hardware is.
[[nodiscard]] std::string device_line(const HilRecording& recording);

}  // namespace tpm::haptics
