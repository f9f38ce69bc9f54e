#include "tpm/haptics/device/device_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

template <class Part>
bool is_measured(const std::optional<Part>& part) {
  return part && part->provenance == KnownBy::measured;
}

/// A number of a part that says it was measured; empty for an assumed one.
template <class Part>
std::optional<double> measured_number(const std::optional<Part>& part, double Part::*number) {
  return is_measured(part) ? std::optional(*part.*number) : std::nullopt;
}

std::filesystem::path shipped_folder() {
  return share_dir() / "configs" / "devices";
}

/// Measured numbers of a file take the place of those of its kind.
DeviceLimits with_measured(DeviceLimits limits, const DeviceFile& file) {
  if (file.encoder_step_m) limits.encoder_step_m = *file.encoder_step_m;
  limits.measured_delay_s = file.measured_delay_s;
  limits.measured_friction_N_s_per_m = file.measured_friction_N_s_per_m;
  limits.measured_period_s = file.measured_period_s;
  return limits;
}

bool is_plain_name(std::string_view kind) {
  return !kind.empty() && std::all_of(kind.begin(), kind.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

DeviceFile parse_device_file(const Json& written, const std::string& where) {
  const DeviceKeys keys =
      device_block().made(checked(written, device_kind(), where), DocumentPlace{where});
  DeviceFile file;
  file.where = where;
  file.kind = keys.device;
  file.name = keys.name.value_or("");
  file.serial = keys.serial.value_or("");
  const DeviceLimitKeys limits = keys.limits.value_or(DeviceLimitKeys{});
  file.force_N = limits.force_N;
  file.reach_m = limits.reach_m;
  file.stiffness_N_per_m = limits.stiffness_N_per_m;
  file.damping_N_s_per_m = limits.damping_N_s_per_m;
  file.slew_N_per_s = limits.slew_N_per_s;
  file.least_ramp_in_s = limits.least_ramp_in_s;
  if (limits.provenance) file.provenance = *limits.provenance;
  if (keys.encoder_step) file.encoder_step_m = keys.encoder_step->step_m;
  if (keys.viscous_friction) {
    file.friction_N_s_per_m = keys.viscous_friction->lower_95_N_s_per_m;
  }
  file.measured_delay_s = measured_number(keys.delay, &DeviceDelayKeys::largest_s);
  file.measured_friction_N_s_per_m =
      measured_number(keys.viscous_friction, &ViscousFrictionKeys::lower_95_N_s_per_m);
  if (keys.delay) file.measured_period_s = 2.0 * keys.delay->resolution_s.value_or(0.0);
  file.measured = is_measured(keys.delay) || is_measured(keys.viscous_friction) ||
                  is_measured(keys.encoder_step) || is_measured(keys.coulomb_friction) ||
                  is_measured(keys.moving_mass);
  const auto simulated = keys.measurement.find("simulated_device");
  file.simulated = simulated != keys.measurement.end() && *simulated == true;
  return file;
}

DeviceFile read_device_file(const std::filesystem::path& file) {
  return parse_device_file(read_json(file), file.string());
}

std::vector<std::string> shipped_devices() {
  std::vector<std::string> kinds;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(shipped_folder(), none)) {
    if (entry.path().extension() == ".json") kinds.push_back(entry.path().stem().string());
  }
  std::sort(kinds.begin(), kinds.end());
  return kinds;
}

std::optional<DeviceFile> shipped_device_file(std::string_view kind) {
  if (!is_plain_name(kind)) return std::nullopt;
  const std::filesystem::path file = shipped_folder() / fmt::format("{}.json", kind);
  if (!std::filesystem::is_regular_file(file)) return std::nullopt;
  DeviceFile shipped = read_device_file(file);
  if (shipped.kind != kind) {
    throw bad_input(shipped.where + ": key /device", "is '" + printable(shipped.kind) + "'",
                    fmt::format("'{}', as the file is called", kind));
  }
  return shipped;
}

DeviceLimits limits_in(const DeviceFile& file) {
  const auto stated = [&](const std::optional<double>& number, const char* key) {
    if (number) return *number;
    throw bad_input(file.where + ": key /limits", fmt::format("states no {}", key),
                    "all limits of a device that the program does not know itself");
  };
  DeviceLimits limits;
  limits.kind = file.kind;
  limits.name = file.name.empty() ? file.kind : file.name;
  limits.force_N = stated(file.force_N, "force_N");
  limits.reach_m = stated(file.reach_m, "reach_m");
  limits.stiffness_N_per_m = stated(file.stiffness_N_per_m, "stiffness_N_per_m");
  limits.damping_N_s_per_m = stated(file.damping_N_s_per_m, "damping_N_s_per_m");
  limits.slew_N_per_s = stated(file.slew_N_per_s, "slew_N_per_s");
  limits.least_ramp_in_s = stated(file.least_ramp_in_s, "least_ramp_in_s");
  limits.friction_N_s_per_m = file.friction_N_s_per_m.value_or(0.0);
  limits.delay_periods = 1;
  limits.provenance = file.provenance;
  return with_measured(limits, file);
}

DeviceLimits limits_from(const DeviceFile& file, std::string_view kind) {
  const std::string_view said = kind.empty() ? std::string_view(file.kind) : kind;
  const std::vector<std::string> known = device_kinds();
  const bool is_known = std::ranges::find(known, said) != known.end();
  if (!is_known && said == file.kind) return limits_in(file);
  return limits_by_file(limits_of(said), file);
}

DeviceLimits limits_of_motors(const DeviceFile& file, std::string_view kind) {
  DeviceLimits limits = limits_from(file, kind);
  if (kind.empty() && !limits.hardware()) {
    throw bad_input(
        file.where + ": key /device", fmt::format("is '{}', without motors", file.kind),
        fmt::format("the file of a device with motors (tpm hil identify --device KIND){}",
                    limits.plant ? ", or the device 'virtual' named where nothing has any" : ""));
  }
  return limits;
}

DeviceLimits limits_by_file(DeviceLimits limits, const DeviceFile& file) {
  if (file.kind != limits.kind) {
    throw bad_input(file.where + ": key /device",
                    fmt::format("is of '{}', not of '{}'", printable(file.kind), limits.kind),
                    fmt::format("the file of a device '{}'", limits.kind));
  }
  const auto say = [&](const char* key) {
    const auto named = [key](const auto& entry) { return entry.first == key; };
    const auto words = std::ranges::find_if(file.provenance, named);
    std::erase_if(limits.provenance, named);
    limits.provenance.emplace_back(
        key, words == file.provenance.end() ? "device file, which names no source" : words->second);
  };
  const auto lower = [&](const std::optional<double>& said, double& limit, const char* key) {
    if (!said) return;
    if (*said > limit) {
      throw bad_input(fmt::format("{}: key /limits/{}", file.where, key), shortest(*said),
                      fmt::format("at most {}, the limit of '{}'", shortest(limit), limits.kind));
    }
    limit = *said;
    say(key);
  };
  lower(file.force_N, limits.force_N, "force_N");
  lower(file.reach_m, limits.reach_m, "reach_m");
  lower(file.stiffness_N_per_m, limits.stiffness_N_per_m, "stiffness_N_per_m");
  lower(file.damping_N_s_per_m, limits.damping_N_s_per_m, "damping_N_s_per_m");
  lower(file.slew_N_per_s, limits.slew_N_per_s, "slew_N_per_s");
  if (file.least_ramp_in_s) {
    if (*file.least_ramp_in_s < limits.least_ramp_in_s) {
      throw bad_input(file.where + ": key /limits/least_ramp_in_s", shortest(*file.least_ramp_in_s),
                      fmt::format("at least {}, the limit of '{}'",
                                  shortest(limits.least_ramp_in_s), limits.kind));
    }
    limits.least_ramp_in_s = *file.least_ramp_in_s;
    say("least_ramp_in_s");
  }
  return with_measured(limits, file);
}

}  // namespace tpm::haptics
