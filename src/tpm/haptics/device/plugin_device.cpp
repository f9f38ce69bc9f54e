#include "tpm/haptics/device/plugin_device.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr const char* kPluginEntry = "tpm_device_plugin_get";
constexpr std::string_view kPluginKind = "plugin";

/// Text of a plugin up to its closing 0, or as far as its room goes.
template <std::size_t N>
std::string text_of(const char (&text)[N]) {
  return std::string(text, strnlen(text, N));
}

/// Room for the words of a plugin.
struct PluginMessage {
  char text[TPM_DEVICE_MESSAGE] = {};
  [[nodiscard]] std::string words() const {
    const std::string said = printable(text_of(text), TPM_DEVICE_MESSAGE);
    return said.empty() ? std::string("gives no reason") : said;
  }
};

Error plugin_fault(const std::string& file, std::string_view what, std::string_view expected = {}) {
  return {ExitCode::environment, file, what, expected};
}

void require_limit(const std::string& file, const char* name, double value, double least,
                   double most, bool least_allowed) {
  const bool above = least_allowed ? value >= least : value > least;
  if (std::isfinite(value) && above && value <= most) return;
  throw plugin_fault(file, fmt::format("says {} is {}", name, shortest(value)),
                     fmt::format("{} {} and at most {}", least_allowed ? "at least" : "above",
                                 shortest(least), shortest(most)));
}

void require_sound(const std::string& file, const tpm_device_limits& limits) {
  constexpr double kMostForce_N = 50.0, kMostReach_m = 1.0, kAny = 1e9, kLeastRampIn_s = 0.1;
  constexpr double kMostRampIn_s = 60.0;
  constexpr int kMostDelay = 1000;
  require_limit(file, "force_N", limits.force_N, 0.0, kMostForce_N, false);
  require_limit(file, "reach_m", limits.reach_m, 0.0, kMostReach_m, false);
  require_limit(file, "stiffness_N_per_m", limits.stiffness_N_per_m, 0.0, kAny, false);
  require_limit(file, "damping_N_s_per_m", limits.damping_N_s_per_m, 0.0, kAny, true);
  require_limit(file, "slew_N_per_s", limits.slew_N_per_s, 0.0, kAny, false);
  require_limit(file, "least_ramp_in_s", limits.least_ramp_in_s, kLeastRampIn_s, kMostRampIn_s,
                true);
  require_limit(file, "friction_N_s_per_m", limits.friction_N_s_per_m, 0.0,
                kMostHandleFriction_N_s_per_m, true);
  require_limit(file, "delay_periods", limits.delay_periods, 0.0, kMostDelay, true);
}

ForcesOff plugin_forces_off(std::int32_t number) {
  constexpr std::int32_t kLast = TPM_DEVICE_OFF_DEAD_MAN;
  if (number >= 0 && number <= kLast) return static_cast<ForcesOff>(number);
  return ForcesOff::unknown;
}

int serial_number(const std::string& serial) {
  int number = -1;
  const char* end = serial.data() + serial.size();
  const auto [read, error] = std::from_chars(serial.data(), end, number);
  return error == std::errc() && read == end ? number : -1;
}

int chosen_plugin_device(const DevicePlugin& plugin, const DeviceSelection& which) {
  const int count = plugin.count();
  if (count < 1) {
    throw plugin_fault(plugin.file(), "sees no device", "one, switched on and plugged in");
  }
  if (which.index) {
    if (*which.index < count) return *which.index;
    throw plugin_fault(plugin.file(), fmt::format("there is no device {}", *which.index),
                       fmt::format("--index 0 to {}", count - 1));
  }
  std::vector<std::string> words;
  std::vector<int> fitting;
  for (const SeenDevice& seen : seen_devices(plugin)) {
    words.push_back(fmt::format("{}: {}, serial {}", seen.index, seen.name, seen.serial));
    if (!which.serial || seen.serial == *which.serial) fitting.push_back(seen.index);
  }
  if (fitting.size() == 1) return fitting.front();
  throw plugin_fault(
      plugin.file(),
      fmt::format("{} devices fit; there are {}", fitting.size(), fmt::join(words, "; ")),
      "--serial NUMBER or --index NUMBER of one of them");
}

}  // namespace

