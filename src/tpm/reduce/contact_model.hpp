#pragma once
#include <Eigen/Core>

namespace tpm {

/// What a contact model answers after a step.
struct ContactAnswer {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< of the tissue on what is in contact
  double error_N = 0.0;  ///< estimate of how far the force is from that of the full network
  bool trusted = true;   ///< false beyond the range the model was built or converges in
};

/// A tissue seen from one of its contact spheres, stepped at a fixed servo period. The contact
/// moves linearly within a step. A step neither allocates nor locks nor throws.
class ContactModel {
 public:
  virtual ~ContactModel() = default;
  /// Back to rest, everything relaxed.
  virtual void reset() noexcept = 0;
  /// Advances by one period to a displacement of the contact sphere from rest, m, in the
  /// coordinates of the organ.
  virtual ContactAnswer step(const Eigen::Vector3d& displacement_m) noexcept = 0;
  /// s
  [[nodiscard]] virtual double period_s() const noexcept = 0;
  /// Tangent stiffness at rest, all relaxing springs taut, N/m: for limits of passivity.
  [[nodiscard]] virtual Eigen::Matrix3d instantaneous_stiffness() const noexcept = 0;
  /// The same, everything relaxed, N/m.
  [[nodiscard]] virtual Eigen::Matrix3d relaxed_stiffness() const noexcept = 0;
  /// Spheres whose displacements `displacements` writes; 0: the model has none.
  [[nodiscard]] virtual Eigen::Index spheres() const noexcept = 0;
  /// Displacements of all spheres after the last step, m.
  /// @param all 3 x spheres()
  virtual void displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept = 0;
};

}  // namespace tpm
