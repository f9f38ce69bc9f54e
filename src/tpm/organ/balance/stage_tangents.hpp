#pragma once
// The inside of QuasiStatic: derivatives of a run by the material and by what is imposed.
#include <vector>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

/// Derivatives of a quasi-static run, carried from step to step: forward sensitivities of the
/// balanced stages themselves, so that they are those of the numbers that the run answers. The
/// balance of a step is differentiated with its steps held; the linear equations that result are
/// solved with the factorisation of the run.
class StageTangents {
 public:
  /// @param balance, tissue must live as long as this
  /// @param tolerance in parts of the largest response
  StageTangents(DrivenTissue& tissue, StageBalance& balance,
                const std::vector<TangentDirection>& directions, double tolerance);

  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(tangent_.size()); }

  /// Nothing depends on anything yet: the tissue is at rest.
  void at_rest();
  /// After a move of the state at an instant, with the viscous elongations held or all at
  /// equilibrium.
  void follow_move(const TissueState& state, bool relaxed);
  /// After the stages of a step were balanced, before the state is moved to its end.
  void follow_step(double h);
  /// Derivatives of the responses within that step: one row per fraction, one column per direction.
  [[nodiscard]] Eigen::MatrixXd responses_within(const TissueState& state,
                                                 std::span<const double> fractions, double h,
                                                 double rate);
  /// Moves to the end of that step.
  void accept();
  /// Derivatives of the response of a state that was reached.
  [[nodiscard]] Eigen::RowVectorXd response(const TissueState& state);

 private:
  /// States side by side, and how their viscous elongations depend on what they follow.
  struct Stages {
    LaneMatrix position, mean;
    LaneVector imposed;
    StageBalance::StepWeights weights;
    /// One for each branch of each group, by (lane, bond of the group).
    std::vector<std::vector<LaneMatrix>> aging;    ///< change of m_j per change of ln tau_j
    std::vector<std::vector<LaneMatrix>> viscous;  ///< m_j
  };
  /// The derivatives by one direction.
  struct Tangent {
    Eigen::VectorXd stiffness, relaxing;  ///< of the bonds, in the order of LaneBonds
    std::vector<LawChange> laws;          ///< of each law of the system
    double imposed;
    Eigen::RowVectorXd start;
    StageBalance::Start begin;
    LaneMatrix position, followed, mean;  ///< of the stages
    LaneMatrix known, drift;  ///< parts of `mean` that the start and the changes of laws decide
  };

  [[nodiscard]] Stages stages_of_step(double h) const;
  [[nodiscard]] Stages stages_at(const StageBalance::Places& places,
                                 std::span<const double> fractions, double h) const;
  [[nodiscard]] Stages instantaneous(const TissueState& state, bool relaxed) const;
  void prepare(Tangent& tangent, const Stages& stages) const;
  void solve(Tangent& tangent, const Stages& stages);
  void update_viscous(Tangent& tangent, const Stages& stages) const;
  /// Change of all forces, loads included.
  void force_changes(const Tangent& tangent, const Stages& stages, const LaneMatrix& position,
                     const LaneMatrix& mean);
  [[nodiscard]] LaneVector response_changes(const LaneMatrix& position);
  void end_at(Tangent& tangent, const Stages& stages, Eigen::Index lane) const;

  DrivenTissue& tissue_;
  StageBalance& balance_;
  double tolerance_;
  std::vector<Tangent> tangent_;
  Anderson anderson_;
  LaneMatrix force_, d_;
  Stages step_;  ///< those followed last
};

}  // namespace tpm::organ
