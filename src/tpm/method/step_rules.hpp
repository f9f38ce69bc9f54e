#pragma once
// The rules with given steps, written once for elements and networks.
#include "tpm/method/step_system.hpp"

namespace tpm {

/// One rule with given steps. Orders are those of kStepRules.
class FixedRule {
 public:
  virtual ~FixedRule() = default;
  /// One step from time_s to time_s + h.
  /// @param state where it begins; where it ends, if `completed`
  [[nodiscard]] virtual MethodEnd step(StepSystem& system, double time_s, double h,
                                       Eigen::VectorXd& state) = 0;
  /// What is imposed jumps at once, y kept.
  [[nodiscard]] virtual MethodEnd jump(StepSystem& system, double time_s, Eigen::VectorXd& state);
};

/// None for an adaptive rule.
[[nodiscard]] std::unique_ptr<FixedRule> fixed_rule(const MethodSettings& settings);

}  // namespace tpm
