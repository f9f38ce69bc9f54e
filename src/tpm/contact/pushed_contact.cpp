#include "tpm/contact/pushed_contact.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kStride_m = 1e-3;
constexpr double kLeastStride_m = 1e-6;
constexpr double kBalanceLength_m = 0.5e-3;
constexpr double kBalance = 1e-11;  // of the stiffest bond times that length
constexpr double kRestLength = 1e-9;

Constraints with_contact_held(Constraints constraints, std::size_t sphere) {
  if (sphere >= constraints.size() || !constraints.is_free(sphere)) {
    throw bad_input("contact", fmt::format("sphere {} is not free", sphere + 1),
                    "a sphere that nothing holds or guides");
  }
  constraints.fix(sphere);
  return constraints;
}

void require_at_rest(const BondSystem& bonds, const Positions& rest) {
  if (bonds.contact_count() > 0) {
    throw bad_input("bonds", "there are tools among them",
                    "a tissue whose spheres are moved themselves");
  }
  Eigen::VectorXd elongation;
  bonds.elongations(rest, elongation);
  if ((elongation.cwiseAbs().array() <= kRestLength * bonds.rest_length_m().array()).all()) return;
  throw bad_input("rest", "bonds do not have their rest length there", "a tissue without tension");
}

}  // namespace

PushedContact::PushedContact(const BondSystem& bonds, Positions rest, Constraints constraints,
                             std::size_t contact)
    : bonds_(bonds),
      rest_(std::move(rest)),
      constraints_(with_contact_held(std::move(constraints), contact)),
      contact_(contact),
      equilibrium_(bonds_, constraints_) {
  require_at_rest(bonds_, rest_);
}

ViscousState PushedContact::viscous_state(const Positions& position, double relaxed,
                                          double relaxation_factor) const {
  ViscousState viscous_state;
  bonds_.elongations(position, viscous_state.offset);
  viscous_state.offset *= relaxed - relaxation_factor;
  viscous_state.relaxation_factor = relaxation_factor;
  return viscous_state;
}

Positions PushedContact::at(const Eigen::Vector3d& displacement_m, double relaxed) {
  Found here{relaxed, Eigen::Vector3d::Zero(), rest_};
  for (const Found& other : found_) {
    const bool nearer = (other.displacement_m - displacement_m).norm() <
                        (here.displacement_m - displacement_m).norm();
    if (other.relaxed == relaxed && nearer) here = other;
  }
  const Eigen::Vector3d from = here.displacement_m;
  const double way = (displacement_m - from).norm();
  const double tolerance_N = kBalance * kBalanceLength_m * bonds_.stiffness().maxCoeff();
  const Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size())),
                                   relaxed};
  double done = 0.0;
  double stride = kStride_m;
  // Free spheres continue their motion of the stride before.
  Positions before = here.position;
  double went = 0.0;
  while (done < way) {
    const double aim = std::min(done + stride, way);
    Positions next = here.position;
    if (went > 0.0) next += (aim - done) / went * (here.position - before);
    const auto column = static_cast<Eigen::Index>(contact_);
    next.col(column) = rest_.col(column) + from + aim / way * (displacement_m - from);
    const EquilibriumSearch search = equilibrium_.find(next, viscous_state, load, tolerance_N);
    if (search.converged && search.stable) {
      before = std::move(here.position);
      here.position = std::move(next);
      went = aim - done;
      done = aim;
      stride = kStride_m;
      continue;
    }
    stride *= 0.5;
    if (stride > kLeastStride_m) continue;
    throw Error(
        ExitCode::numerical, "contact",
        fmt::format("no stable equilibrium at {} mm from rest",
                    significant(1e3 * (from + aim / way * (displacement_m - from)).norm(), 4)));
  }
  here.displacement_m = displacement_m;
  if (way > 0.0) found_.push_back(here);
  return here.position;
}

ContactFields PushedContact::fields(const Positions& position, const ViscousState& viscous_state) {
  if (!equilibrium_.factorise(position, viscous_state) || !equilibrium_.is_stable()) {
    throw Error(ExitCode::numerical, "contact", "the tissue has no stiffness there");
  }
  ContactFields fields;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix3Xd unit = Eigen::Matrix3Xd::Zero(3, rest_.cols());
    unit(axis, static_cast<Eigen::Index>(contact_)) = 1.0;
    Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, rest_.cols());
    bonds_.add_stiffness_times(position, viscous_state, unit, pull);
    Eigen::Matrix3Xd& field = fields.displacement[static_cast<std::size_t>(axis)];
    field = -pull;
    equilibrium_.displace(field);
    field += unit;
    pull.setZero();
    bonds_.add_stiffness_times(position, viscous_state, field, pull);
    fields.stiffness.col(axis) = pull.col(static_cast<Eigen::Index>(contact_));
  }
  fields.stiffness = (0.5 * (fields.stiffness + fields.stiffness.transpose())).eval();
  return fields;
}

}  // namespace tpm::contact
