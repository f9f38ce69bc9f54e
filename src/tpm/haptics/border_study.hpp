#pragma once
#include <vector>

#include "tpm/haptics/rendering_border.hpp"

namespace tpm {

/// A border measured on the simulated device, beside what theory says of it.
struct BorderPoint {
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

/// What `tpm hil stability` computes.
struct BorderStudy {
  PlantSettings plant;
  double relaxation_time_s = 0.01;          ///< where rate, delay and friction vary
  double stiffness_N_per_m = 300.0;         ///< at once, where the relaxation time varies
  std::vector<BorderPoint> passive;         ///< largest stiffness at once, N/m
  std::vector<BorderPoint> stable;          ///< the same, of device and arm together
  std::vector<RulePoint> rules;             ///< at 1 kHz
  std::vector<BorderPoint> shortest;        ///< smallest relaxation time, s, forward Euler
  std::vector<BorderPoint> shortest_exact;  ///< the same of the exact update: 0, all are passive
};

[[nodiscard]] BorderStudy study_borders(const PlantSettings& plant);

}  // namespace tpm
