#include "tpm/device/omega7.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

constexpr int kTimeGuard = 1, kMotorSaturated = 2;
constexpr int kOmega7Right = 35, kOmega7Left = 37;
constexpr int kForcesOffEntry = 14;
constexpr std::size_t kStatusRoom = 32;  // newer libraries fill more entries than older ones
constexpr double kWatchdogTick_s = 125e-6;

Error device_error(std::string_view what, std::string_view expected) {
  return {ExitCode::environment, "omega7", what, expected};
}

/// Of the last call in this thread.
std::string words_of(const DhdCalls& call) {
  const int number = call.error_get_last();
  const char* words = call.error_get_last_text();
  return fmt::format("error {} ({})", number, printable(words == nullptr ? "no words" : words));
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

}  // namespace

Omega7::Omega7(const std::filesystem::path& library)
    : library_(std::make_shared<DhdLibrary>(library)), call_(library_->calls()) {}

Omega7::~Omega7() {
  stop();
}

std::string Omega7::last_words() const {
  return words_of(call_);
}

void Omega7::require(int answer, const char* call) const {
  if (answer >= 0) return;
  throw device_error(fmt::format("{} failed: {}", call, last_words()), "");
}

const DeviceIdentity& Omega7::open() {
  const int count = call_.get_device_count();
  if (count < 1) {
    throw device_error(count < 0 ? "cannot look for devices: " + last_words() : "no device found",
                       "an Omega.7, switched on and plugged in, that this user may open");
  }
  // The drd calls know only a device that drdOpenID opened.
  const bool with_drd = library_->initialises();
  const int id = with_drd ? call_.drd_open_id(0) : call_.open_id(0);
  require(id, with_drd ? "drdOpenID" : "dhdOpenID");
  id_ = static_cast<char>(id);
  open_ = true;

  const int type = call_.get_system_type(id_);
  const char* name = call_.get_system_name(id_);
  if (type != kOmega7Right && type != kOmega7Left) {
    throw device_error(fmt::format("the device is of type {} ({})", type,
                                   printable(name == nullptr ? "no name" : name)),
                       "an Omega.7, type 35 or 37");
  }
  identity_.kind = "omega7";
  identity_.name = name == nullptr ? "Omega.7" : printable(name);
  unsigned short serial = 0;
  if (call_.get_serial_number(&serial, id_) >= 0) identity_.serial = std::to_string(serial);
  double firmware = 0.0;
  if (call_.get_version(&firmware, id_) >= 0) identity_.firmware = fmt::format("{:.2f}", firmware);
  identity_.library = library_->file();
  identity_.library_version = library_->version();
  identity_.link = link_of(call_.get_com_mode(id_));
  identity_.left_handed = call_.is_left_handed(id_);
  identity_.hardware =
      identity_.link == DeviceLink::synchronous || identity_.link == DeviceLink::asynchronous;
  return identity_;
}

void Omega7::require_initialised(const DevicePreparation& preparation) {
  if (!library_->initialises()) {
    if (preparation.take_as_ready) return;
    throw device_error(
        fmt::format("{} cannot tell whether the device is initialised", library_->file()),
        "libdrd.so.3, or --take-as-ready if it is");
  }
  if (call_.drd_is_initialized(id_)) return;
  if (!preparation.may_move) {
    throw device_error("is not initialised, for which it moves by itself",
                       "--may-move with free space around the device");
  }
  initialise(preparation.interrupted);
  require(call_.drd_stop(true, id_), "drdStop");
}

/// drdAutoInit moves the device and blocks until it has done so: it runs in a thread of its own,
/// and whoever waits for it can stop the motors.
void Omega7::initialise(const std::function<bool()>& interrupted) {
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
      throw device_error("the initialisation was interrupted; the motors are off", "");
    }
    mover.detach();
    cut_ = true;  // the library is not asked again while a call is stuck in it
    throw device_error(
        "the initialisation was interrupted and does not end; the motors were "
        "switched off",
        "the device to be switched off and on");
  }
  mover.join();
  if (moving->answer >= 0) return;
  throw device_error("drdAutoInit failed: " + moving->words, "");
}

