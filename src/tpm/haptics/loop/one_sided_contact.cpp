#include "tpm/haptics/loop/one_sided_contact.hpp"

namespace tpm::haptics {

OneSidedContact::OneSidedContact(ContactModel& model, const Eigen::Vector3d& push)
    : model_(model),
      push_(push.normalized()),
      stiffness_N_per_m_(push_.dot(model.instantaneous_stiffness() * push_)) {}

void OneSidedContact::reset() noexcept {
  model_.reset();
  surface_m_ = left_N_ = 0.0;
  touching_ = false;
}

OneSidedContact::Answer OneSidedContact::press(double tool_m) noexcept {
  const double free_m = surface_m_ - left_N_ / stiffness_N_per_m_;
  if (!touching_ && tool_m >= free_m) touching_ = true;
  const double before_m = surface_m_;
  surface_m_ = touching_ ? tool_m : free_m;
  const ContactAnswer answer = model_.step(push_ * surface_m_);
  const double force_N = -push_.dot(answer.force_N);
  left_N_ = force_N;
  // A model that never pulls has no force above its surface, and does not follow the tool.
  const bool lifted = force_N == 0.0 && surface_m_ < before_m;
  if (touching_ && (force_N < 0.0 || lifted)) touching_ = false;
  // Written so that a force that is no number is passed on, and found.
  return {touching_ ? force_N : 0.0 * force_N, surface_m_, touching_, answer.error_N, answer.valid};
}

ContactAnswer OneSidedContact::step(const ToolPose& tool) noexcept {
  const Answer answer = press(push_.dot(tool.displacement_m));
  return {-answer.force_N * push_, answer.error_N, answer.valid};
}

}  // namespace tpm::haptics
