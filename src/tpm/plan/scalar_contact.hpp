#pragma once
#include "tpm/plan/scalar_model.hpp"
#include "tpmkit/contact_model.hpp"

namespace tpm::plan {

/// A ScalarModel for a servo loop: a contact that moves along its push. Across it there is no
/// force, and motion across is not seen.
class ScalarContact final : public ContactModel {
 public:
  /// Known properties of the contact it stands for.
  struct Range {
    double instantaneous_N_per_m = 0.0, equilibrium_N_per_m = 0.0;  ///< stiffness at rest
    double deepest_m = 0.0;  ///< answers beyond are not valid
  };
  /// @param into_tissue unit vector
  ScalarContact(ScalarModel model, const Eigen::Vector3d& into_tissue, const Range& range,
                double period_s);

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return range_.instantaneous_N_per_m * (into_ * into_.transpose());
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return range_.equilibrium_N_per_m * (into_ * into_.transpose());
  }

 private:
  ScalarModel model_;
  Eigen::Vector3d into_;
  Range range_;
  double period_s_;
};

}  // namespace tpm::plan
