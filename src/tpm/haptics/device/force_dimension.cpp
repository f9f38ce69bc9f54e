#include "tpm/haptics/device/force_dimension.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr int kTimeGuard = 1, kMotorSaturated = 2;
constexpr int kForcesOffEntry = 14;
constexpr std::size_t kStatusRoom = 32;  // newer libraries fill more entries than older ones
constexpr double kWatchdogTick_s = 125e-6;

/// The maker's numbers; a hand where there are two.
struct TypeNumber {
  int type;
  std::string_view kind;
};

constexpr TypeNumber kTypes[] = {
    {35, "omega7"},   {37, "omega7"},   {33, "omega3"},   {34, "omega6"},   {36, "omega6"},
    {63, "delta3"},   {206, "sigma3"},  {104, "sigma7"},  {105, "sigma7"},  {203, "lambda3"},
    {131, "lambda6"}, {132, "lambda6"}, {108, "lambda7"}, {109, "lambda7"}, {60, "falcon"}};

/// Empty for a type that is not known.
std::string kind_of(int type) {
  for (const TypeNumber& known : kTypes) {
    if (known.type == type) return std::string(known.kind);
  }
  return {};
}

std::string type_words(const SeenDevice& device) {
  const std::string known = device.kind.empty() ? "unknown here" : "--device " + device.kind;
  return fmt::format("type {} ({}, {})", device.type, device.name, known);
}

/// The drd calls know only a device that drdOpenID opened.
int open_device(const DhdLibrary& library, int index) {
  const DhdCalls& call = library.calls();
  return library.initialises() ? call.drd_open_id(static_cast<char>(index))
                               : call.open_id(static_cast<char>(index));
}

void close_device(const DhdLibrary& library, char id) {
  (void)(library.initialises() ? library.calls().drd_close(id) : library.calls().close(id));
}

DeviceLink link_of(int mode) {
  switch (mode) {
    case 0:
      return DeviceLink::synchronous;
    case 1:
      return DeviceLink::asynchronous;
    case 3:
      return DeviceLink::simulated;
    case 4:
      return DeviceLink::network;
    default:
      return DeviceLink::unknown;
  }
}

/// A link that is not known may lead to motors.
bool is_simulated(DeviceLink link) {
  return link == DeviceLink::simulated || link == DeviceLink::network;
}

/// Of a device that is open.
void look_at(const DhdCalls& call, char id, SeenDevice& seen) {
  seen.type = call.get_system_type(id);
  seen.kind = kind_of(seen.type);
  const char* name = call.get_system_name(id);
  seen.name = name == nullptr ? "no name" : printable(name);
  unsigned short serial = 0;
  if (call.get_serial_number(&serial, id) >= 0) seen.serial = serial;
  seen.link = link_of(call.get_com_mode(id));
  seen.simulated = is_simulated(seen.link);
}

/// Of the last call in this thread.
std::string words_of(const DhdCalls& call) {
  const int number = call.error_get_last();
  const char* words = call.error_get_last_text();
  return fmt::format("error {} ({})", number, printable(words == nullptr ? "no words" : words));
}

std::vector<SeenDevice> look_around(const DhdLibrary& library, int count) {
  std::vector<SeenDevice> devices;
  for (int index = 0; index < count; ++index) {
    SeenDevice seen;
    seen.index = index;
    const int id = open_device(library, index);
    if (id < 0) {
      seen.problem = words_of(library.calls());
    } else {
      look_at(library.calls(), static_cast<char>(id), seen);
      close_device(library, static_cast<char>(id));
    }
    devices.push_back(std::move(seen));
  }
  return devices;
}

std::string in_a_row(const std::vector<SeenDevice>& devices) {
  std::vector<std::string> words;
  words.reserve(devices.size());
  for (const SeenDevice& d : devices) {
    words.push_back(d.problem.empty()
                        ? fmt::format("{}: {}, serial {}", d.index, type_words(d), d.serial)
                        : fmt::format("{}: {}", d.index, d.problem));
  }
  return fmt::format("{}", fmt::join(words, "; "));
}

}  // namespace

