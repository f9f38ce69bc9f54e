#pragma once
#include <Eigen/Core>

namespace tpm {

/// States that are worked on side by side, one number of each in turn, so that one instruction of
/// the processor serves several of them.
constexpr int kLanes = 8;

/// One number per lane: column i holds number i of every state.
using LaneMatrix = Eigen::Matrix<double, kLanes, Eigen::Dynamic>;

using LaneVector = Eigen::Matrix<double, kLanes, 1>;
using LaneSquare = Eigen::Matrix<double, kLanes, kLanes>;

/// out = of_stages stages + of_start start + of_memory memory: what is remembered in every lane,
/// one column per bond. The stages are no part of out.
void advance_memory(const LaneSquare& of_stages, const LaneVector& of_start,
                    const LaneVector& of_memory, const LaneMatrix& stages,
                    const Eigen::RowVectorXd& start, const Eigen::RowVectorXd& memory,
                    LaneMatrix& out);

/// All numbers of all states as one vector.
[[nodiscard]] inline Eigen::Map<Eigen::VectorXd> flat(LaneMatrix& lanes) {
  return {lanes.data(), lanes.size()};
}

}  // namespace tpm