DevicePlugin::DevicePlugin(const std::filesystem::path& file) {
  // A bare name would be looked for where the system keeps its libraries.
  file_ = file.has_parent_path() ? file.string() : (std::filesystem::path(".") / file).string();
  handle_ = dlopen(file_.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle_ == nullptr) {
    const char* word = dlerror();
    throw plugin_fault(
        file_, "cannot be loaded: " + printable(word == nullptr ? "no reason given" : word, 200),
        "a shared library with tpmkit/haptic_device.h's " + std::string(kPluginEntry));
  }
  try {
    load();
  } catch (...) {
    dlclose(handle_);
    throw;
  }
}

DevicePlugin::~DevicePlugin() {
  dlclose(handle_);
}

void DevicePlugin::load() {
  using Entry = const tpm_device_plugin* (*)();
  const auto entry =
      reinterpret_cast<Entry>(dlsym(handle_, kPluginEntry));  // NOLINT: what it is for
  if (entry == nullptr) {
    throw plugin_fault(file_, fmt::format("has no {}", kPluginEntry),
                       "a plugin after tpmkit/haptic_device.h");
  }
  plugin_ = entry();
  if (plugin_ == nullptr)
    throw plugin_fault(file_, fmt::format("{} answers nothing", kPluginEntry));
  constexpr std::size_t kFirst = offsetof(tpm_device_plugin, enable_forces);
  if (plugin_->version != TPM_DEVICE_PLUGIN_VERSION || plugin_->size < kFirst) {
    throw plugin_fault(
        file_,
        fmt::format("is a plugin of version {} and {} bytes", plugin_->version, plugin_->size),
        fmt::format("version {} and at least {} bytes", TPM_DEVICE_PLUGIN_VERSION, kFirst));
  }
  std::vector<std::string> missing;
  const auto look = [&missing](bool there, const char* name) {
    if (!there) missing.emplace_back(name);
  };
  look(plugin_->name != nullptr, "name");
  look(plugin_->count != nullptr, "count");
  look(plugin_->describe != nullptr, "describe");
  look(plugin_->open != nullptr, "open");
  look(plugin_->prepare != nullptr, "prepare");
  look(plugin_->read != nullptr, "read");
  look(plugin_->write != nullptr, "write");
  look(plugin_->status != nullptr, "status");
  look(plugin_->stop != nullptr, "stop");
  look(plugin_->cut_forces != nullptr, "cut_forces");
  look(plugin_->close != nullptr, "close");
  if (missing.empty()) return;
  throw plugin_fault(file_, fmt::format("has no {}", fmt::join(missing, ", ")),
                     "every function of tpm_device_plugin but hand and enable_forces");
}

bool DevicePlugin::enables_forces() const {
  constexpr std::size_t kEnd =
      offsetof(tpm_device_plugin, enable_forces) + sizeof plugin_->enable_forces;
  return plugin_->size >= kEnd && plugin_->enable_forces != nullptr;
}

bool DevicePlugin::is_stand_in_without_clock() const {
  using Call = int (*)();
  const auto call = reinterpret_cast<Call>(  // NOLINT: what it is for
      dlsym(handle_, "tpm_stand_in_without_clock"));
  return call != nullptr && call() != 0;
}

std::string DevicePlugin::name() const {
  return printable(plugin_->name);
}

int DevicePlugin::count() const {
  PluginMessage message;
  const int count = plugin_->count(message.text);
  if (count < 0) throw plugin_fault(file_, "cannot look for devices: " + message.words());
  return count;
}

tpm_device_description DevicePlugin::describe(int index) const {
  PluginMessage message;
  tpm_device_description description{};
  description.size = sizeof description;
  description.version = TPM_DEVICE_PLUGIN_VERSION;
  if (plugin_->describe(index, &description, message.text) != TPM_DEVICE_OK) {
    throw plugin_fault(file_, fmt::format("cannot describe device {}: {}", index, message.words()));
  }
  require_sound(file_, description.limits);
  return description;
}

