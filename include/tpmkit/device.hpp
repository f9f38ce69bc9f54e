#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// Why a device switched its forces off. Values are those of the Force Dimension status.
enum class ForcesOff : std::int32_t {
  none = 0,
  button = 1,
  velocity = 2,
  watchdog = 3,
  software = 4,
  unplugged = 5,
  dead_man = 6,
  unknown = 7,  ///< a value that is not listed
};

[[nodiscard]] std::string_view to_string(ForcesOff cause);

/// Result of a call to a device.
enum class DeviceAnswer {
  ok,
  time_guard,  ///< called too soon, so the value is that of an earlier call: counted, no error
  saturated,   ///< the force was clipped to what the motors can: counted, no error
  failed,      ///< see DeviceStatus
  finished,    ///< a replayed recording is at its end
};

/// Connection to a device.
enum class DeviceLink {
  none,          ///< no device: simulated by this library, or replayed
  synchronous,   ///< USB
  asynchronous,  ///< USB
  simulated,     ///< a simulator of the vendor's library
  network,       ///< a server of the vendor's library, which may be anything
  unknown,
};

[[nodiscard]] std::string_view to_string(DeviceLink link);

/// Identity of a device, as it reports it.
struct DeviceIdentity {
  std::string kind;  ///< as limits_of() takes it
  std::string name;
  std::string serial;           ///< empty if not known
  std::string firmware;         ///< empty if not known
  std::string library;          ///< file of the vendor's library, empty if none
  std::string library_version;  ///< empty if none
  DeviceLink link = DeviceLink::none;
  bool left_handed = false;
  /// True if motors and encoders exist, or may exist: an unknown link counts. False if the device
  /// is simulated or replayed, or if its link leads to a simulator or a network.
  bool hardware = false;
  std::vector<Remark> assumptions;  ///< numbers that nobody has measured
};

/// Mounting of a device where it differs from the default. The vendor's library uses it for gravity
/// and coordinates.
struct DeviceMounting {
  std::optional<double> effector_mass_kg;  ///< of a tool mounted on the handle
  std::optional<double> angle_rad, base_angle_x_rad, base_angle_z_rad;
};

/// Settings of a device before a session.
struct DevicePreparation {
  DeviceMounting mounting;
  double period_s = 1e-3;     ///< of the loop
  double max_force_N = 12.0;  ///< > 0
  double watchdog_s = 0.008;  ///< time without a command after which forces are cut; 0.004 to 0.016
  bool may_move = false;      ///< the device may move by itself to initialise
  bool take_as_ready = false;  ///< treat it as initialised if the device cannot tell
  /// The loop keeps the clock. If false, cycles follow each other without waiting, and a simulated
  /// device does not count the time of the clock.
  bool real_time = false;
  /// Called while the device initialises itself; true stops it.
  std::function<bool()> interrupted;
};

/// State that a device reports besides its position. Plain data.
struct DeviceStatus {
  ForcesOff forces_off = ForcesOff::none;
  bool failed = false;  ///< the status could not be read
  int error = 0;        ///< of the vendor's library, 0: none
  char error_text[64] = {};
  std::uint64_t time_guards = 0;  ///< since prepare()
  std::uint64_t saturations = 0;  ///< since prepare()
};

/// Something about a device that did not end the session and that a reader of it should know.
using DeviceFinding = Remark;

/// Input of the hand besides the motion of the tool.
struct HandState {
  float gripper_m = std::numeric_limits<float>::quiet_NaN();  ///< opening; NaN: there is none
  std::uint32_t buttons = 0;                                  ///< a bit for each that is pressed
  /// Orientation of the grip, a unit quaternion w, x, y, z; NaN: there is none.
  float grip[4] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(),
                   std::numeric_limits<float>::quiet_NaN(),
                   std::numeric_limits<float>::quiet_NaN()};
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
  /// Initialises and sets limits; forces stay off. Throws Error(environment).
  virtual void prepare(const DevicePreparation& preparation) = 0;
  /// Switches forces on and sends a zero force. The loop calls this from its own thread, as the
  /// last thing before its first cycle: the watchdog of a device counts from here, and whatever
  /// takes time (threads, locked memory, files) comes before. A device without motors keeps the
  /// default. Throws Error(environment).
  virtual void enable_forces() {}
  /// @param position_m in the coordinates of the device; unchanged if `failed`
  virtual DeviceAnswer read(Eigen::Vector3d& position_m) noexcept = 0;
  /// @param force_N on the hand, in the coordinates of the device
  virtual DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept = 0;
  virtual DeviceStatus status() noexcept = 0;
  virtual HandState hand() noexcept { return {}; }
  /// Findings since the device was opened, at most one of each code. Called when the loop has ended
  /// and, from another thread, while it runs in real time.
  virtual std::vector<DeviceFinding> findings() const { return {}; }
  /// Called while the session waits for the tool to be in place. A simulated operator holds still.
  virtual void await() noexcept {}
  /// Called when the first phase begins.
  virtual void begin() noexcept {}
  /// Advances the time of a simulated device; others do nothing.
  virtual void advance(double /*seconds*/) noexcept {}
  /// Sets zero force, switches forces off and closes. May be called more than once.
  virtual void stop() noexcept = 0;
  /// Called by whoever ran the loop, after it and after stop(): waits a bounded time for what the
  /// device still learns about the end of its connection. True if status() may be asked once more.
  virtual bool learn_end() noexcept { return false; }
  /// Switches forces off as far as possible while another thread is stuck in a call.
  virtual void cut_forces() noexcept = 0;
};

}  // namespace tpm::haptics
