#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

namespace tpm::haptics {

/// Why a session ended.
enum class StopCause : std::int32_t {
  none,
  finished,  ///< all phases were done
  signal,
  exception,
  communication,  ///< a call of the device failed
  unplugged,
  watchdog,  ///< the device cut its forces, as for the next four
  velocity,
  button,
  software,
  dead_man,
  forces_off,  ///< the same for an unlisted reason
  position_not_finite,
  force_not_finite,
  overrun_storm,     ///< too many cycles were late
  cycle_timeout,     ///< a cycle did not end
  not_in_place,      ///< the tool was not brought to a valid start position in time
  outside_validity,  ///< forces were outside the validity of the model for too long
  energy,            ///< the rendering delivered energy to the hand that the tissue did not store
  oscillation,       ///< the force oscillated without motion of the hand
  position_jump,     ///< the device reported a motion faster than any hand
  damping,           ///< damping had to be added in too many cycles
};

[[nodiscard]] std::string_view to_string(StopCause cause);

/// Events of a cycle.
enum ServoFlag : std::uint32_t {
  kTouching = 1U << 0U,
  kTimeGuarded = 1U << 1U,   ///< position of an earlier call
  kSaturated = 1U << 2U,     ///< clipped by the motors
  kForceLimited = 1U << 3U,  ///< clipped by the session's limit
  kSlipping = 1U << 4U,   ///< the model's tool slipped, because the force rose faster than allowed
  kRampingIn = 1U << 5U,  ///< the same, because forces are still growing to their limit
  kDamped = 1U << 6U,     ///< by the passivity controller
  kBeyondModel = 1U << 7U,  ///< the force is outside the validity of the model
  kLate = 1U << 8U,         ///< woke after the next deadline
  // Before the session begins (StartGate); the rows have phase -1.
  kWaiting = 1U << 9U,       ///< for the operator; forces are zero
  kOutOfReach = 1U << 10U,   ///< the tool is outside the workspace
  kInTissue = 1U << 11U,     ///< or too close to it
  kMoving = 1U << 12U,       ///< the tool is not at rest
  kUnconfirmed = 1U << 13U,  ///< everything is in place but not confirmed
  kMarked = 1U << 14U,       ///< by the operator: a button went down, or a key within 20 ms before
};

/// One cycle of the servo loop. Plain data, written to the recording as it is. Depths are along the
/// push, from the surface at rest, positive into the tissue. The row of a stop has the last known
/// values and a command of zero.
struct ServoRecord {
  std::uint64_t cycle = 0;       ///< periods since the start, missed ones included
  double position_m[3] = {};     ///< as the device read it
  double tool_depth_m = 0.0;     ///< of the tool, negative in the air
  double surface_depth_m = 0.0;  ///< of the tissue, input of the model; in space that of the tool
  double model_force_N = 0.0;    ///< of the tissue against the push, one-sided, also outside
                                 ///< the validity of the model
  double model_error_N = 0.0;    ///< error estimate of the model
  double commanded_N[3] = {};    ///< sent to the device, on the hand
  double observed_J = 0.0;       ///< work of the hand on the rendering since the start
  double leak_J = 0.0;           ///< energy lost so far by a constant force within periods
  float woke_late_s = 0.0F;      ///< after the deadline; 0 in virtual time
  float busy_s = 0.0F;           ///< the cycle's work; 0 in virtual time
  std::uint32_t flags = 0;       ///< ServoFlag
  std::int32_t phase = 0;        ///< -1 before the session begins
  std::int32_t missed = 0;       ///< periods without a command before this one
  StopCause stop = StopCause::none;
  float gripper_m = std::numeric_limits<float>::quiet_NaN();  ///< opening; NaN: there is none
  std::uint32_t buttons = 0;  ///< of the device, a bit for each that is pressed
  /// Orientation of the grip in the device's coordinates, a unit quaternion w, x, y, z; NaN: there
  /// is none. Gripper, buttons and grip are those last read, some milliseconds ago at most.
  float grip[4] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(),
                   std::numeric_limits<float>::quiet_NaN(),
                   std::numeric_limits<float>::quiet_NaN()};
};

static_assert(sizeof(ServoRecord) == 152);

/// Size of a row in recordings of the first format, which lack gripper, buttons and grip, and of
/// the second, which lack the grip.
inline constexpr std::size_t kFirstRowBytes = 128, kSecondRowBytes = 136;
static_assert(offsetof(ServoRecord, gripper_m) == kFirstRowBytes);
static_assert(offsetof(ServoRecord, grip) == kSecondRowBytes);

}  // namespace tpm::haptics
