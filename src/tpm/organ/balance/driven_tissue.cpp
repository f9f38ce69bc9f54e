#include "tpm/organ/balance/driven_tissue.hpp"

#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

ViscousState all_relaxed(const TissueState& rest) {
  return {Eigen::VectorXd::Zero(rest.followed.size()), 1.0};
}

}  // namespace

DrivenTissue::DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
                           const Probes& probes, Drive drive, EquilibriumOptions options)
    : bonds_(bonds),
      rest_(std::move(rest)),
      constraints_(std::move(constraints)),
      drive_(drive),
      equilibrium_(bonds_, constraints_, options) {
  double shares = 0.0;
  for (const Probe& probe : probes) shares += probe.share;
  for (const Probe& probe : probes) {
    driven_.push_back({static_cast<Eigen::Index>(probe.sphere), probe.direction,
                       depth_driven() ? probe.share : probe.share / shares});
    if (depth_driven()) constraints_.impose(probe.sphere, probe.direction);
  }
  const TissueState start = at_rest(0.0);
  if (held_stiffness(start.position, start.viscous_state()) > 0.0) return;
  throw bad_input("probe", "touches nothing at rest", "a sphere with bonds, or a tool at one");
}

TissueState DrivenTissue::at_rest(double time_s) const {
  TissueState state;
  state.time_s = time_s;
  state.position = rest_;
  bonds_.followed(rest_, state.followed);
  state.mean = Eigen::VectorXd::Zero(state.followed.size());
  state.viscous = Eigen::MatrixXd::Zero(state.followed.size(), bonds_.most_branches());
  state.closed = bonds_.closed_contacts(rest_);
  return state;
}

void DrivenTissue::impose(Positions& position, double imposed) const {
  if (!depth_driven()) return;
  for (const Driven& d : driven_) {
    const double depth = (position.col(d.column) - rest_.col(d.column)).dot(d.direction);
    position.col(d.column) += (d.weight * imposed - depth) * d.direction;
  }
}

void DrivenTissue::load(double imposed, Eigen::Matrix3Xd& force) const {
  force.setZero(3, rest_.cols());
  if (depth_driven()) return;
  for (const Driven& d : driven_) force.col(d.column) += d.weight * imposed * d.direction;
}

void DrivenTissue::impose(LaneMatrix& position, const LaneVector& imposed) const {
  if (!depth_driven()) return;
  for (const Driven& d : driven_) {
    auto place = position.middleCols<3>(3 * d.column);
    const Eigen::RowVector3d rest = rest_.col(d.column).transpose();
    const LaneVector further = d.weight * imposed - (place.rowwise() - rest) * d.direction;
    place += further * d.direction.transpose();
  }
}

void DrivenTissue::add_load(const LaneVector& imposed, LaneMatrix& force) const {
  if (depth_driven()) return;
  for (const Driven& d : driven_) {
    force.middleCols<3>(3 * d.column) += d.weight * imposed * d.direction.transpose();
  }
}

void DrivenTissue::impose_change(LaneMatrix& displacement, const LaneVector& change) const {
  if (!depth_driven()) return;
  for (const Driven& d : driven_) {
    auto moved = displacement.middleCols<3>(3 * d.column);
    const LaneVector further = d.weight * change - moved * d.direction;
    moved += further * d.direction.transpose();
  }
}

LaneVector DrivenTissue::response_change(const LaneMatrix& displacement,
                                         const LaneMatrix& force) const {
  const double sign = depth_driven() ? -1.0 : 1.0;
  const LaneMatrix& of = depth_driven() ? force : displacement;
  LaneVector change = LaneVector::Zero();
  for (const Driven& d : driven_) {
    change += sign * d.weight * (of.middleCols<3>(3 * d.column) * d.direction);
  }
  return change;
}

LaneVector DrivenTissue::response(const LaneMatrix& position, const LaneMatrix& force) const {
  if (depth_driven()) return response_change(position, force);
  LaneVector depth = LaneVector::Zero();
  for (const Driven& d : driven_) {
    const Eigen::RowVector3d rest = rest_.col(d.column).transpose();
    depth += d.weight * ((position.middleCols<3>(3 * d.column).rowwise() - rest) * d.direction);
  }
  return depth;
}

