// Stands in for SOFA's ForceFeedback, with the name and the signature of the call that haptic
// drivers make. It is not SOFA, and its driver is a scripted motion.
#pragma once
#include <algorithm>

#include "scripted_motion.hpp"

namespace sofa::component::haptics {

class ForceFeedback {
 public:
  virtual ~ForceFeedback() = default;
  virtual void computeForce(double x, double y, double z, double u, double v, double w, double q,
                            double& fx, double& fy, double& fz) = 0;
};

}  // namespace sofa::component::haptics

/// The time of the scripted motion.
inline double& scripted_time_s() {
  static double time_s = 0.0;
  return time_s;
}

/// The loop of a driver. @returns the largest force along z
inline double run_scripted_driver(sofa::component::haptics::ForceFeedback& feedback) {
  double largest_N = 0.0;
  for (int i = 0; i < kScriptedPeriods; ++i) {
    scripted_time_s() = 1e-3 * i;
    double fx = 0.0, fy = 0.0, fz = 0.0;
    feedback.computeForce(0.0, 0.0, scripted_height_m(i), 0.0, 0.0, 0.0, 1.0, fx, fy, fz);
    largest_N = std::max(largest_N, fz);
  }
  return largest_N;
}
