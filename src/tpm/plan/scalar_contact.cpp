#include "tpm/plan/scalar_contact.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace tpm::plan {

ScalarContact::ScalarContact(ScalarModel model, const Eigen::Vector3d& into_tissue,
                             const Range& range, double period_s)
    : model_(std::move(model)), into_(into_tissue), range_(range), period_s_(period_s) {
  model_.set_period(period_s);
  reset();
}

void ScalarContact::reset() noexcept {
  model_.settle(0.0);
}

ContactAnswer ScalarContact::step(const ToolPose& tool) noexcept {
  const double depth_m = into_.dot(tool.displacement_m);
  ContactAnswer answer;
  if (!std::isfinite(depth_m)) {
    answer.force_N.setConstant(std::numeric_limits<double>::quiet_NaN());
    answer.valid = false;
    return answer;
  }
  constexpr double kAbove = 0.05;  // of the depth: a surface that recovers may pass its rest
  answer.force_N = -model_.step_to(depth_m) * into_;
  answer.valid = depth_m <= range_.deepest_m && depth_m >= -kAbove * range_.deepest_m;
  return answer;
}

}  // namespace tpm::plan
