#pragma once
// The full network along any path of one contact sphere, by small steps: a reference for contact
// models.
#include <stdexcept>

#include "tpm/law/relaxation/relaxation_filter.hpp"
#include "tpm/organ/balance/equilibrium.hpp"

namespace tpm::testing {
using namespace organ;

/// Elongations are taken as linear over a step, under which every viscous elongation is advanced
/// exactly: second order in the step.
class ContactPath {
 public:
  /// @param freedom by value: the contact is held
  ContactPath(const BondSystem& bonds, Positions rest, Constraints constraints, std::size_t contact)
      : bonds_(bonds),
        constraints_((constraints.fix(contact), std::move(constraints))),
        equilibrium_(bonds_, constraints_),
        rest_(std::move(rest)),
        position_(rest_),
        before_(rest_),
        contact_(static_cast<Eigen::Index>(contact)),
        viscous_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size()))),
        elongation_(viscous_),
        no_load_(Eigen::Matrix3Xd::Zero(3, rest_.cols())) {}

  /// @param displacement_m of the contact at the end of the step
  void advance(const Eigen::Vector3d& displacement_m, double step_s) {
    const RelaxationWeights k = relaxation_weights(step_s / bonds_.relaxation_time_s());
    viscous_state_ = {k.r * viscous_ + k.w0 * elongation_, k.w1};
    Positions next = 2.0 * position_ - before_;  // what moves goes on
    next.col(contact_) = rest_.col(contact_) + displacement_m;
    EquilibriumSearch search = equilibrium_.find(next, viscous_state_, no_load_, 1e-9);
    if (!search.converged || !search.stable) {
      next = position_;
      next.col(contact_) = rest_.col(contact_) + displacement_m;
      search = equilibrium_.find(next, viscous_state_, no_load_, 1e-9);
    }
    if (!search.converged || !search.stable) throw std::runtime_error("no equilibrium");
    before_ = position_;
    position_ = next;
    bonds_.elongations(position_, elongation_);
    viscous_ = viscous_state_.offset + viscous_state_.relaxation_factor(0) * elongation_;
  }

  /// Of the tissue on the contact, N.
  [[nodiscard]] Eigen::Vector3d force_N() const {
    Eigen::Matrix3Xd force;
    equilibrium_.forces(position_, {viscous_, 0.0}, no_load_, force);
    return force.col(contact_);
  }
  [[nodiscard]] Eigen::Matrix3Xd displacements_m() const { return position_ - rest_; }

 private:
  const BondSystem& bonds_;
  Constraints constraints_;
  Equilibrium equilibrium_;
  Positions rest_, position_, before_;
  Eigen::Index contact_;
  Eigen::VectorXd viscous_, elongation_;
  Eigen::Matrix3Xd no_load_;
  ViscousState viscous_state_;
};

}  // namespace tpm::testing