void Omega7::stop_moving() noexcept {
  (void)call_.drd_stop(false, id_);
  (void)call_.stop(id_);
  (void)call_.enable_force(0, id_);
}

void Omega7::set_watchdog(double seconds) {
  const double ticks = std::clamp(std::round(seconds / kWatchdogTick_s), 1.0, 255.0);
  require(call_.enable_expert_mode(), "dhdEnableExpertMode");
  const int answer = call_.set_watchdog(static_cast<unsigned char>(ticks), id_);
  const std::string words = answer < 0 ? last_words() : "";
  require(call_.disable_expert_mode(), "dhdDisableExpertMode");
  if (answer < 0) throw device_error("dhdSetWatchdog failed: " + words, "");
}

void Omega7::prepare(const DevicePreparation& preparation) {
  require_initialised(preparation);
  prepared_ = true;
  set_watchdog(preparation.watchdog_s);
  require(call_.set_max_force(preparation.max_force_N, id_), "dhdSetMaxForce");
  require(call_.set_gravity_compensation(1, id_), "dhdSetGravityCompensation");
  require(call_.set_brakes(0, id_), "dhdSetBrakes");
  require(call_.enable_force(1, id_), "dhdEnableForce");
  require(call_.set_force(0.0, 0.0, 0.0, id_), "dhdSetForce");
  status_ = {};
}

void Omega7::note_error() noexcept {
  status_.error = call_.error_get_last();
  const char* words = call_.error_get_last_text();
  if (words == nullptr) words = "no words";
  const std::size_t length = std::min(std::strlen(words), sizeof status_.error_text - 1);
  std::memcpy(status_.error_text, words, length);
  status_.error_text[length] = '\0';
}

DeviceAnswer Omega7::judged(int answer) noexcept {
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

DeviceAnswer Omega7::read(Eigen::Vector3d& position_m) noexcept {
  if (cut_) return DeviceAnswer::failed;
  Eigen::Vector3d at;
  const DeviceAnswer answer = judged(call_.get_position(&at.x(), &at.y(), &at.z(), id_));
  if (answer != DeviceAnswer::failed) position_m = at;
  return answer;
}

DeviceAnswer Omega7::write(const Eigen::Vector3d& force_N) noexcept {
  if (cut_) return DeviceAnswer::failed;  // never again, should the stuck thread come back
  return judged(call_.set_force(force_N.x(), force_N.y(), force_N.z(), id_));
}

DeviceStatus Omega7::status() noexcept {
  if (cut_) return status_;
  int entries[kStatusRoom] = {};
  if (judged(call_.get_status(entries, id_)) != DeviceAnswer::failed) {
    const int cause = entries[kForcesOffEntry];
    status_.forces_off =
        cause >= 0 && cause <= 6 ? static_cast<ForcesOff>(cause) : ForcesOff::unknown;
  }
  return status_;
}

void Omega7::stop() noexcept {
  if (!open_) return;
  open_ = false;
  if (cut_) return;
  // Each call once, whatever it answers: an unplugged device answers errors for ever.
  if (prepared_) {
    (void)call_.set_force(0.0, 0.0, 0.0, id_);
    (void)call_.stop(id_);
    (void)call_.enable_force(0, id_);
  }
  (void)(library_->initialises() ? call_.drd_close(id_) : call_.close(id_));
}

void Omega7::cut_forces() noexcept {
  cut_ = true;
  (void)call_.stop(id_);
  (void)call_.enable_force(0, id_);
}

int count_omega7(const std::filesystem::path& library) {
  const DhdLibrary loaded(library);
  return loaded.calls().get_device_count();
}

}  // namespace tpm
