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
    : DrivenTissue(bonds, std::move(rest), std::move(constraints), probes, ImposedPath(drive),
                   options) {
  if (probes.loading().beside.empty()) return;
  throw bad_input("contacts", "have protocols of their own", "one protocol for all");
}

DrivenTissue::DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
                           const Probes& probes, const Protocol& protocol,
                           EquilibriumOptions options)
    : DrivenTissue(bonds, std::move(rest), std::move(constraints), probes,
                   ImposedPath(protocol, probes.loading().beside), options) {}

DrivenTissue::DrivenTissue(const BondSystem& bonds, Positions rest, Constraints constraints,
                           const Probes& probes, ImposedPath path, EquilibriumOptions options)
    : bonds_(bonds),
      rest_(std::move(rest)),
      constraints_(std::move(constraints)),
      path_(std::move(path)),
      driven_(path_.groups()),
      dead_N_(probes.loading().dead_N),
      equilibrium_(bonds_, constraints_, options) {
  drive({&*probes.begin(), probes.size()}, 0);
  for (std::size_t g = 1; g < groups(); ++g) drive(probes.loading().beside[g - 1].probes, g);
  const TissueState start = at_rest(0.0);
  if (preloaded()) stored_at_rest_J_ = bonds_.stored_energy_J(start.position, start.viscous);
  for (std::size_t g = 0; g < groups(); ++g) {
    if (held_stiffness(start.position, start.viscous_state(), g) > 0.0) continue;
    throw bad_input("probe", "touches nothing at rest", "a sphere with bonds, or a tool at one");
  }
}

void DrivenTissue::drive(std::span<const Probe> probes, std::size_t group) {
  double shares = 0.0;
  for (const Probe& probe : probes) shares += probe.share;
  for (const Probe& probe : probes) {
    driven_[group].push_back({static_cast<Eigen::Index>(probe.sphere), probe.direction,
                              depth_driven(group) ? probe.share : probe.share / shares});
    if (depth_driven(group)) constraints_.impose(probe.sphere, probe.direction);
  }
}

TissueState DrivenTissue::at_rest(double time_s) const {
  TissueState state;
  state.time_s = time_s;
  state.position = rest_;
  bonds_.followed(rest_, state.followed);
  state.mean = Eigen::VectorXd::Zero(state.followed.size());
  state.viscous = Eigen::MatrixXd::Zero(state.followed.size(), bonds_.most_branches());
  state.closed = bonds_.closed_contacts(rest_);
  if (preloaded()) state.set_equilibrium();
  return state;
}

double DrivenTissue::dead_energy_J(const Positions& position) const {
  if (!preloaded()) return 0.0;
  return -dead_N_.cwiseProduct(position - rest_).sum() - stored_at_rest_J_;
}

double DrivenTissue::loads_J(const Positions& position, double imposed, double response) const {
  double sum = depth_driven() ? 0.0 : path_.value(0, imposed) * response;
  for (std::size_t g = 1; g < groups(); ++g) {
    if (!depth_driven(g)) sum += path_.value(g, imposed) * depth_of(position - rest_, g);
  }
  return sum;
}

std::vector<double> DrivenTissue::beside_responses(const Positions& position,
                                                   const ViscousState& viscous_state,
                                                   double imposed) const {
  std::vector<double> responses;
  if (path_.single()) return responses;
  Eigen::Matrix3Xd force;
  load(imposed, force);
  bonds_.add_forces(position, viscous_state, force);
  for (std::size_t g = 1; g < groups(); ++g) responses.push_back(response(position, force, g));
  return responses;
}

void DrivenTissue::impose(Positions& position, double imposed) const {
  for (std::size_t g = 0; g < groups(); ++g) {
    if (!depth_driven(g)) continue;
    const double value = path_.value(g, imposed);
    for (const Driven& d : driven_[g]) {
      const double depth = (position.col(d.column) - rest_.col(d.column)).dot(d.direction);
      position.col(d.column) += (d.weight * value - depth) * d.direction;
    }
  }
}

