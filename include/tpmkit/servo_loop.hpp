#pragma once
#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpmkit/contact_model.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/servo_record.hpp"

namespace tpm::haptics {

/// Conditions on the tool before a session begins.
struct StartGateSettings {
  double clearance_m = 0.5e-3;                         ///< least distance above the surface
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< of the workspace, device coordinates
  double reach_m = 0.075;                              ///< from there
  double rest_radius_m = 0.5e-3;                       ///< how far a tool at rest may move
  double rest_time_s = 0.25;                           ///< for how long it has to be at rest
  double limit_s = 60.0;                               ///< after which the session ends
  /// Wait for the operator: a button of the device, or `confirmed` becoming true.
  bool confirm = false;
  std::shared_ptr<const std::atomic<bool>> confirmed =
      nullptr;  ///< set by a key, for example; may be null
};

/// Settings of the servo loop that a session states.
struct SessionServo {
  double period_s = 1e-3;
  std::vector<std::uint64_t> phase_ends;  ///< cycles, rising; the last one ends the session
  Eigen::Vector3d push = -Eigen::Vector3d::UnitZ();     ///< device coordinates, unit vector
  Eigen::Vector3d surface_m = Eigen::Vector3d::Zero();  ///< where the tissue begins, device
  double force_limit_N = 8.0;
  /// A force that rises faster makes the model's tool slip back; falls are never limited.
  double slew_limit_N_per_s = 400.0;
  double ramp_in_s = 0.5;  ///< over which the limit of the force grows to its value
  double most_damping_N_s_per_m =
      2.0;  ///< largest damping of the passivity controller; 0: it only observes
  /// Conditions before the session begins; none: it begins with the first cycle.
  std::optional<StartGateSettings> gate = std::nullopt;
  /// If set, the surface is placed at this distance from the tool, along the push, when the session
  /// begins.
  std::optional<double> surface_before_hand_m = std::nullopt;
  double outside_validity_limit_s =
      0.5;  ///< the session stops when forces are outside the validity of the model for longer
  /// The session stops if this many of the last 1000 cycles were late, or this many periods were
  /// missed in a row.
  int most_late = 100;
  int most_missed = 50;
};

/// All settings and limits of a servo loop: those of its session, and those that follow from its
/// model and device (loop_settings() in haptics/session/session_run.hpp).
struct ServoSettings : SessionServo {
  Eigen::Vector3d model_push = Eigen::Vector3d::UnitZ();  ///< the push in coordinates of the model
  /// If set, the tool moves in space. The model receives its displacement from `surface_m`, rotated
  /// by this matrix, and handles contact and detachment itself. Otherwise only motion along the
  /// push reaches the model, and contact is one-sided.
  std::optional<Eigen::Matrix3d> to_model = std::nullopt;
  double friction_N_s_per_m = 0.1;   ///< of the device, see EnergyWatchSettings
  int delay_periods = 0;             ///< of the device, if known
  double energy_allowance_J = 2e-3;  ///< see EnergyWatchSettings; infinite: it only counts
  bool watch_oscillation = true;
  double most_speed_m_per_s = 5.0;  ///< of a hand; positions that imply more are rejected
  double fade_s = 0.1;              ///< time constant with which a force outside validity fades
  int status_every = 2;             ///< cycles
  /// True if the rendering was announced as passive with the friction and the delay of the device;
  /// empty: decided by the instantaneous stiffness of the model at rest.
  std::optional<bool> passive = std::nullopt;
};

struct ServoCounts {
  std::uint64_t time_guards = 0, saturations = 0, force_limited = 0, slipped = 0, ramping_in = 0,
                damped = 0, beyond_model = 0, late = 0, missed = 0;
  int most_consecutive_missed = 0;  ///< most periods missed between two cycles
  int most_late = 0;                ///< most late cycles in any 1000 consecutive ones
};

/// Counts times in bins of 1 us up to 50 ms. note() neither allocates nor throws.
class TimeHistogram {
 public:
  TimeHistogram();
  void note(std::int64_t ns) noexcept;
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double max_s() const noexcept { return static_cast<double>(max_ns_) * 1e-9; }
  /// Quantile of the times, as the upper edge of its bin, s; max_s() beyond the bins.
  [[nodiscard]] double quantile_s(double share) const;
  /// Counts of the bins.
  [[nodiscard]] const std::vector<std::uint32_t>& bins() const { return bins_; }

 private:
  std::vector<std::uint32_t> bins_;
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

/// Result of a servo loop.
struct ServoOutcome {
  StopCause cause = StopCause::none;
  std::string detail;  ///< more details in words; may be empty
  std::uint64_t cycles = 0;
  ServoCounts counts;
  DeviceStatus device;
  std::uint64_t dropped_records = 0;
  std::uint64_t last_beat_cycle = 0;
  // Only for a run in real time.
  bool real_time = false;
  std::string scheduling;
  TimeHistogram woke_late, busy;
  /// CLOCK_MONOTONIC at the deadline of cycle 0, that of cycle n is n periods later; 0: no cycle.
  std::int64_t first_cycle_monotonic_ns = 0;
  double stop_took_s = 0.0;  ///< from the fault, or the last completed cycle, to forces off
};

/// Receives every record in order; in real time on its own thread. An exception stops the loop with
/// the cause `exception`.
using RecordSink = std::function<void(const ServoRecord&)>;

/// Runs a session in virtual time, as fast as possible, with the same bits on each run. Switches
/// the forces of the device on before its first cycle; the device is prepared.
/// @param interrupted called regularly; true ends the session with the cause `signal`
[[nodiscard]] ServoOutcome run_in_virtual_time(HapticDevice& device, ContactModel& model,
                                               const ServoSettings& settings,
                                               const RecordSink& sink,
                                               const std::function<bool()>& interrupted = {});

/// Response to a system that refuses real-time scheduling.
enum class RealTimeWish {
  enforce,  ///< an error
  ignore,   ///< continue with a note
};

struct RealTimeOptions {
  RealTimeWish wish = RealTimeWish::ignore;
  double cycle_timeout_s = 0.008;  ///< a longer cycle ends the session
  std::function<bool()> interrupted;
  /// Prepares the device; called once threads, memory and scheduling are in place. Empty: it is
  /// prepared.
  std::function<void()> prepare;
  std::function<void()> idle;  ///< called regularly on the thread of the records
};

/// Runs a session in real time. Deadlines are absolute; missed ones are counted, and time is never
/// slowed down. A second thread watches for a cycle that does not end. It then cuts the forces and
/// abandons the stuck thread, which keeps device and model alive; therefore they are shared.
///
/// Order: threads, locked memory and scheduling; `options.prepare`; then, in the thread of the
/// loop, HapticDevice::enable_forces() and the first cycle. A watchdog of milliseconds allows
/// nothing else between the last two. Throws Error(environment) if real-time scheduling is enforced
/// and refused, and what `options.prepare` and enable_forces() throw; forces are off then.
[[nodiscard]] ServoOutcome run_in_real_time(const std::shared_ptr<HapticDevice>& device,
                                            const std::shared_ptr<ContactModel>& model,
                                            const ServoSettings& settings, const RecordSink& sink,
                                            const RealTimeOptions& options);

}  // namespace tpm::haptics
