#pragma once
// A device description file as it is written: the declaration of all its keys.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/block.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::haptics {

enum class KnownBy { measured, assumed };

/// Block `limits`.
struct DeviceLimitKeys {
  std::optional<double> force_N, reach_m, stiffness_N_per_m, damping_N_s_per_m, slew_N_per_s,
      least_ramp_in_s;
  /// Where a limit comes from, by its key.
  std::optional<std::vector<std::pair<std::string, std::string>>> provenance;
};

/// Block `delay`.
struct DeviceDelayKeys {
  KnownBy provenance = KnownBy::assumed;
  double largest_s = 0.0;
  std::optional<double> mean_s, jitter_s, resolution_s;
  std::optional<std::string> hold;  ///< in words: the hold of a command is not in them
  std::optional<int> tries;
};

/// Block `viscous_friction`.
struct ViscousFrictionKeys {
  KnownBy provenance = KnownBy::assumed;
  double lower_95_N_s_per_m = 0.0;
  std::optional<double> estimate_N_s_per_m;
};

/// Block `encoder_step`.
struct EncoderStepKeys {
  KnownBy provenance = KnownBy::assumed;
  double step_m = 0.0;
  std::optional<double> noise_m;
};

/// Block `coulomb_friction`.
struct CoulombFrictionKeys {
  KnownBy provenance = KnownBy::assumed;
  std::optional<std::vector<double>> interval_N;
};

/// Block `moving_mass`.
struct MovingMassKeys {
  KnownBy provenance = KnownBy::assumed;
  std::optional<double> mass_kg;
  std::optional<std::vector<double>> interval_kg;
};

// NOLINTNEXTLINE(bugprone-exception-escape): moving a Json does not throw, unseen
struct DeviceKeys {
  std::string device;
  std::optional<std::string> name, description, serial;
  std::optional<DeviceLimitKeys> limits;
  std::optional<DeviceDelayKeys> delay;
  std::optional<ViscousFrictionKeys> viscous_friction;
  std::optional<EncoderStepKeys> encoder_step;
  std::optional<CoulombFrictionKeys> coulomb_friction;
  std::optional<MovingMassKeys> moving_mass;
  std::optional<std::vector<Remark>> not_identified;
  Json measurement;  ///< null: none
};

[[nodiscard]] const Block<DeviceKeys>& device_block();
[[nodiscard]] const FileKind& device_kind();

}  // namespace tpm::haptics