ForceDimension::ForceDimension(const std::filesystem::path& library, std::string_view kind,
                               DeviceSelection which)
    : library_(std::make_shared<DhdLibrary>(library)),
      call_(library_->calls()),
      limits_(limits_of(kind)),
      which_(which) {}

ForceDimension::~ForceDimension() {
  stop();
}

Error ForceDimension::fault(std::string_view what, std::string_view expected) const {
  return {ExitCode::environment, limits_.kind, what, expected};
}

std::string ForceDimension::last_words() const {
  return words_of(call_);
}

void ForceDimension::require(int answer, const char* call) const {
  if (answer >= 0) return;
  throw fault(fmt::format("{} failed: {}", call, last_words()), "");
}

/// The place of the wanted device among all that there are.
int ForceDimension::chosen_index(int count) const {
  if (which_.index) {
    if (*which_.index < count) return *which_.index;
    throw fault(fmt::format("there is no device {}", *which_.index),
                fmt::format("--index 0 to {}", count - 1));
  }
  if (count == 1 && !which_.serial) return 0;
  const std::vector<SeenDevice> devices = look_around(*library_, count);
  std::vector<int> fitting;
  for (const SeenDevice& d : devices) {
    const bool fits = which_.serial ? d.serial == *which_.serial : d.kind == limits_.kind;
    if (fits) fitting.push_back(d.index);
  }
  if (fitting.size() == 1) return fitting.front();
  const std::string wanted = which_.serial ? fmt::format("of serial {}", *which_.serial)
                                           : fmt::format("'{}'", limits_.name);
  throw fault(
      fmt::format("{} devices are {}; there are {}", fitting.size(), wanted, in_a_row(devices)),
      "--serial NUMBER or --index NUMBER of one of them");
}

const DeviceIdentity& ForceDimension::open() {
  const int count = call_.get_device_count();
  if (count < 1) {
    throw fault(
        count < 0 ? "cannot look for devices: " + last_words() : "no device found",
        fmt::format("{}, switched on and plugged in, that this user may open", limits_.name));
  }
  const int id = open_device(*library_, chosen_index(count));
  require(id, library_->initialises() ? "drdOpenID" : "dhdOpenID");
  id_ = static_cast<char>(id);
  open_ = true;
  identify();
  return identity_;
}

void ForceDimension::identify() {
  SeenDevice seen;
  look_at(call_, id_, seen);
  if (seen.kind != limits_.kind) {
    throw fault("the device is of " + type_words(seen),
                fmt::format("{}, or the --device that it is", limits_.name));
  }
  if (which_.serial && seen.serial != *which_.serial) {
    throw fault(fmt::format("the device has serial {}", seen.serial),
                fmt::format("serial {}", *which_.serial));
  }
  identity_.kind = std::string(limits_.kind);
  identity_.name = seen.name;
  if (seen.serial >= 0) identity_.serial = std::to_string(seen.serial);
  double firmware = 0.0;
  if (call_.get_version(&firmware, id_) >= 0) identity_.firmware = fmt::format("{:.2f}", firmware);
  identity_.library = library_->file();
  identity_.library_version = library_->version();
  identity_.link = seen.link;
  identity_.left_handed = call_.is_left_handed(id_);
  identity_.hardware = !seen.simulated;
  gripper_ = call_.has_gripper != nullptr && call_.has_gripper(id_);
  if (!limits_.tried) {
    identity_.assumptions.push_back(
        {"never_tried",
         fmt::format("never tried with {}: it is taken to have at least the force, workspace and "
                     "stability of {} N, {} mm and {} N/m",
                     limits_.name, limits_.force_N, 1e3 * limits_.reach_m,
                     limits_.stiffness_N_per_m)});
    for (const auto& [limit, source] : limits_.provenance) {
      identity_.assumptions.push_back({"limit_source", fmt::format("{}: {}", limit, source)});
    }
  }
}

