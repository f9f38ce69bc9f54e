#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpmkit/bond_element.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::contact {

/// Rule that advances the relaxing spring of an element over a period.
enum class ElementRule {
  exact,          ///< under linear motion; stable for every relaxation time
  forward_euler,  ///< diverges for periods above twice the relaxation time
  mass_spring,    ///< no relaxing spring: equilibrium stiffness and a dashpot, the MSM of the paper
};

/// One sphere on an element with one branch: the four-sphere star, guided along its normal.
/// Across it there is no force. Coordinates: the push is along +z.
class ElementContact final : public ContactModel {
 public:
  /// @param dashpot_N_s_per_m of the rule mass_spring, >= 0
  /// Throws Error(bad_input) for a material or a period out of range.
  ElementContact(const BondElement& material, double period_s,
                 ElementRule rule = ElementRule::exact, double dashpot_N_s_per_m = 0.0);

  void reset() noexcept override { depth_m_ = followed_m_ = 0.0; }
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override;
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override;

 private:
  double equilibrium_N_per_m_, relaxing_N_per_m_, per_Pa_m_, relaxation_time_s_;
  TensionLaw tension_;
  RelaxationWeights weights_;
  double period_s_, dashpot_N_s_per_m_;
  ElementRule rule_;
  double depth_m_ = 0.0;
  double followed_m_ = 0.0;  ///< w: what the relaxing spring has relaxed to, dw/dt = (e - w)/tau
};

}  // namespace tpm::contact
