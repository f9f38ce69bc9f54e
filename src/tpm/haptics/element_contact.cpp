#include "tpm/haptics/element_contact.hpp"

#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/model/validity_limits.hpp"

namespace tpm {

ElementContact::ElementContact(const TpmParameters& material, double period_s, ElementRule rule,
                               double dashpot_N_s_per_m)
    : material_(material),
      tension_{material.Eprime_Pa, material.spacing_m},
      weights_(relaxation_weights(period_s / material.relaxation_time_s())),
      period_s_(period_s),
      dashpot_N_s_per_m_(dashpot_N_s_per_m),
      rule_(rule) {
  require_valid(material, "element");
  if (!(period_s > 0.0) || !std::isfinite(period_s)) {
    throw bad_input("element: period", shortest(period_s), "above 0 s");
  }
}

ContactAnswer ElementContact::step(const ToolPose& tool) noexcept {
  const double depth = tool.displacement_m.z();
  const double scale = material_.modulus_to_stiffness_m();
  double force = scale * (material_.relaxed_modulus_Pa() * depth + tension_.value(depth));
  if (rule_ == ElementRule::mass_spring) {
    force += dashpot_N_s_per_m_ * (depth - depth_m_) / period_s_;
  } else {
    if (rule_ == ElementRule::exact) {
      followed_m_ = weights_.r * followed_m_ + weights_.w0 * depth_m_ + weights_.w1 * depth;
    } else {
      followed_m_ += period_s_ / material_.relaxation_time_s() * (depth_m_ - followed_m_);
    }
    force += scale * material_.relaxing_modulus_Pa() * (depth - followed_m_);
  }
  depth_m_ = depth;
  ContactAnswer answer;
  answer.force_N.z() = -force;
  // Exact at any depth; beyond this the liver that it stands for is damaged.
  answer.trusted = std::abs(depth) <= kDamageIndentation_m;
  return answer;
}

Eigen::Matrix3d ElementContact::instantaneous_stiffness() const noexcept {
  Eigen::Matrix3d stiffness = relaxed_stiffness();
  if (rule_ != ElementRule::mass_spring) {
    stiffness(2, 2) += material_.relaxing_modulus_Pa() * material_.modulus_to_stiffness_m();
  }
  return stiffness;
}

Eigen::Matrix3d ElementContact::relaxed_stiffness() const noexcept {
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  stiffness(2, 2) = material_.relaxed_modulus_Pa() * material_.modulus_to_stiffness_m();
  return stiffness;
}

}  // namespace tpm
