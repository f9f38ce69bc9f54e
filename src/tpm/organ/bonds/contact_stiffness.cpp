#include "tpm/organ/bonds/contact_stiffness.hpp"

namespace tpm::organ {

ContactStiffness held_stiffness(const BondSystem& bonds, const Positions& rest, std::size_t sphere,
                                const Eigen::Vector3d& direction) {
  const auto column = static_cast<Eigen::Index>(sphere);
  Eigen::Matrix3Xd displacement = Eigen::Matrix3Xd::Zero(3, rest.cols());
  displacement.col(column) = direction;
  const auto stiffness = [&](double relaxation_factor) {
    const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())),
                                     relaxation_factor};
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.cols());
    bonds.add_stiffness_times(rest, viscous_state, displacement, force);
    return direction.dot(force.col(column));
  };
  return {stiffness(0.0), stiffness(1.0)};
}

}  // namespace tpm::organ
