#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/contact/pushed_contact.hpp"

namespace tpm::contact {

/// Error of taking elongations as linear within a servo period, estimated with a small linear
/// model of the tissue: its displacements are combinations of the fields that follow the contact at
/// once and those that follow it when relaxed (a symmetric projection of the linear network). The
/// model is advanced both ways, exactly and as the network is; the forces differ by the estimate.
class StepError {
 public:
  /// @param position, equilibrium about which the network is linearised
  StepError(PushedContact& tissue, const Positions& position, double relaxed, double period_s);

  void reset() noexcept;
  /// Advances by a period to a displacement of the contact, m.
  /// @returns the exact force on the tissue less that of the network as it is advanced, N
  Eigen::Vector3d advance(const Eigen::Vector3d& displacement_m) noexcept;

 private:
  using SixSquare = Eigen::Matrix<double, 6, 6>;
  using SixThree = Eigen::Matrix<double, 6, 3>;

  /// One way to advance: the viscous elongations, six of each branch, follow from themselves and
  /// the contact's displacements.
  struct Advance {
    Eigen::MatrixXd of_viscous, of_start, of_end;
    Eigen::VectorXd viscous, next;
    void move(const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept;
  };

  Advance exact_, stepped_;
  Eigen::MatrixXd force_of_viscous_;  ///< 3 by the viscous elongations
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
};

}  // namespace tpm::contact