double DrivenTissue::depth_of(const Eigen::Matrix3Xd& displacement) const {
  double weights = 0.0;
  for (const Driven& d : driven_) weights += depth_driven() ? d.weight * d.weight : d.weight;
  return along(displacement) / weights;
}

double DrivenTissue::along(const Eigen::Matrix3Xd& vectors) const {
  double sum = 0.0;
  for (const Driven& d : driven_) sum += d.weight * vectors.col(d.column).dot(d.direction);
  return sum;
}

double DrivenTissue::response(const Positions& position, const Eigen::Matrix3Xd& force) const {
  return depth_driven() ? 0.0 - along(force) : depth_of(position - rest_);
}

double DrivenTissue::response(const TissueState& state) const {
  Eigen::Matrix3Xd force;
  load(state.imposed, force);
  bonds_.add_forces(state.position, state.viscous_state(), force);
  return response(state.position, force);
}

Eigen::Matrix3Xd DrivenTissue::unit() const {
  Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (const Driven& d : driven_) unit.col(d.column) = d.weight * d.direction;
  return unit;
}

Eigen::Matrix3Xd DrivenTissue::unit_on_touched() const {
  const Eigen::Matrix3Xd of_tools = unit();
  const std::vector<char> closed = bonds_.closed_contacts(rest_);
  Eigen::Matrix3Xd on_touched = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const ToolContact& contact = bonds_.contacts()[i];
    if (closed[i] != 0) on_touched.col(contact.sphere) += of_tools.col(contact.tool);
  }
  return on_touched;
}

DrivenTissue::UnitField DrivenTissue::unit_field(const TissueState& state,
                                                 const ViscousState& viscous_state) const {
  UnitField field;
  const Eigen::Matrix3Xd unit = this->unit();
  if (!depth_driven()) {
    field.displacement = unit;
    equilibrium_.displace(field.displacement);
    field.stiffness = field.whole = along(field.displacement);
    field.adjoint = field.displacement;
    return field;
  }
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(state.position, viscous_state, unit, pushed);
  field.displacement = -pushed;
  equilibrium_.displace(field.displacement);
  field.stiffness = -pushed.cwiseProduct(field.displacement).sum();
  field.displacement += unit;
  field.whole = pushed.cwiseProduct(field.displacement).sum();
  field.adjoint = field.displacement;
  if (!pushed.isZero(0.0)) return field;
  const Eigen::Matrix3Xd push = unit_on_touched();
  field.adjoint = push;
  equilibrium_.displace(field.adjoint);
  field.stiffness = field.whole = 1.0 / push.cwiseProduct(field.adjoint).sum();
  field.adjoint *= field.stiffness;
  return field;
}

double DrivenTissue::held_stiffness(const Positions& position,
                                    const ViscousState& viscous_state) const {
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(position, viscous_state, unit(), pushed);
  return along(pushed);
}

double DrivenTissue::relaxed_response(const TissueState& rest,
                                      const Eigen::Matrix3Xd& displacement) const {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(rest.position, all_relaxed(rest), displacement, force);
  const double work = displacement.cwiseProduct(force).sum();
  if (depth_driven()) return work;
  const double moved = along(displacement);
  return moved * moved / work;
}

double DrivenTissue::linear_response(const TissueState& rest, double peak) {
  const ViscousState relaxed = all_relaxed(rest);
  if (!equilibrium_.factorise(rest.position, relaxed)) return 0.0;
  return peak * relaxed_response(rest, unit_field(rest, relaxed).displacement);
}

double DrivenTissue::push_on_tissue(const Eigen::Matrix3Xd& on_driven) const {
  double sum = 0.0;
  for (const Driven& d : driven_) {
    sum -= (depth_driven() ? d.weight : 1.0) * on_driven.col(d.column).dot(d.direction);
  }
  return sum;
}

void DrivenTissue::add_imposed_velocity(double rate, Eigen::Matrix3Xd& velocity) const {
  if (!depth_driven()) return;
  for (const Driven& d : driven_) velocity.col(d.column) += d.weight * rate * d.direction;
}

double DrivenTissue::driven_mass_kg(const Eigen::VectorXd& mass_kg) const {
  double mass = 0.0;
  for (const Driven& d : driven_) mass += d.weight * d.weight * mass_kg[d.column];
  return mass;
}

}  // namespace tpm::organ
