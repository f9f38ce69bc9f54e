#pragma once
#include "tpmkit/contact_model.hpp"

namespace tpm::haptics {

/// A tool without friction on a contact model: it pushes and never pulls. When the force reaches
/// zero the surface lets go and recovers by itself, kept free of force by one Newton step a period;
/// the tool meets it again wherever it then is. What the tool feels is zero in between, so that
/// nothing is given to it.
class OneSidedContact final : public ContactModel {
 public:
  struct Answer {
    double force_N = 0.0;    ///< against the push, >= 0
    double surface_m = 0.0;  ///< depth of the surface
    bool touching = false;
    double error_N = 0.0;
    bool valid = true;
  };

  /// @param push unit vector into the tissue, in the coordinates of the model
  /// @param model must live as long as this
  OneSidedContact(ContactModel& model, const Eigen::Vector3d& push);

  void reset() noexcept override;
  /// One period. @param tool_m depth of the tool at its end, moving linearly
  Answer press(double tool_m) noexcept;

  /// The same as a contact model: motion across the push does not reach the tissue.
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return model_.period_s(); }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return model_.instantaneous_stiffness();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return model_.equilibrium_stiffness();
  }
  [[nodiscard]] Eigen::Index spheres() const noexcept override { return model_.spheres(); }
  void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept override {
    model_.displacements(all);
  }

  /// Depth of the surface: where the tool is while it touches, else where it would touch next.
  [[nodiscard]] double surface_m() const noexcept {
    return touching_ ? surface_m_ : surface_m_ - left_N_ / stiffness_N_per_m_;
  }
  /// Instantaneous stiffness along the push, at rest, N/m.
  [[nodiscard]] double stiffness_N_per_m() const noexcept { return stiffness_N_per_m_; }

 private:
  ContactModel& model_;
  Eigen::Vector3d push_;
  double stiffness_N_per_m_;
  double surface_m_ = 0.0, left_N_ = 0.0;
  bool touching_ = false;
};

}  // namespace tpm::haptics
