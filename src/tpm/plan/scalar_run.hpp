#pragma once
#include <span>

#include "tpm/plan/plan_surrogate.hpp"
#include "tpm/plan/scalar_model.hpp"

namespace tpm::plan {

/// The contact as a linear one, with so many exponentials (1 to 3).
[[nodiscard]] ScalarModel linear_contact(const ContactSpectrum& spectrum, int branches);
/// With the static curves of the nonlinear network, and the linear network's exponentials.
[[nodiscard]] ScalarModel curves_contact(const ContactCurves& curves,
                                         const ContactSpectrum& spectrum, int branches);

/// Moves a model through a protocol.
class ScalarRun {
 public:
  /// @param one_step_at_rest a depth that is held is crossed in one step, which is exact
  ScalarRun(const Protocol& protocol, ScalarModel model, double longest_step_s,
            bool one_step_at_rest = false);

  /// Goes on to a time; the response there, after all jumps.
  double at(double time_s);
  [[nodiscard]] const ScalarModel& model() const { return model_; }
  [[nodiscard]] double steps() const { return steps_; }

 private:
  void jump(double value);
  void settle(double value);
  void pass_jumps();
  void cross(double time_s, double value);

  const Protocol& protocol_;
  bool by_depth_;
  ScalarModel model_;
  double longest_s_;
  bool one_step_at_rest_;
  std::span<const Knot> knots_;
  std::size_t next_ = 1;
  double time_s_ = 0.0, value_ = 0.0, response_ = 0.0, steps_ = 0.0;
};

}  // namespace tpm::plan
