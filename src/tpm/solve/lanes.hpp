#pragma once
#include <Eigen/Core>

namespace tpm {

/// States that are worked on side by side, one number of each in turn, so that one instruction of
/// the processor serves several of them.
constexpr int kLanes = 8;

/// One number per lane: column i holds number i of every state.
using LaneMatrix = Eigen::Matrix<double, kLanes, Eigen::Dynamic>;

using LaneVector = Eigen::Matrix<double, kLanes, 1>;

/// All numbers of all states as one vector.
[[nodiscard]] inline Eigen::Map<Eigen::VectorXd> flat(LaneMatrix& lanes) {
  return {lanes.data(), lanes.size()};
}

}  // namespace tpm
