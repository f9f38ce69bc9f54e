#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tpm {

/// Why a device has cut its forces, in the numbers of the Force Dimension status.
enum class ForcesOff : std::int32_t {
  none = 0,
  button = 1,
  velocity = 2,
  watchdog = 3,
  software = 4,
  unplugged = 5,
  dead_man = 6,
  unknown = 7,  ///< a number that no list has
};

[[nodiscard]] std::string_view word_of(ForcesOff cause);

/// How a device answered one call.
enum class DeviceAnswer {
  ok,
  time_guard,  ///< a value of an earlier call, which came too soon: counted, no error
  saturated,   ///< the force was clipped to what the motors can: counted, no error
  failed,      ///< see DeviceStatus
  finished,    ///< a replayed recording is at its end
};

/// Over what a device is reached.
enum class DeviceLink {
  none,          ///< there is no device: simulated here, or replayed
  synchronous,   ///< USB
  asynchronous,  ///< USB
  simulated,     ///< a simulator behind the vendor's library
  network,       ///< a server of the vendor's library, which may be anything
  unknown,
};

[[nodiscard]] std::string_view word_of(DeviceLink link);

/// What a device says it is.
struct DeviceIdentity {
  std::string kind;  ///< as limits_of() takes it
  std::string name;
  std::string serial;           ///< empty if not known
  std::string firmware;         ///< empty if not known
  std::string library;          ///< file of the vendor's library, empty if none
  std::string library_version;  ///< empty if none
  DeviceLink link = DeviceLink::none;
  bool left_handed = false;
  /// Motors and encoders that exist: false for all that is simulated, replayed, or reached over a
  /// link behind which a simulator may be.
  bool hardware = false;
  std::vector<std::string> assumptions;  ///< numbers that nobody has measured, one line each
};

/// How a device stands, where it differs from what it expects; its maker's library takes it into
/// account for gravity and coordinates.
struct DeviceMounting {
  std::optional<double> effector_mass_kg;  ///< of a tool mounted on the handle
  std::optional<double> angle_rad, base_angle_x_rad, base_angle_z_rad;
};

/// How a device is set up before a session.
struct DevicePreparation {
  DeviceMounting mounting;
  double period_s = 1e-3;      ///< of the loop
  double max_force_N = 12.0;   ///< > 0
  double watchdog_s = 0.008;   ///< forces are cut without a command for so long; 0.004 to 0.016
  bool may_move = false;       ///< the device may move by itself to initialise
  bool take_as_ready = false;  ///< it is initialised, where nobody can tell
  /// Asked while the device initialises itself; true stops it there.
  std::function<bool()> interrupted;
};

/// What a device reports beside its position. Plain data.
struct DeviceStatus {
  ForcesOff forces_off = ForcesOff::none;
  bool failed = false;  ///< it could not be asked
  int error = 0;        ///< of the vendor's library, 0: none
  char error_text[64] = {};
  std::uint64_t time_guards = 0;  ///< since prepare()
  std::uint64_t saturations = 0;  ///< since prepare()
};

/// What a hand does beside moving the tool.
struct HandState {
  float gripper_m = std::numeric_limits<float>::quiet_NaN();  ///< opening; NaN: there is none
  std::uint32_t buttons = 0;                                  ///< a bit for each that is pressed
};

/// A device with three translations that renders forces. One thread uses it; cut_forces() alone may
/// be called from another. read, write, status, hand, advance and stop neither allocate nor throw,
/// and each makes a bounded number of calls.
class HapticDevice {
 public:
  HapticDevice() = default;
  HapticDevice(const HapticDevice&) = delete;
  HapticDevice& operator=(const HapticDevice&) = delete;
  virtual ~HapticDevice() = default;

  /// Throws Error(environment) with the reason and what would help.
  virtual const DeviceIdentity& open() = 0;
  /// Initialises, sets limits and switches forces on at zero. Throws Error(environment).
  virtual void prepare(const DevicePreparation& preparation) = 0;
  /// @param position_m in the coordinates of the device; unchanged if `failed`
  virtual DeviceAnswer read(Eigen::Vector3d& position_m) noexcept = 0;
  /// @param force_N on the hand, in the coordinates of the device
  virtual DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept = 0;
  virtual DeviceStatus status() noexcept = 0;
  virtual HandState hand() noexcept { return {}; }
  /// The session waits until the tool is in place: a simulated operator holds still meanwhile.
  virtual void await() noexcept {}
  /// The first phase begins.
  virtual void begin() noexcept {}
  /// Lets time pass for a device that is simulated; others do nothing.
  virtual void advance(double /*seconds*/) noexcept {}
  /// Zero force, forces off, closed. More than one call does no harm.
  virtual void stop() noexcept = 0;
  /// The same as far as it can be done while another thread is stuck in a call.
  virtual void cut_forces() noexcept = 0;
};

}  // namespace tpm