void DrivenTissue::load(double imposed, Eigen::Matrix3Xd& force) const {
  if (preloaded()) {
    force = dead_N_;
  } else {
    force.setZero(3, rest_.cols());
  }
  for (std::size_t g = 0; g < groups(); ++g) {
    if (depth_driven(g)) continue;
    const double value = path_.value(g, imposed);
    for (const Driven& d : driven_[g]) force.col(d.column) += d.weight * value * d.direction;
  }
}

LaneVector DrivenTissue::values(std::size_t group, const LaneVector& imposed) const {
  if (path_.single()) return imposed;
  return imposed.unaryExpr([&](double at) { return path_.value(group, at); });
}

void DrivenTissue::impose(LaneMatrix& position, const LaneVector& imposed) const {
  for (std::size_t g = 0; g < groups(); ++g) {
    if (!depth_driven(g)) continue;
    const LaneVector value = values(g, imposed);
    for (const Driven& d : driven_[g]) {
      auto place = position.middleCols<3>(3 * d.column);
      const Eigen::RowVector3d rest = rest_.col(d.column).transpose();
      const LaneVector further = d.weight * value - (place.rowwise() - rest) * d.direction;
      place += further * d.direction.transpose();
    }
  }
}

void DrivenTissue::add_load(const LaneVector& imposed, LaneMatrix& force) const {
  if (preloaded()) {
    force.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(dead_N_.data(), dead_N_.size());
  }
  for (std::size_t g = 0; g < groups(); ++g) {
    if (depth_driven(g)) continue;
    const LaneVector value = values(g, imposed);
    for (const Driven& d : driven_[g]) {
      force.middleCols<3>(3 * d.column) += d.weight * value * d.direction.transpose();
    }
  }
}

void DrivenTissue::impose_change(LaneMatrix& displacement, const LaneVector& change) const {
  if (!depth_driven()) return;
  for (const Driven& d : driven_.front()) {
    auto moved = displacement.middleCols<3>(3 * d.column);
    const LaneVector further = d.weight * change - moved * d.direction;
    moved += further * d.direction.transpose();
  }
}

LaneVector DrivenTissue::response_change(const LaneMatrix& displacement, const LaneMatrix& force,
                                         std::size_t group) const {
  const double sign = depth_driven(group) ? -1.0 : 1.0;
  const LaneMatrix& of = depth_driven(group) ? force : displacement;
  LaneVector change = LaneVector::Zero();
  for (const Driven& d : driven_[group]) {
    change += sign * d.weight * (of.middleCols<3>(3 * d.column) * d.direction);
  }
  return change;
}

LaneVector DrivenTissue::response(const LaneMatrix& position, const LaneMatrix& force,
                                  std::size_t group) const {
  if (depth_driven(group)) return response_change(position, force, group);
  LaneVector depth = LaneVector::Zero();
  for (const Driven& d : driven_[group]) {
    const Eigen::RowVector3d rest = rest_.col(d.column).transpose();
    depth += d.weight * ((position.middleCols<3>(3 * d.column).rowwise() - rest) * d.direction);
  }
  return depth;
}

double DrivenTissue::depth_of(const Eigen::Matrix3Xd& displacement, std::size_t group) const {
  double weights = 0.0;
  for (const Driven& d : driven_[group]) {
    weights += depth_driven(group) ? d.weight * d.weight : d.weight;
  }
  return along(displacement, group) / weights;
}

double DrivenTissue::along(const Eigen::Matrix3Xd& vectors, std::size_t group) const {
  double sum = 0.0;
  for (const Driven& d : driven_[group]) {
    sum += d.weight * vectors.col(d.column).dot(d.direction);
  }
  return sum;
}

double DrivenTissue::response(const Positions& position, const Eigen::Matrix3Xd& force,
                              std::size_t group) const {
  return depth_driven(group) ? 0.0 - along(force, group) : depth_of(position - rest_, group);
}

