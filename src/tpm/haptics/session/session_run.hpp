#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/inverse/inverse_device.hpp"
#include "tpm/haptics/session/finding_notices.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/rendering_check.hpp"

namespace tpm::haptics {

/// Choice of the device, and what it may do.
struct DeviceChoice {
  std::string kind = "virtual";   ///< as limits_of() takes it, or "plugin"
  std::filesystem::path library;  ///< of the vendor; empty: looked for
  std::filesystem::path replay;   ///< recording to be replayed
  std::filesystem::path plugin;   ///< of the kind "plugin": its shared library
  /// Measurements of it (device_file.hpp); empty: nothing. Of the kind "virtual" that of the
  /// device which it stands for.
  std::filesystem::path file;
  DeviceSelection which;
  InverseAddress inverse;  ///< of the kind "inverse3"
  bool may_move = false;
  bool take_as_ready = false;
};

/// Limits of it; a plugin is loaded and asked, a device file is read. Throws as
/// make_device() and read_device_file().
[[nodiscard]] DeviceLimits limits_of(const DeviceChoice& choice);

/// Throws Error(usage) for an unknown kind, Error(environment) if it cannot be had.
[[nodiscard]] std::shared_ptr<HapticDevice> make_device(const DeviceChoice& choice,
                                                        const HilSession& session);

struct SessionRunOptions {
  bool real_time = false;
  RealTimeWish wish = RealTimeWish::ignore;
  std::filesystem::path recording;
  /// Runs what RenderingCheck refuses for its stability, and nothing else that it refuses. Of a
  /// simulated device only.
  bool accept_unstable = false;
  /// Of hardware whose delay a device file states, in real time: measure it for a second before the
  /// session (check_delay() in identify_run.hpp). The larger delay counts; without an answer the
  /// device counts as not measured. A device of the caller (run_session_on) is not checked.
  bool check_delay = true;
  /// Called right before that check, with the device still closed: the handle will be pushed.
  /// @param most_N the largest force
  std::function<void(double most_N)> checking;
  SessionNotes notes;
  std::function<bool()> interrupted;
  /// Number of markers that the operator has set by key so far; may be null.
  std::shared_ptr<const std::atomic<std::uint32_t>> markers;
  /// Sees every record, on the thread that writes them.
  std::function<void(const ServoRecord&)> watcher;
  /// Called when the device is open and its forces are still off.
  std::function<void(const DeviceIdentity&, const LoopModel&)> opened;
  /// Told once for each finding of the device, in real time when it is noticed.
  FindingTold noticed;
  PlanningTold planning;  ///< see make_loop_model()
};

struct SessionRun {
  DeviceIdentity device;
  LoopModel model;  ///< its `model` is with the run
  RenderingCheck rendering;
  /// Of a rehearsal on the simulated Omega.7: the check of the same session on the device that it
  /// stands for, that of the device file if there is one, else an Omega.7.
  std::optional<RenderingCheck> on_hardware = std::nullopt;
  std::string hardware_kind;  ///< of that device
  ServoOutcome outcome;
  double largest_force_N = 0.0;         ///< that was sent to the device
  std::vector<DeviceFinding> findings;  ///< of the device
};

/// Smallest force perceived through a handle, N; assumed.
inline constexpr double kLeastFeltForce_N = 0.01;

/// In real time a machine that stalls ends no rehearsal, check or identification on the simulated
/// Omega.7: its watchdog, and that of a cycle (cycle_timeout_s), wait for a second at least.
void forgive_stalls(HilSession& session);

/// Settings of the device for a loop of this session, of a session as of what comes before it.
[[nodiscard]] DevicePreparation preparation_for(const HilSession& session,
                                                const DeviceChoice& choice, bool real_time,
                                                const std::function<bool()>& interrupted);

/// Settings of the loop on the clock, of a session as of what comes before it: the forces are cut
/// when a cycle takes longer than the session's cycle_timeout_s.
[[nodiscard]] RealTimeOptions real_time_options(const HilSession& session, RealTimeWish wish,
                                                const std::function<bool()>& interrupted);

/// Throws Error(environment) if the device file of the choice was measured on another device than
/// this, or on a simulated one and this has motors. A file that measured nothing, as those that are
/// shipped, is for any device of its kind; that of the kind "virtual" is of another device.
void require_same_device(const DeviceChoice& choice, const DeviceIdentity& device);

/// Settings of the loop of a session: those that the session states, with what is known of its
/// model and device.
/// @param guided a hand holds the device; else a recorded motion begins where it began, and nobody
///        feels it
[[nodiscard]] ServoSettings loop_settings(const HilSession& session, const LoopModel& model,
                                          const RenderingCheck& rendering, bool guided);

/// A session that the gate has let pass.
struct AdmittedSession {
  LoopModel model;                        ///< its `model` is `stepped`
  std::shared_ptr<ContactModel> stepped;  ///< at rest
  RenderingCheck rendering;
  std::optional<RenderingCheck> on_hardware = std::nullopt;  ///< as in SessionRun
  std::string hardware_kind;                                 ///< as in SessionRun
};

/// The gate of run_session(), before its device is opened for the session: limits of the device,
/// stability, six hands. Of hardware whose delay a device file states, in real time, it opens the
/// device for a second and moves the handle with less than 0.3 N (SessionRunOptions::check_delay).
/// Throws as run_session() before its loop begins: Error(answer_is_no) for a session that is
/// refused.
[[nodiscard]] AdmittedSession admit_session(const HilSession& session, const DeviceChoice& device,
                                            const SessionRunOptions& options);

/// Permissions and limits' origin of a device that the caller made.
struct DevicePermissions {
  bool may_move = false;       ///< to initialise itself
  bool take_as_ready = false;  ///< it is initialised, where nobody can tell
  /// The device file that its limits are from, compared as require_same_device() says; may be
  /// empty.
  std::filesystem::path file = {};
};

/// run_session() on a device that the caller has made; a hand holds it.
[[nodiscard]] SessionRun run_session_on(const HilSession& session,
                                        const std::shared_ptr<HapticDevice>& device,
                                        const DeviceLimits& limits,
                                        const DevicePermissions& permissions,
                                        const SessionRunOptions& options);

/// Runs a session and records it. A rendering that would be unstable is refused, forces and phases
/// begin when the tool is in place (StartGate; rows until then are shown and not recorded).
/// In real time the rows written by now are passed to the system
/// every 50 ms.
/// Throws Error(answer_is_no) for a rendering that is refused, Error(usage) for one that is
/// accepted on a device that is not simulated, Error(environment) before the loop begins; what
/// happens later is in the outcome.
[[nodiscard]] SessionRun run_session(const HilSession& session, const DeviceChoice& device,
                                     const SessionRunOptions& options);

}  // namespace tpm::haptics
