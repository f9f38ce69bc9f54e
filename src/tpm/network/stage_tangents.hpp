#pragma once
// The inside of QuasiStatic: derivatives of a run by the material and by what is imposed.
#include <vector>

#include "tpm/network/stage_balance.hpp"

namespace tpm {

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
  /// After a move of the state at an instant, with what the bonds remember held or all relaxed.
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
  /// States side by side, and how their memory depends on elongations.
  struct Stages {
    LaneMatrix position, memory;
    LaneVector imposed;
    MemoryWeights weights;
    LaneMatrix aging;  ///< change of y per change of ln tau, elongations held
  };
  /// The derivatives by one direction.
  struct Tangent {
    Eigen::VectorXd stiffness, relaxing;  ///< of the bonds, in the order of LaneBonds
    double log_relaxation_time, imposed;
    Eigen::RowVectorXd start, start_elongation, start_memory;
    LaneMatrix position, elongation, memory;  ///< of the stages
  };

  [[nodiscard]] Stages stages_of_step(double h) const;
  [[nodiscard]] Stages at_once(const TissueState& state, bool relaxed) const;
  void solve(Tangent& tangent, const Stages& stages);
  void update_memory(Tangent& tangent, const Stages& stages) const;
  /// Change of all forces, loads included.
  void force_changes(const Tangent& tangent, const Stages& stages, const LaneMatrix& position,
                     const LaneMatrix& memory);
  [[nodiscard]] LaneVector response_changes(const LaneMatrix& position);
  void end_at(Tangent& tangent, Eigen::Index lane) const;

  DrivenTissue& tissue_;
  StageBalance& balance_;
  double tolerance_;
  std::vector<Tangent> tangent_;
  Anderson anderson_;
  LaneMatrix force_, d_;
};

}  // namespace tpm
