#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tpm {

/// Where a tool is: its displacement from where it touches the tissue at rest, m, and how it has
/// turned since, in the coordinates of the organ. Models of tools that look alike from all sides,
/// and of spheres that are moved themselves, do not ask for the orientation.
struct ToolPose {
  // NOLINTNEXTLINE(google-explicit-constructor): a tool that does not turn is the usual case
  ToolPose(const Eigen::Vector3d& displacement) : displacement_m(displacement) {}
  template <class Expression>  // NOLINTNEXTLINE(google-explicit-constructor)
  ToolPose(const Eigen::MatrixBase<Expression>& displacement) : displacement_m(displacement) {}
  ToolPose(const Eigen::Vector3d& displacement, const Eigen::Quaterniond& turned)
      : displacement_m(displacement), orientation(turned) {}

  Eigen::Vector3d displacement_m;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// What a contact model answers after a step.
struct ContactAnswer {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< of the tissue on what is in contact
  double error_N = 0.0;  ///< estimate of how far the force is from that of the full network
  bool trusted = true;   ///< false beyond the range the model was built or converges in
};

/// A tissue under a tool, stepped at a fixed servo period. The tool moves linearly within a step. A
/// step neither allocates nor locks nor throws. Contact is two-sided, as if tool and tissue were
/// glued, unless a model says otherwise; OneSidedContact lets any of them go.
class ContactModel {
 public:
  virtual ~ContactModel() = default;
  /// Back to rest, everything relaxed.
  virtual void reset() noexcept = 0;
  /// Advances by one period, at whose end the tool is there.
  virtual ContactAnswer step(const ToolPose& tool) noexcept = 0;
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
