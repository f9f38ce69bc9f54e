#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace tpm::haptics {

/// The calls of the Force Dimension library that are used, found at run time. Own declarations of
/// its C interface; see docs/haptics.md.
struct DhdCalls {
  int (*get_device_count)();
  int (*open_id)(char index);
  int (*close)(char id);
  int (*get_system_type)(char id);
  const char* (*get_system_name)(char id);
  int (*get_serial_number)(unsigned short* number, char id);
  int (*get_version)(double* firmware, char id);
  void (*get_sdk_version)(int* major, int* minor, int* release, int* revision);
  bool (*is_left_handed)(char id);
  int (*get_com_mode)(char id);
  int (*set_gravity_compensation)(int on, char id);
  int (*set_max_force)(double newton, char id);
  int (*set_brakes)(int on, char id);
  int (*enable_force)(unsigned char on, char id);
  int (*enable_expert_mode)();
  int (*disable_expert_mode)();
  int (*set_watchdog)(unsigned char ticks, char id);
  int (*get_position)(double* x, double* y, double* z, char id);
  int (*set_force)(double x, double y, double z, char id);
  int (*get_status)(int* status, char id);
  int (*stop)(char id);
  int (*error_get_last)();
  const char* (*error_get_last_text)();
  // Not in every library; null then.
  bool (*has_gripper)(char id);
  int (*get_gripper_gap)(double* gap_m, char id);
  unsigned int (*get_button_mask)(char id);
  int (*set_force_torque_gripper)(double fx, double fy, double fz, double tx, double ty, double tz,
                                  double gripper, char id);
  int (*set_effector_mass)(double kg, char id);
  int (*set_device_angle)(double rad, char id);
  int (*set_base_angle_x)(double rad, char id);
  int (*set_base_angle_z)(double rad, char id);
  // Of libdrd; null if the library is libdhd alone. drd_is_initialized and drd_auto_init know only
  // a device that drd_open_id opened; after open_id they answer as if no device were there.
  int (*drd_open_id)(char index);
  int (*drd_close)(char id);
  bool (*drd_is_initialized)(char id);
  int (*drd_auto_init)(char id);
  int (*drd_stop)(bool keep_force, char id);
  /// Of the stand-ins of tests alone: not 0 where time passes by calls and not by the clock, so
  /// that a loop in virtual time may drive it. Null in the vendor's library.
  int (*stand_in_without_clock)();
};

/// The vendor's library, loaded for as long as this lives.
class DhdLibrary {
 public:
  /// Looks at `file` if it is given, else in $FDSDK, then for libdrd.so.3 and libdhd.so.3 where
  /// the system looks and in ~/.local/lib and /usr/local/lib.
  /// Throws Error(environment) that names what is missing: the file, with what was tried, the
  /// symbol, or version 3.
  explicit DhdLibrary(const std::filesystem::path& file);
  ~DhdLibrary();
  DhdLibrary(const DhdLibrary&) = delete;
  DhdLibrary& operator=(const DhdLibrary&) = delete;

  [[nodiscard]] const DhdCalls& calls() const { return calls_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] const std::string& version() const { return version_; }
  [[nodiscard]] bool initialises() const { return calls_.drd_auto_init != nullptr; }

 private:
  void load(const std::vector<std::filesystem::path>& candidates);
  void find_symbols();
  void require_version();

  void* handle_ = nullptr;
  DhdCalls calls_{};
  std::string file_, version_;
};

}  // namespace tpm::haptics
