#include "tpm/haptics/device/device_file.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

std::optional<double> number_of(const Json& block, const char* key) {
  if (!block.contains(key)) return std::nullopt;
  return block.at(key).get<double>();
}

/// A number of a part that says it was measured; empty for an assumed one.
std::optional<double> measured_number(const Json& json, const char* part, const char* key) {
  if (!json.contains(part)) return std::nullopt;
  const Json& block = json.at(part);
  if (block.at("provenance") != "measured") return std::nullopt;
  return block.at(key).get<double>();
}

}  // namespace

DeviceFile parse_device_file(const Json& written, const std::string& where) {
  const Json json = checked(written, "device", where);
  DeviceFile file;
  file.where = where;
  file.kind = json.at("device").get<std::string>();
  file.serial = json.value("serial", std::string());
  const Json limits = json.value("limits", Json::object());
  file.force_N = number_of(limits, "force_N");
  file.reach_m = number_of(limits, "reach_m");
  file.stiffness_N_per_m = number_of(limits, "stiffness_N_per_m");
  file.damping_N_s_per_m = number_of(limits, "damping_N_s_per_m");
  file.slew_N_per_s = number_of(limits, "slew_N_per_s");
  file.least_ramp_in_s = number_of(limits, "least_ramp_in_s");
  if (json.contains("encoder_step")) {
    file.encoder_step_m = json.at("encoder_step").at("step_m").get<double>();
  }
  file.measured_delay_s = measured_number(json, "delay", "largest_s");
  file.measured_friction_N_s_per_m =
      measured_number(json, "viscous_friction", "lower_95_N_s_per_m");
  return file;
}

DeviceFile read_device_file(const std::filesystem::path& file) {
  return parse_device_file(read_json(file), file.string());
}

DeviceLimits limits_by_file(DeviceLimits limits, const DeviceFile& file) {
  if (file.kind != limits.kind) {
    throw bad_input(file.where + ": key /device",
                    fmt::format("is of '{}', not of '{}'", printable(file.kind), limits.kind),
                    fmt::format("the file of a device '{}'", limits.kind));
  }
  const auto lower = [&](const std::optional<double>& said, double& limit, const char* key) {
    if (!said) return;
    if (*said > limit) {
      throw bad_input(fmt::format("{}: key /limits/{}", file.where, key), shortest(*said),
                      fmt::format("at most {}, the limit of '{}'", shortest(limit), limits.kind));
    }
    limit = *said;
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
  }
  if (file.encoder_step_m) limits.encoder_step_m = *file.encoder_step_m;
  limits.measured_delay_s = file.measured_delay_s;
  limits.measured_friction_N_s_per_m = file.measured_friction_N_s_per_m;
  return limits;
}

}  // namespace tpm::haptics
