#pragma once
// The rules with given steps, written once for elements and networks.
#include "tpm/organ/steps/step_system.hpp"

namespace tpm::organ {

/// One rule with given steps on a system. Orders are those of kStepRules.
class FixedRule {
 public:
  FixedRule() = default;
  FixedRule(const FixedRule&) = delete;
  FixedRule& operator=(const FixedRule&) = delete;
  virtual ~FixedRule() = default;
  /// One step from time_s to time_s + h.
  /// @param state where it begins; where it ends, if `completed`
  [[nodiscard]] virtual MethodEnd step(double time_s, double h, Eigen::VectorXd& state) = 0;
  /// Makes the imposed value jump, y constant.
  [[nodiscard]] virtual MethodEnd jump(double time_s, Eigen::VectorXd& state) = 0;
};

/// None for an adaptive rule, and for a system without a role that the rule needs.
/// @param system must live as long as the rule
[[nodiscard]] std::unique_ptr<FixedRule> fixed_rule(StepSystem& system,
                                                    const MethodSettings& settings);

}  // namespace tpm::organ
