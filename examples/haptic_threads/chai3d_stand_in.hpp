// Stands in for the three types of CHAI3D 3.x that chai3d_tool.cpp uses, with their names and
// signatures. It is not CHAI3D, and its device is a scripted motion.
#pragma once
#include <algorithm>
#include <memory>

#include "scripted_motion.hpp"

namespace chai3d {

class cVector3d {
 public:
  cVector3d() = default;
  cVector3d(double x, double y, double z) : x_(x), y_(y), z_(z) {}
  double x() const { return x_; }
  double y() const { return y_; }
  double z() const { return z_; }

 private:
  double x_ = 0.0, y_ = 0.0, z_ = 0.0;
};

/// The time of the scripted motion.
class cPrecisionClock {
 public:
  void start(bool /*reset*/) { stand_in_s() = 0.0; }
  double getCurrentTimeSeconds() { return stand_in_s(); }
  static double& stand_in_s() {
    static double time_s = 0.0;
    return time_s;
  }
};

class cGenericHapticDevice {
 public:
  bool getPosition(cVector3d& position) {
    if (period_ == kScriptedPeriods) return false;
    cPrecisionClock::stand_in_s() = 1e-3 * period_;
    position = cVector3d(0.0, 0.0, scripted_height_m(period_++));
    return true;
  }
  bool setForce(const cVector3d& force) {
    largest_N_ = std::max(largest_N_, force.z());
    return true;
  }
  int periods() const { return period_; }
  double largest_N() const { return largest_N_; }

 private:
  int period_ = 0;
  double largest_N_ = 0.0;
};

using cGenericHapticDevicePtr = std::shared_ptr<cGenericHapticDevice>;

}  // namespace chai3d