PluginDevice::PluginDevice(const std::filesystem::path& file, const DeviceSelection& which)
    : plugin_(std::make_shared<const DevicePlugin>(file)),
      call_(plugin_->calls()),
      index_(chosen_plugin_device(*plugin_, which)),
      description_(plugin_->describe(index_)) {
  identity_.kind = std::string(kPluginKind);
  identity_.name = printable(text_of(description_.name));
  identity_.serial = printable(text_of(description_.serial));
  identity_.firmware = printable(text_of(description_.firmware));
  identity_.library = plugin_->file();
  identity_.library_version = plugin_->name();
  identity_.link = description_.hardware != 0 ? DeviceLink::unknown : DeviceLink::none;
  identity_.hardware = description_.hardware != 0;
  identity_.assumptions.push_back(
      {"device_of_plugin",
       "a device of a plugin: its limits, its friction and whether it is hardware are what the "
       "plugin says"});
  const std::string told = text_of(description_.assumptions);
  for (std::size_t at = 0; at < told.size();) {
    const std::size_t end = std::min(told.find('\n', at), told.size());
    if (end > at) {
      identity_.assumptions.push_back(
          {"stated_by_plugin", printable(told.substr(at, end - at), 200)});
    }
    at = end + 1;
  }
}

PluginDevice::~PluginDevice() {
  stop();
  // A library that another thread is stuck in is not asked to free what that thread uses.
  if (device_ != nullptr && !cut_) call_.close(device_);
}

DeviceLimits PluginDevice::limits() const {
  const tpm_device_limits& said = description_.limits;
  DeviceLimits limits{};
  limits.kind = kPluginKind;
  limits.name = "device of a plugin";
  limits.tried = false;
  limits.force_N = said.force_N;
  limits.reach_m = said.reach_m;
  limits.stiffness_N_per_m = said.stiffness_N_per_m;
  limits.damping_N_s_per_m = said.damping_N_s_per_m;
  limits.slew_N_per_s = said.slew_N_per_s;
  limits.least_ramp_in_s = said.least_ramp_in_s;
  limits.friction_N_s_per_m = said.friction_N_s_per_m;
  limits.delay_periods = said.delay_periods;
  limits.simulated = description_.hardware == 0;
  return limits;
}

const DeviceIdentity& PluginDevice::open() {
  PluginMessage message;
  if (call_.open(index_, &device_, message.text) != TPM_DEVICE_OK || device_ == nullptr) {
    device_ = nullptr;
    throw plugin_fault(plugin_->file(),
                       fmt::format("cannot open device {}: {}", index_, message.words()));
  }
  return identity_;
}

void PluginDevice::prepare(const DevicePreparation& preparation) {
  if (!preparation.real_time && identity_.hardware && !plugin_->is_stand_in_without_clock()) {
    throw plugin_fault(plugin_->file(), "a device with motors keeps the clock", "--clock real");
  }
  const DeviceMounting& mounting = preparation.mounting;
  if (mounting.effector_mass_kg || mounting.angle_rad || mounting.base_angle_x_rad ||
      mounting.base_angle_z_rad) {
    throw plugin_fault(plugin_->file(), "a plugin is not told how its device is mounted",
                       "a session without 'mounting'");
  }
  preparation_ = {};
  preparation_.size = sizeof preparation_;
  preparation_.version = TPM_DEVICE_PLUGIN_VERSION;
  preparation_.period_s = preparation.period_s;
  preparation_.max_force_N = preparation.max_force_N;
  preparation_.watchdog_s = preparation.watchdog_s;
  preparation_.may_move = preparation.may_move ? 1 : 0;
  preparation_.real_time = preparation.real_time ? 1 : 0;
  // One that switches forces on here is prepared in enable_forces().
  if (plugin_->enables_forces()) prepare_plugin();
}

