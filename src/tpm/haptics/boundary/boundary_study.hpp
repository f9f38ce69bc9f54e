#pragma once
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/rendering_boundary.hpp"

namespace tpm::haptics {

/// A boundary measured on the simulated device, beside what theory says of it.
struct BoundaryPoint {
  double rate_Hz = 0.0;
  int delay_periods = 0;
  double damping_N_s_per_m = 0.0;  ///< of the device
  double relaxation_time_s = 0.0;
  double measured = 0.0, predicted = 0.0;
};

/// A rule at one relaxation time.
struct RulePoint {
  ElementRule rule = ElementRule::exact;
  double relaxation_time_s = 0.0;
  double measured_N_s_per_m = 0.0, predicted_N_s_per_m = 0.0;  ///< friction needed; may be infinite
};

/// Limit of the rise of a force.
enum class RiseLimit {
  none,
  slip,     ///< the session's slip element, 400 N/s
  ramp_in,  ///< the same, and a limit that grows to its value over 0.5 s while in contact
};

inline constexpr RiseLimit kRiseLimits[] = {RiseLimit::none, RiseLimit::slip, RiseLimit::ramp_in};

/// A hand that runs into a one-sided contact at a speed and stays 4 mm deep.
struct ImpactPoint {
  int delay_periods = 0;
  double speed_m_per_s = 0.0;
  double share = 0.0;  ///< of the stiffness that is stable in the linear, two-sided loop
  double stiffness_N_per_m = 0.0;
  // For each of kRiseLimits:
  bool rests[3] = {};          ///< within 5 s the tool stays within 0.1 mm
  double delivered_J[3] = {};  ///< most that the rendering gave to the hand, see EnergyWatch
};

/// The friction that a device needs to be passive where its maker's software ends.
struct DeviceCorner {
  std::string_view device;
  double stiffness_N_per_m = 0.0, damping_N_s_per_m = 0.0;  ///< CHAI3D 3.3's software limits
  double needed_N_s_per_m = 0.0;          ///< K T/2 + B at 1 kHz, Colgate and Schenkel
  double needed_delayed_N_s_per_m = 0.0;  ///< the same with a period of delay
  /// Of the device, N s/m; empty: nobody knows, and there is no verdict.
  std::optional<std::pair<double, double>> assumed_friction_N_s_per_m = std::nullopt;
};

/// Results of `tpm hil stability`.
struct BoundaryStudy {
  PlantSettings plant;
  double relaxation_time_s = 0.01;            ///< where rate, delay and friction vary
  double stiffness_N_per_m = 300.0;           ///< instantaneous, where the relaxation time varies
  std::vector<BoundaryPoint> passive;         ///< largest instantaneous stiffness, N/m
  std::vector<BoundaryPoint> stable;          ///< the same, of device and arm together
  std::vector<RulePoint> rules;               ///< at 1 kHz
  std::vector<BoundaryPoint> shortest;        ///< smallest relaxation time, s, forward Euler
  std::vector<BoundaryPoint> shortest_exact;  ///< the same of the exact update: 0, all are passive
  std::vector<ImpactPoint> impacts;           ///< at 1 kHz
  std::vector<DeviceCorner> corners;
};

[[nodiscard]] std::string_view to_string(RiseLimit limit);

[[nodiscard]] BoundaryStudy study_boundaries(const PlantSettings& plant);

}  // namespace tpm::haptics
