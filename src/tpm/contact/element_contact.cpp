#include "tpm/contact/element_contact.hpp"

#include <cmath>

#include "tpm/base/require.hpp"
#include "tpm/law/element/validity_limits.hpp"

namespace tpm::contact {

ElementContact::ElementContact(const BondElement& material, double period_s, ElementRule rule,
                               double dashpot_N_s_per_m)
    : equilibrium_N_per_m_(material.equilibrium_Pa * material.modulus_to_stiffness_m()),
      relaxing_N_per_m_(material.relaxing_Pa() * material.modulus_to_stiffness_m()),
      per_Pa_m_(material.modulus_to_stiffness_m()),
      relaxation_time_s_(material.relaxation_time_s()),
      tension_(material.tension()),
      weights_(relaxation_weights(period_s / relaxation_time_s_)),
      period_s_(period_s),
      dashpot_N_s_per_m_(dashpot_N_s_per_m),
      rule_(rule) {
  require_one_branch(material, "element");
  require_number(is_positive(period_s), "element: period", period_s, "above 0 s");
}

ContactAnswer ElementContact::step(const ToolPose& tool) noexcept {
  const double depth = tool.displacement_m.z();
  double force = equilibrium_N_per_m_ * depth + per_Pa_m_ * tension_.value(depth);
  if (rule_ == ElementRule::mass_spring) {
    force += dashpot_N_s_per_m_ * (depth - depth_m_) / period_s_;
  } else {
    if (rule_ == ElementRule::exact) {
      followed_m_ = weights_.r * followed_m_ + weights_.w0 * depth_m_ + weights_.w1 * depth;
    } else {
      followed_m_ += period_s_ / relaxation_time_s_ * (depth_m_ - followed_m_);
    }
    force += relaxing_N_per_m_ * (depth - followed_m_);
  }
  depth_m_ = depth;
  ContactAnswer answer;
  answer.force_N.z() = -force;
  // Exact at any depth; beyond this the liver that it stands for is damaged.
  answer.valid = std::abs(depth) <= kDamageIndentation_m;
  return answer;
}

Eigen::Matrix3d ElementContact::instantaneous_stiffness() const noexcept {
  Eigen::Matrix3d stiffness = equilibrium_stiffness();
  if (rule_ != ElementRule::mass_spring) {
    stiffness(2, 2) += relaxing_N_per_m_;
  }
  return stiffness;
}

Eigen::Matrix3d ElementContact::equilibrium_stiffness() const noexcept {
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  stiffness(2, 2) = equilibrium_N_per_m_;
  return stiffness;
}

}  // namespace tpm::contact
