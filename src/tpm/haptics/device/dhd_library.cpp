#include "tpm/haptics/device/dhd_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace fs = std::filesystem;
namespace {

constexpr const char* kNames[] = {"libdrd.so.3", "libdhd.so.3"};

std::vector<fs::path> usual_places() {
  std::vector<fs::path> places;
  const auto beneath = [&](const fs::path& folder) {
    for (const char* name : kNames) places.push_back(folder / name);
  };
  if (const char* sdk = std::getenv("FDSDK")) {
    beneath(fs::path(sdk) / "lib" / "release" / "lin-x86_64-gcc");
  }
  for (const char* name : kNames) places.emplace_back(name);
  if (const char* home = std::getenv("HOME")) beneath(fs::path(home) / ".local" / "lib");
  beneath("/usr/local/lib");
  return places;
}

std::string last_loader_word() {
  const char* word = dlerror();
  return printable(word == nullptr ? "no reason given" : word, 200);
}

template <class Call>
void find(void* handle, const char* name, Call& call, std::vector<std::string>& missing) {
  call = reinterpret_cast<Call>(dlsym(handle, name));  // NOLINT: what dlsym is for
  if (call == nullptr) missing.emplace_back(name);
}

}  // namespace

DhdLibrary::DhdLibrary(const fs::path& file) {
  // A bare name would be looked for where the system keeps its libraries.
  load(file.empty() ? usual_places()
                    : std::vector<fs::path>{file.has_parent_path() ? file : fs::path(".") / file});
  try {
    find_symbols();
    require_version();
  } catch (...) {
    dlclose(handle_);
    throw;
  }
}

DhdLibrary::~DhdLibrary() {
  dlclose(handle_);
}

void DhdLibrary::load(const std::vector<fs::path>& candidates) {
  std::vector<std::string> tried;
  for (const fs::path& candidate : candidates) {
    handle_ = dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_ != nullptr) {
      file_ = candidate.string();
      return;
    }
    tried.push_back(candidates.size() == 1 ? last_loader_word() : candidate.string());
    // A library that stands there and cannot be loaded (libusb-1.0 is missing, say) is the answer.
    if (candidate.has_parent_path() && fs::exists(candidate) && candidates.size() > 1) {
      throw Error(ExitCode::environment, candidate.string(),
                  "cannot be loaded: " + last_loader_word(), "the Force Dimension SDK, version 3");
    }
  }
  throw Error(ExitCode::environment, "Force Dimension library",
              fmt::format("not found; tried {}", fmt::join(tried, ", ")),
              "--dhd-library FILE, or $FDSDK set to the folder of the SDK");
}

void DhdLibrary::find_symbols() {
  std::vector<std::string> missing, without_drd, not_needed;
  DhdCalls& c = calls_;
  find(handle_, "dhdGetDeviceCount", c.get_device_count, missing);
  find(handle_, "dhdOpenID", c.open_id, missing);
  find(handle_, "dhdClose", c.close, missing);
  find(handle_, "dhdGetSystemType", c.get_system_type, missing);
  find(handle_, "dhdGetSystemName", c.get_system_name, missing);
  find(handle_, "dhdGetSerialNumber", c.get_serial_number, missing);
  find(handle_, "dhdGetVersion", c.get_version, missing);
  find(handle_, "dhdGetSDKVersion", c.get_sdk_version, missing);
  find(handle_, "dhdIsLeftHanded", c.is_left_handed, missing);
  find(handle_, "dhdGetComMode", c.get_com_mode, missing);
  find(handle_, "dhdSetGravityCompensation", c.set_gravity_compensation, missing);
  find(handle_, "dhdSetMaxForce", c.set_max_force, missing);
  find(handle_, "dhdSetBrakes", c.set_brakes, missing);
  find(handle_, "dhdEnableForce", c.enable_force, missing);
  find(handle_, "dhdEnableExpertMode", c.enable_expert_mode, missing);
  find(handle_, "dhdDisableExpertMode", c.disable_expert_mode, missing);
  find(handle_, "dhdSetWatchdog", c.set_watchdog, missing);
  find(handle_, "dhdGetPosition", c.get_position, missing);
  find(handle_, "dhdSetForce", c.set_force, missing);
  find(handle_, "dhdGetStatus", c.get_status, missing);
  find(handle_, "dhdStop", c.stop, missing);
  find(handle_, "dhdErrorGetLast", c.error_get_last, missing);
  find(handle_, "dhdErrorGetLastStr", c.error_get_last_text, missing);
  find(handle_, "dhdHasGripper", c.has_gripper, not_needed);
  find(handle_, "dhdGetGripperGap", c.get_gripper_gap, not_needed);
  find(handle_, "dhdGetButtonMask", c.get_button_mask, not_needed);
  find(handle_, "dhdSetForceAndTorqueAndGripperForce", c.set_force_torque_gripper, not_needed);
  find(handle_, "dhdSetEffectorMass", c.set_effector_mass, not_needed);
  find(handle_, "dhdSetDeviceAngleRad", c.set_device_angle, not_needed);
  find(handle_, "dhdSetBaseAngleXRad", c.set_base_angle_x, not_needed);
  find(handle_, "dhdSetBaseAngleZRad", c.set_base_angle_z, not_needed);
  find(handle_, "tpm_stand_in_without_clock", c.stand_in_without_clock, not_needed);
  if (c.get_gripper_gap == nullptr) c.has_gripper = nullptr;
  find(handle_, "drdOpenID", c.drd_open_id, without_drd);
  find(handle_, "drdClose", c.drd_close, without_drd);
  find(handle_, "drdIsInitialized", c.drd_is_initialized, without_drd);
  find(handle_, "drdAutoInit", c.drd_auto_init, without_drd);
  find(handle_, "drdStop", c.drd_stop, without_drd);
  if (missing.empty() && !without_drd.empty() && without_drd.size() < 5) missing = without_drd;
  if (missing.empty()) return;
  throw Error(ExitCode::environment, file_, fmt::format("has no {}", fmt::join(missing, ", ")),
              "libdrd.so.3 or libdhd.so.3 of the Force Dimension SDK, version 3");
}

void DhdLibrary::require_version() {
  int part[4] = {0, 0, 0, 0};
  calls_.get_sdk_version(&part[0], &part[1], &part[2], &part[3]);
  version_ = fmt::format("{}.{}.{}.{}", part[0], part[1], part[2], part[3]);
  if (part[0] == 3) return;
  throw Error(ExitCode::environment, file_, "is version " + version_, "version 3");
}

}  // namespace tpm::haptics
