#include "tpm/network/driven_tissue.hpp"

namespace tpm {

DrivenTissue::DrivenTissue(const BondSystem& bonds, Positions rest, Freedom freedom,
                           const Probe& probe, Drive drive)
    : bonds_(bonds),
      rest_(std::move(rest)),
      freedom_(std::move(freedom)),
      probe_(probe),
      drive_(drive),
      equilibrium_(bonds_, freedom_) {
  if (depth_driven()) freedom_.impose(probe.sphere, probe.direction);
}

TissueState DrivenTissue::at_rest(double time_s) const {
  TissueState state;
  state.time_s = time_s;
  state.position = rest_;
  bonds_.elongations(rest_, state.elongation);
  state.remembered = Eigen::VectorXd::Zero(state.elongation.size());
  return state;
}

void DrivenTissue::impose(Positions& position, double imposed) const {
  if (!depth_driven()) return;
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  const double depth = (position.col(column) - rest_.col(column)).dot(probe_.direction);
  position.col(column) += (imposed - depth) * probe_.direction;
}

void DrivenTissue::load(double imposed, Eigen::Matrix3Xd& force) const {
  force.setZero(3, rest_.cols());
  if (depth_driven()) return;
  force.col(static_cast<Eigen::Index>(probe_.sphere)) = imposed * probe_.direction;
}

void DrivenTissue::impose(LaneMatrix& position, const LaneVector& imposed) const {
  if (!depth_driven()) return;
  const auto first = 3 * static_cast<Eigen::Index>(probe_.sphere);
  auto of_probe = position.middleCols<3>(first);
  const Eigen::RowVector3d rest = rest_.col(first / 3).transpose();
  const LaneVector further = imposed - (of_probe.rowwise() - rest) * probe_.direction;
  of_probe += further * probe_.direction.transpose();
}

void DrivenTissue::add_load(const LaneVector& imposed, LaneMatrix& force) const {
  if (depth_driven()) return;
  force.middleCols<3>(3 * static_cast<Eigen::Index>(probe_.sphere)) +=
      imposed * probe_.direction.transpose();
}

void DrivenTissue::impose_change(LaneMatrix& displacement, const LaneVector& change) const {
  if (!depth_driven()) return;
  auto of_probe = displacement.middleCols<3>(3 * static_cast<Eigen::Index>(probe_.sphere));
  const LaneVector further = change - of_probe * probe_.direction;
  of_probe += further * probe_.direction.transpose();
}

LaneVector DrivenTissue::response_change(const LaneMatrix& displacement,
                                         const LaneMatrix& force) const {
  const auto first = 3 * static_cast<Eigen::Index>(probe_.sphere);
  if (depth_driven()) return -force.middleCols<3>(first) * probe_.direction;
  return displacement.middleCols<3>(first) * probe_.direction;
}

LaneVector DrivenTissue::response(const LaneMatrix& position, const LaneMatrix& force) const {
  const auto first = 3 * static_cast<Eigen::Index>(probe_.sphere);
  if (depth_driven()) return -force.middleCols<3>(first) * probe_.direction;
  const Eigen::RowVector3d rest = rest_.col(first / 3).transpose();
  return (position.middleCols<3>(first).rowwise() - rest) * probe_.direction;
}

double DrivenTissue::response(const Positions& position, const Eigen::Matrix3Xd& force) const {
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  if (depth_driven()) return -force.col(column).dot(probe_.direction);
  return (position.col(column) - rest_.col(column)).dot(probe_.direction);
}

double DrivenTissue::response(const TissueState& state) const {
  Eigen::Matrix3Xd force;
  load(state.imposed, force);
  bonds_.add_forces(state.position, {state.remembered, 0.0}, force);
  return response(state.position, force);
}

void DrivenTissue::unit_field(const TissueState& state, const BondMemory& memory,
                              Eigen::Matrix3Xd& field, double& stiffness) const {
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  unit.col(column) = probe_.direction;
  if (!depth_driven()) {
    field = unit;
    equilibrium_.displace(field);
    stiffness = field.col(column).dot(probe_.direction);
    return;
  }
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(state.position, memory, unit, pushed);
  field = -pushed;
  equilibrium_.displace(field);
  stiffness = -pushed.cwiseProduct(field).sum();
  field += unit;
}

double DrivenTissue::held_stiffness(const Positions& position, const BondMemory& memory) const {
  const auto column = static_cast<Eigen::Index>(probe_.sphere);
  Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  unit.col(column) = probe_.direction;
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(position, memory, unit, pushed);
  return pushed.col(column).dot(probe_.direction);
}

double DrivenTissue::linear_response(const TissueState& rest, double peak) {
  const BondMemory relaxed{Eigen::VectorXd::Zero(rest.elongation.size()), 1.0};
  Eigen::Matrix3Xd field;
  double path = 0.0;
  if (!equilibrium_.factorise(rest.position, relaxed)) return 0.0;
  unit_field(rest, relaxed, field, path);
  if (!depth_driven()) return path * peak;
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(rest.position, relaxed, field, force);
  return force.col(static_cast<Eigen::Index>(probe_.sphere)).dot(probe_.direction) * peak;
}

}  // namespace tpm
