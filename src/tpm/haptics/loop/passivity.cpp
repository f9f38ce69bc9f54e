#include "tpm/haptics/loop/passivity.hpp"

#include <algorithm>

namespace tpm::haptics {

void PassivityControl::observe(const Eigen::Vector3d& held_N,
                               const Eigen::Vector3d& moved_m) noexcept {
  observed_J_ -= held_N.dot(moved_m);
}

Eigen::Vector3d PassivityControl::damping_N(const Eigen::Vector3d& moved_m,
                                            double delivered_J) const noexcept {
  const double moved2 = moved_m.squaredNorm();
  if (delivered_J <= 0.0 || most_damping_ <= 0.0 || !(moved2 > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  // b v^2 T makes up for the deficit within one more period of the same motion.
  const double damping = std::min(delivered_J * period_s_ / moved2, most_damping_);
  return -damping / period_s_ * moved_m;
}

}  // namespace tpm::haptics