void PluginDevice::prepare_plugin() {
  PluginMessage message;
  if (call_.prepare(device_, &preparation_, message.text) == TPM_DEVICE_OK) return;
  throw plugin_fault(plugin_->file(), "cannot prepare the device: " + message.words());
}

void PluginDevice::enable_forces() {
  if (plugin_->enables_forces()) {
    PluginMessage message;
    if (call_.enable_forces(device_, message.text) != TPM_DEVICE_OK) {
      throw plugin_fault(plugin_->file(), "cannot switch forces on: " + message.words());
    }
  } else {
    prepare_plugin();
  }
  if (write(Eigen::Vector3d::Zero()) == DeviceAnswer::failed) {
    throw plugin_fault(plugin_->file(), "the first force, which is zero, cannot be sent");
  }
}

DeviceAnswer PluginDevice::read(Eigen::Vector3d& position_m) noexcept {
  double at_m[3] = {};
  const int answer = call_.read(device_, at_m);
  if (answer != TPM_DEVICE_OK && answer != TPM_DEVICE_OLD_VALUE) return DeviceAnswer::failed;
  position_m = Eigen::Map<const Eigen::Vector3d>(at_m);
  if (answer == TPM_DEVICE_OK) return DeviceAnswer::ok;
  ++status_.time_guards;
  return DeviceAnswer::time_guard;
}

DeviceAnswer PluginDevice::write(const Eigen::Vector3d& force_N) noexcept {
  if (cut_) return DeviceAnswer::failed;
  const int answer = call_.write(device_, force_N.data());
  if (answer == TPM_DEVICE_OK) return DeviceAnswer::ok;
  if (answer != TPM_DEVICE_SATURATED) return DeviceAnswer::failed;
  ++status_.saturations;
  return DeviceAnswer::saturated;
}

DeviceStatus PluginDevice::status() noexcept {
  tpm_device_status said{};
  said.size = sizeof said;
  said.version = TPM_DEVICE_PLUGIN_VERSION;
  status_.failed = call_.status(device_, &said) != TPM_DEVICE_OK;
  if (status_.failed) return status_;
  status_.forces_off = plugin_forces_off(said.forces_off);
  status_.error = said.error;
  std::memcpy(status_.error_text, said.error_text, sizeof status_.error_text);
  status_.error_text[sizeof status_.error_text - 1] = '\0';
  return status_;
}

HandState PluginDevice::hand() noexcept {
  HandState state;
  if (call_.hand == nullptr) return state;
  tpm_device_hand said{};
  said.size = sizeof said;
  said.version = TPM_DEVICE_PLUGIN_VERSION;
  said.gripper_m = state.gripper_m;
  std::copy(std::begin(state.grip), std::end(state.grip), said.grip);
  if (call_.hand(device_, &said) != TPM_DEVICE_OK) return state;
  if (description_.has_gripper != 0) state.gripper_m = said.gripper_m;
  state.buttons = said.buttons;
  std::copy(std::begin(said.grip), std::end(said.grip), state.grip);
  return state;
}

void PluginDevice::stop() noexcept {
  if (device_ != nullptr) call_.stop(device_);
}

void PluginDevice::cut_forces() noexcept {
  cut_ = true;
  if (device_ != nullptr) call_.cut_forces(device_);
}

std::vector<SeenDevice> seen_devices(const DevicePlugin& plugin) {
  std::vector<SeenDevice> devices;
  const int count = plugin.count();
  for (int index = 0; index < count; ++index) {
    SeenDevice seen;
    seen.index = index;
    try {
      const tpm_device_description description = plugin.describe(index);
      seen.kind = std::string(kPluginKind);
      seen.name = printable(text_of(description.name));
      seen.serial = serial_number(text_of(description.serial));
      seen.simulated = description.hardware == 0;
    } catch (const Error& error) {
      seen.problem = error.what();
    }
    devices.push_back(std::move(seen));
  }
  return devices;
}

}  // namespace tpm::haptics
