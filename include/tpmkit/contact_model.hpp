#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tpm {

/// Position of a tool: its displacement from first contact with the tissue at rest, m, and its
/// rotation since then, in the coordinates of the organ. Models of round tools and of driven
/// spheres ignore the orientation.
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

/// Result of a step of a contact model.
struct ContactAnswer {
  Eigen::Vector3d force_N =
      Eigen::Vector3d::Zero();  ///< of the tissue on the tool or driven sphere
  double error_N = 0.0;         ///< estimated difference from the force of the full network
  bool valid = true;  ///< false outside the range for which the model was built or converges
};

/// A tissue under a tool, stepped at a fixed servo period. The tool moves linearly within a step. A
/// step neither allocates nor locks nor throws. Contact is two-sided, as if tool and tissue were
/// glued, unless a model states otherwise; OneSidedContact adds detachment to any model.
class ContactModel {
 public:
  virtual ~ContactModel() = default;
  /// Returns to rest, fully relaxed.
  virtual void reset() noexcept = 0;
  /// Advances by one period. The tool reaches `tool` at its end.
  virtual ContactAnswer step(const ToolPose& tool) noexcept = 0;
  /// Servo period, s.
  [[nodiscard]] virtual double period_s() const noexcept = 0;
  /// Instantaneous tangent stiffness at rest, N/m; limits of passivity use it.
  [[nodiscard]] virtual Eigen::Matrix3d instantaneous_stiffness() const noexcept = 0;
  /// Equilibrium tangent stiffness at rest, N/m.
  [[nodiscard]] virtual Eigen::Matrix3d equilibrium_stiffness() const noexcept = 0;
  /// Number of spheres whose displacements displacements() writes; none unless a model says so.
  [[nodiscard]] virtual Eigen::Index spheres() const noexcept { return 0; }
  /// Displacements of all spheres after the last step, m.
  /// @param all 3 x spheres()
  virtual void displacements([[maybe_unused]] Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {}
};

}  // namespace tpm