double DrivenTissue::response(const TissueState& state) const {
  Eigen::Matrix3Xd force;
  load(state.imposed, force);
  bonds_.add_forces(state.position, state.viscous_state(), force);
  return response(state.position, force);
}

Eigen::Matrix3Xd DrivenTissue::unit(std::size_t group) const {
  Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (const Driven& d : driven_[group]) unit.col(d.column) = d.weight * d.direction;
  return unit;
}

Eigen::Matrix3Xd DrivenTissue::unit_on_touched(std::size_t group) const {
  const Eigen::Matrix3Xd of_tools = unit(group);
  const std::vector<char> closed = bonds_.closed_contacts(rest_);
  Eigen::Matrix3Xd on_touched = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const ToolContact& contact = bonds_.contacts()[i];
    if (closed[i] != 0) on_touched.col(contact.sphere) += of_tools.col(contact.tool);
  }
  return on_touched;
}

DrivenTissue::UnitField DrivenTissue::unit_field(const TissueState& state,
                                                 const ViscousState& viscous_state,
                                                 std::size_t group) const {
  UnitField field;
  const Eigen::Matrix3Xd unit = this->unit(group);
  if (!depth_driven(group)) {
    field.displacement = unit;
    equilibrium_.displace(field.displacement);
    field.stiffness = field.whole = along(field.displacement, group);
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
  const Eigen::Matrix3Xd push = unit_on_touched(group);
  field.adjoint = push;
  equilibrium_.displace(field.adjoint);
  field.stiffness = field.whole = 1.0 / push.cwiseProduct(field.adjoint).sum();
  field.adjoint *= field.stiffness;
  return field;
}

double DrivenTissue::held_stiffness(const Positions& position, const ViscousState& viscous_state,
                                    std::size_t group) const {
  Eigen::Matrix3Xd pushed = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(position, viscous_state, unit(group), pushed);
  return along(pushed, group);
}

double DrivenTissue::relaxed_response(const TissueState& rest, const Eigen::Matrix3Xd& displacement,
                                      std::size_t group) const {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  bonds_.add_stiffness_times(rest.position, all_relaxed(rest), displacement, force);
  const double work = displacement.cwiseProduct(force).sum();
  if (depth_driven(group)) return work;
  const double moved = along(displacement, group);
  return moved * moved / work;
}

double DrivenTissue::linear_response(const TissueState& rest, double peak) {
  const ViscousState relaxed = all_relaxed(rest);
  if (!equilibrium_.factorise(rest.position, relaxed)) return 0.0;
  return peak * relaxed_response(rest, unit_field(rest, relaxed).displacement);
}

double DrivenTissue::push_on_tissue(const Eigen::Matrix3Xd& on_driven) const {
  double sum = 0.0;
  for (const Driven& d : driven_.front()) {
    sum -= (depth_driven() ? d.weight : 1.0) * on_driven.col(d.column).dot(d.direction);
  }
  return sum;
}

double DrivenTissue::power_on_tissue(const Eigen::Matrix3Xd& on_driven, double imposed,
                                     double rate) const {
  double power = 0.0;
  for (std::size_t g = 0; g < groups(); ++g) {
    if (depth_driven(g)) power -= rate * path_.slope(g, imposed) * along(on_driven, g);
  }
  return power;
}

void DrivenTissue::add_imposed_velocity(double imposed, double rate,
                                        Eigen::Matrix3Xd& velocity) const {
  for (std::size_t g = 0; g < groups(); ++g) {
    if (!depth_driven(g)) continue;
    const double speed = rate * path_.slope(g, imposed);
    for (const Driven& d : driven_[g]) velocity.col(d.column) += d.weight * speed * d.direction;
  }
}

double DrivenTissue::driven_mass_kg(const Eigen::VectorXd& mass_kg) const {
  double mass = 0.0;
  for (const Driven& d : driven_.front()) mass += d.weight * d.weight * mass_kg[d.column];
  return mass;
}

}  // namespace tpm::organ
