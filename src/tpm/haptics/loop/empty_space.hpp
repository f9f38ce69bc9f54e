#pragma once
#include "tpmkit/contact_model.hpp"

namespace tpm::haptics {

/// Nothing there: no force at any depth.
class EmptySpace : public ContactModel {
 public:
  explicit EmptySpace(double period_s = 1e-3) : period_s_(period_s) {}
  void reset() noexcept override {}
  ContactAnswer step(const ToolPose& /*tool*/) noexcept override { return {}; }
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }

 private:
  double period_s_;
};

}  // namespace tpm::haptics
