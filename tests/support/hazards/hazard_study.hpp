#pragma once
#include <string>
#include <vector>

#include "tpmkit/servo_record.hpp"

namespace tpm::haptics {

/// Outcome of one hazard, on the simulated device in virtual time.
struct HazardRow {
  std::string hazard, setting;
  bool unchecked = false;  ///< run although the check refused it, in the row before
  bool passive = false;    ///< by the check before the session
  std::string refused;     ///< in words; empty: it ran
  /// The check before the session refused it; it is run once more without. A session that cannot
  /// be read stays refused.
  bool refused_by_check = false;
  StopCause cause = StopCause::none;
  double largest_force_N = 0.0;  ///< sent
  double largest_rise_N = 0.0;   ///< of the size of the force, from a period to the next
  double delivered_J = 0.0;      ///< most that the rendering gave to the hand, see EnergyWatch
  /// From the fault, or else from the first touch, to zero force, s; and how far the tool went
  /// meanwhile, m. Of sessions that were stopped.
  double to_zero_s = 0.0, travel_m = 0.0;
  bool damped = false;  ///< by the passivity controller, which no limit of rise holds for
  bool within = false;  ///< what HazardBounds state
};

/// The reference of the rows.
struct HazardBounds {
  double force_N = 8.0;               ///< the session's limit
  double rise_N = 0.4;                ///< the same of a period, 400 N/s at 1 kHz
  double delivered_J = 2e-3;          ///< of a session that comes to its end
  double delivered_stopped_J = 5e-3;  ///< of one that is stopped
  double travel_m = 0.010;            ///< of one that is stopped
  double to_zero_s = 1.2;             ///< the same; of an injected fault `fault_to_zero_s`
  double fault_to_zero_s = 0.01;
};

struct HazardStudy {
  HazardBounds bounds;
  std::vector<HazardRow> rows;
  /// All are within the bounds, and nothing passive was refused.
  [[nodiscard]] bool safe() const;
};

/// Runs all hazards, deterministic. What the check refuses is run once more without it.
[[nodiscard]] HazardStudy study_hazards();

}  // namespace tpm::haptics
