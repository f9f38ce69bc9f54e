#include "tpm/contact/law_handover.hpp"

#include <algorithm>
#include <cmath>

namespace tpm::contact {

double LawInLoop::stored_J() const {
  const double u = std::max(contact.depth_m(), 0.0);
  const Eigen::VectorXd relaxed = contact.relaxed_kernel_m();
  double sum = energy.lasting(u);
  for (Eigen::Index j = 0; j < relaxed.size(); ++j) {
    const double stiffness = contact.branch_stiffness_N_per_m()[j];
    if (stiffness > 0.0) sum += stiffness * energy.branch(u, relaxed[j]);
  }
  return sum;
}

double LawInLoop::force_N() const {
  const double u = std::max(contact.depth_m(), 0.0);
  const Eigen::VectorXd stretched =
      (energy.kernel(u) - contact.relaxed_kernel_m().array()).matrix();
  return energy.lasting_force(u) + contact.branch_stiffness_N_per_m().dot(stretched);
}

HandOver consider_hand_over(const LawInLoop& from, const LawInLoop& to) {
  HandOver decision;
  decision.depth_m = from.contact.depth_m();
  decision.force_N = from.force_N();
  decision.energy_before_J = from.stored_J();
  const double u = std::max(decision.depth_m, 0.0);
  const double missing = decision.force_N - to.energy.lasting_force(u);
  const double stiffness = to.energy.relaxing_stiffness();
  if (!(stiffness > 0.0)) {
    decision.relaxed_kernel_m = to.energy.kernel(u);
    decision.energy_after_J = to.energy.lasting(u);
    decision.possible = missing == 0.0 && decision.energy_after_J <= decision.energy_before_J;
    return decision;
  }
  const double kernel = to.energy.kernel(u);
  decision.relaxed_kernel_m = kernel - missing / stiffness;
  decision.energy_after_J =
      to.energy.lasting(u) + stiffness * to.energy.branch(u, decision.relaxed_kernel_m);
  decision.possible = decision.energy_after_J <= decision.energy_before_J;
  return decision;
}

void hand_over(const HandOver& decision, LawInLoop& to) noexcept {
  to.contact.take_over(decision.depth_m, decision.relaxed_kernel_m);
}

}  // namespace tpm::contact
