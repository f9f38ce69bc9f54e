#pragma once
#include <Eigen/Core>

namespace tpm::organ {

/// States that are worked on side by side, one number of each in turn, so that one instruction of
/// the processor serves several of them.
constexpr int kLanes = 8;

/// One number per lane: column i holds number i of every state.
using LaneMatrix = Eigen::Matrix<double, kLanes, Eigen::Dynamic>;

using LaneVector = Eigen::Matrix<double, kLanes, 1>;
using LaneSquare = Eigen::Matrix<double, kLanes, kLanes>;

/// Weights by which viscous elongations follow, lane by lane, from those at the start of a step and
/// from elongations at its start and its stages.
struct ViscousWeights {
  LaneSquare of_stages;  ///< by (lane, stage)
  LaneVector of_start, of_viscous;

  /// The viscous elongations in every lane, one column per bond; `stages` is no part of `out`.
  void apply(const Eigen::Ref<const LaneMatrix>& stages,
             const Eigen::Ref<const Eigen::RowVectorXd>& start,
             const Eigen::Ref<const Eigen::RowVectorXd>& viscous_start,
             Eigen::Ref<LaneMatrix> out) const;
  /// The same where the part from the start of the step is known in every lane.
  void apply(const Eigen::Ref<const LaneMatrix>& stages, const Eigen::Ref<const LaneMatrix>& known,
             Eigen::Ref<LaneMatrix> out) const;
};

/// out = weights in, lane by lane of all lanes, without the packing of Eigen's product,
/// which takes longer than so small a product itself. `in` is no part of `out`.
void mix_lanes(const LaneSquare& weights, const LaneMatrix& in, LaneMatrix& out);

/// All numbers of all states as one vector.
[[nodiscard]] inline Eigen::Map<Eigen::VectorXd> flat(LaneMatrix& lanes) {
  return {lanes.data(), lanes.size()};
}

}  // namespace tpm::organ
