#pragma once
// The rules that choose their steps: CVODE and IDA.
#include "tpm/organ/steps/step_system.hpp"

namespace tpm::organ {

/// An integrator with error control that is restarted wherever the equations change.
class AdaptiveRule {
 public:
  virtual ~AdaptiveRule() = default;
  /// Begins a piece that ends at `stop_s`, from a state.
  [[nodiscard]] virtual MethodEnd restart(double time_s, double stop_s,
                                          const Eigen::VectorXd& state) = 0;
  /// @param state there
  [[nodiscard]] virtual MethodEnd advance_to(double time_s, Eigen::VectorXd& state) = 0;
  /// Where it gave up, and its own word for why.
  struct GivenUp {
    double time_s = 0.0;
    std::string flag;
  };
  [[nodiscard]] virtual GivenUp given_up() const = 0;
  [[nodiscard]] virtual long steps() const = 0;  ///< of all pieces
};

/// Adams: functional iteration, without a matrix. BDF: Newton with the matrix of the problem. IDA:
/// BDF on the differential-algebraic problem of positions and viscous elongations where there are
/// no masses. None for a rule with given steps, and for a system without a role that the rule
/// needs.
/// @param system must live as long as the rule
[[nodiscard]] std::unique_ptr<AdaptiveRule> adaptive_rule(StepSystem& system,
                                                          const MethodSettings& settings);

}  // namespace tpm::organ
