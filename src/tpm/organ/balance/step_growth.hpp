#pragma once
#include <algorithm>
#include <cmath>

#include "tpm/organ/balance/stage_balance.hpp"

namespace tpm::organ {

/// By how much the next step may be longer. The error of smooth motion goes with a high power of
/// the step, but behind a change of rate the motion itself calms down while steps grow: the power
/// is taken from the two latest steps.
class StepGrowth {
 public:
  explicit StepGrowth(int order) : order_(order) {}

  [[nodiscard]] double after(double h, const StepOutcome& outcome) {
    double power = order_;
    if (outcome.balanced && last_h_ > 0.0 && h != last_h_) {
      power = std::log(outcome.error / last_error_) / std::log(h / last_h_);
      power = std::clamp(power, 1.0, order_);
    }
    last_h_ = outcome.balanced ? h : 0.0;
    last_error_ = outcome.error;
    constexpr double kSafety = 0.8;
    return kSafety * std::pow(outcome.allowed / outcome.error, 1.0 / power);
  }

 private:
  double order_;
  double last_h_ = 0.0, last_error_ = 0.0;
};

}  // namespace tpm::organ
