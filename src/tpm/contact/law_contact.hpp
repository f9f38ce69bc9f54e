#pragma once
#include <Eigen/Core>

#include "tpm/base/namespaces.hpp"
#include "tpm/law/contact_history.hpp"
#include "tpmkit/contact_model.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::contact {

/// Settings of a law that is stepped in a loop.
struct LawContactSettings {
  double period_s = 1e-3;
  double longest_s = 60.0;        ///< of a session: the window of a fractional law
  double deepest_m = 4e-3;        ///< of a session, > 0: where the stiffness is told
  double deepest_valid_m = 5e-3;  ///< beyond this depth forces are not valid
};

/// One contact that answers by a law of the family (docs/laws.md),
///
///     F = constant V + sum_j k_j y_j + dashpot dV/dt + k_tension T(u),  dy_j/dt = dV/dt - r_j y_j,
///
/// the exact update of each branch for V linear within a period. Contact depth and offset of the
/// recording are not rendered: the tissue begins at the surface, and a sensor's zero error is no
/// force. Fractional laws are sums of exponentials with a stated error, taken over the session.
///
/// Where a Hertz contact shrinks this is the integral over the whole history, not Ting's solution,
/// which leaves out what the edge of the contact has left behind.
///
/// Passive in continuous time for stiffnesses >= 0 whatever the kernel (Fenchel-Young: with P the
/// integral of W and P* its Legendre transform, S = k_inf P(u) + sum k_i [P(u) + P*(W_i) - u W_i]
/// rises by no more than the work). Coordinates: the push is along +z; across it there is no force.
class LawContact final : public ContactModel {
 public:
  /// Throws Error(bad_input) for a law that is not of a force over a depth, or settings out of
  /// range.
  LawContact(const LawFile& law, const LawContactSettings& settings);

  void reset() noexcept override;
  ContactAnswer step(const ToolPose& tool) noexcept override;
  [[nodiscard]] double period_s() const noexcept override { return settings_.period_s; }
  /// Of the session's deepest place, what relaxes within a period included: kernels that stiffen
  /// have less above it.
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override;
  /// At the same depth.
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override;

  /// Depth of the surface after the last step, m; 0 or more in contact.
  [[nodiscard]] double depth_m() const noexcept { return depth_m_; }
  /// V - y_j: the kernel displacement that each branch has relaxed to, m.
  [[nodiscard]] Eigen::VectorXd relaxed_kernel_m() const {
    return (kernel_m_ - y_.array()).matrix();
  }
  /// Stiffness of each branch, N/m.
  [[nodiscard]] const Eigen::VectorXd& branch_stiffness_N_per_m() const noexcept {
    return law_.relaxation.stiffness;
  }
  /// Goes on from another state: the surface at a depth, all branches relaxed to one kernel
  /// displacement. Neither allocates nor throws.
  void take_over(double depth_m, double relaxed_kernel_m) noexcept;

  /// Shortest and longest relaxation time of what relaxes, s; empty if nothing does.
  [[nodiscard]] std::vector<double> relaxation_times_s() const;

 private:
  [[nodiscard]] Eigen::Matrix3d along_push(double stiffness_N_per_m) const noexcept;

  LawContactSettings settings_;
  LawAtParameters law_;
  Eigen::VectorXd decay_, gain_;  ///< of y_j over a period: exp(-z), (1 - exp(-z))/z
  Eigen::VectorXd y_;
  double depth_m_ = 0.0, kernel_m_ = 0.0;  ///< u and V(u) a period ago
};

/// The depth up to which a law is valid: somewhat beyond what it was fitted to; without that,
/// beyond the deepest place asked for.
[[nodiscard]] double valid_depth_m(const LawFile& law, double deepest_m);

}  // namespace tpm::contact