void ForceDimension::require_initialised(const DevicePreparation& preparation) {
  if (!library_->initialises()) {
    if (preparation.take_as_ready) return;
    throw fault(fmt::format("{} cannot tell whether the device is initialised", library_->file()),
                "libdrd.so.3, or --take-as-ready if it is");
  }
  if (call_.drd_is_initialized(id_)) return;
  if (!preparation.may_move) {
    throw fault("is not initialised, for which it moves by itself",
                "--may-move with free space around the device");
  }
  moves_itself_ = true;
  initialise(preparation.interrupted);
  moves_itself_ = false;
  require(call_.drd_stop(true, id_), "drdStop");
}

/// drdAutoInit moves the device and blocks until it has done so: it runs in a thread of its own,
/// and whoever waits for it can stop the motors.
void ForceDimension::initialise(const std::function<bool()>& interrupted) {
  struct Moving {
    std::atomic<bool> over{false};
    int answer = 0;
    std::string words;  // of the library, which keeps them for each thread
  };
  const auto moving = std::make_shared<Moving>();
  std::thread mover([moving, library = library_, id = id_] {
    moving->answer = library->calls().drd_auto_init(id);
    if (moving->answer < 0) moving->words = words_of(library->calls());
    moving->over = true;
  });
  bool stopped = false;
  const auto wait = [&](std::chrono::milliseconds limit) {
    const auto until = std::chrono::steady_clock::now() + limit;
    while (!moving->over && std::chrono::steady_clock::now() < until) {
      if (!stopped && interrupted && interrupted()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  };
  try {
    while (!moving->over && !(interrupted && interrupted())) wait(std::chrono::hours(1));
  } catch (...) {
    stop_moving();
    mover.detach();
    throw;
  }
  if (!moving->over) {
    stopped = true;
    stop_moving();
    constexpr std::chrono::milliseconds kPatience{2000};
    wait(kPatience);
    if (moving->over) {
      mover.join();
      throw fault("the initialisation was interrupted; the motors are off", "");
    }
    mover.detach();
    cut_ = true;  // the library is not asked again while a call is stuck in it
    throw fault(
        "the initialisation was interrupted and does not end; the motors were "
        "switched off",
        "the device to be switched off and on");
  }
  mover.join();
  if (moving->answer >= 0) return;
  throw fault("drdAutoInit failed: " + moving->words, "");
}

void ForceDimension::stop_moving() noexcept {
  (void)call_.drd_stop(false, id_);
  (void)call_.stop(id_);
  (void)call_.enable_force(0, id_);
}

void ForceDimension::set_watchdog(double seconds) {
  const double ticks = std::clamp(std::round(seconds / kWatchdogTick_s), 1.0, 255.0);
  require(call_.enable_expert_mode(), "dhdEnableExpertMode");
  const int answer = call_.set_watchdog(static_cast<unsigned char>(ticks), id_);
  const std::string words = answer < 0 ? last_words() : "";
  require(call_.disable_expert_mode(), "dhdDisableExpertMode");
  if (answer < 0) throw fault("dhdSetWatchdog failed: " + words, "");
}

void ForceDimension::set_mounting(const DeviceMounting& mounting) {
  const auto set = [this](const std::optional<double>& value, auto call, const char* name) {
    if (!value) return;
    if (call == nullptr) {
      throw fault(fmt::format("{} has no {}", library_->file(), name),
                  "a newer library, or a session without it");
    }
    require(call(*value, id_), name);
  };
  set(mounting.angle_rad, call_.set_device_angle, "dhdSetDeviceAngleRad");
  set(mounting.base_angle_x_rad, call_.set_base_angle_x, "dhdSetBaseAngleXRad");
  set(mounting.base_angle_z_rad, call_.set_base_angle_z, "dhdSetBaseAngleZRad");
  set(mounting.effector_mass_kg, call_.set_effector_mass, "dhdSetEffectorMass");
}

void ForceDimension::prepare(const DevicePreparation& preparation) {
  const bool without_clock =
      call_.stand_in_without_clock != nullptr && call_.stand_in_without_clock() != 0;
  if (!preparation.real_time && identity_.hardware && !without_clock) {
    throw fault("a device with motors keeps the clock", "--clock real");
  }
  require_initialised(preparation);
  prepared_ = true;
  set_mounting(preparation.mounting);
  set_watchdog(preparation.watchdog_s);
  require(call_.set_max_force(preparation.max_force_N, id_), "dhdSetMaxForce");
  require(call_.set_gravity_compensation(1, id_), "dhdSetGravityCompensation");
  require(call_.set_brakes(0, id_), "dhdSetBrakes");
  status_ = {};
}

void ForceDimension::enable_forces() {
  require(call_.enable_force(1, id_), "dhdEnableForce");
  // A gripper keeps the force that it was commanded last, by whomever: 0 from here on.
  if (gripper_ && call_.set_force_torque_gripper != nullptr) {
    require(call_.set_force_torque_gripper(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, id_),
            "dhdSetForceAndTorqueAndGripperForce");
  }
  require(call_.set_force(0.0, 0.0, 0.0, id_), "dhdSetForce");
}

void ForceDimension::note_error() noexcept {
  status_.error = call_.error_get_last();
  const char* words = call_.error_get_last_text();
  if (words == nullptr) words = "no words";
  const std::size_t length = std::min(std::strlen(words), sizeof status_.error_text - 1);
  std::memcpy(status_.error_text, words, length);
  status_.error_text[length] = '\0';
}

DeviceAnswer ForceDimension::noted(int answer) noexcept {
  if (answer == kTimeGuard) {
    ++status_.time_guards;
    return DeviceAnswer::time_guard;
  }
  if (answer == kMotorSaturated) {
    ++status_.saturations;
    return DeviceAnswer::saturated;
  }
  if (answer >= 0) return DeviceAnswer::ok;
  note_error();
  return DeviceAnswer::failed;
}

DeviceAnswer ForceDimension::read(Eigen::Vector3d& position_m) noexcept {
  if (cut_) return DeviceAnswer::failed;
  Eigen::Vector3d at;
  const DeviceAnswer answer = noted(call_.get_position(&at.x(), &at.y(), &at.z(), id_));
  if (answer != DeviceAnswer::failed) position_m = at;
  return answer;
}

DeviceAnswer ForceDimension::write(const Eigen::Vector3d& force_N) noexcept {
  if (cut_) return DeviceAnswer::failed;  // never again, should the stuck thread come back
  return noted(call_.set_force(force_N.x(), force_N.y(), force_N.z(), id_));
}

DeviceStatus ForceDimension::status() noexcept {
  if (cut_) return status_;
  int entries[kStatusRoom] = {};
  status_.failed = noted(call_.get_status(entries, id_)) == DeviceAnswer::failed;
  if (!status_.failed) {
    const int cause = entries[kForcesOffEntry];
    status_.forces_off =
        cause >= 0 && cause <= 6 ? static_cast<ForcesOff>(cause) : ForcesOff::unknown;
  }
  return status_;
}

HandState ForceDimension::hand() noexcept {
  HandState hand;
  if (cut_) return hand;
  double gap_m = 0.0;
  if (gripper_ && call_.get_gripper_gap(&gap_m, id_) >= 0)
    hand.gripper_m = static_cast<float>(gap_m);
  if (call_.get_button_mask != nullptr) hand.buttons = call_.get_button_mask(id_);
  return hand;
}

void ForceDimension::stop() noexcept {
  if (!open_) return;
  open_ = false;
  if (cut_) return;
  // Each call once, whatever it answers: an unplugged device answers errors for ever.
  if (prepared_) {
    (void)call_.set_force(0.0, 0.0, 0.0, id_);
    (void)call_.stop(id_);
    (void)call_.enable_force(0, id_);
  }
  close_device(*library_, id_);
}

void ForceDimension::cut_forces() noexcept {
  cut_ = true;
  if (!open_) return;
  if (moves_itself_) (void)call_.drd_stop(false, id_);
  (void)call_.stop(id_);
  (void)call_.enable_force(0, id_);
}

std::vector<SeenDevice> seen_devices(const std::filesystem::path& library) {
  const DhdLibrary loaded(library);
  return look_around(loaded, loaded.calls().get_device_count());
}

}  // namespace tpm::haptics
