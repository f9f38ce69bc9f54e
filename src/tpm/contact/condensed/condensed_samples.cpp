#include "tpm/contact/condensed/condensed_samples.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/organ/balance/buckling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

constexpr double kSampleBalance = 1e-9;  // of stiffness at the contact times the stride
constexpr double kLeastStride = 1e-3;    // of the longest
constexpr double kSlow = 0.3;            // of the force left before: a new factorisation is cheaper
constexpr int kMostIterations = 40;

}  // namespace

CondensedSampler::CondensedSampler(const BondSystem& bonds, Positions rest,
                                   const Constraints& constraints, std::size_t contact,
                                   double stride_m)
    : bonds_(bonds),
      rest_(std::move(rest)),
      contact_(static_cast<Eigen::Index>(contact)),
      stride_m_(stride_m),
      equilibrium_(bonds, constraints),
      no_load_(Eigen::Matrix3Xd::Zero(3, rest_.cols())) {
  relaxed_.position = rest_;
  viscous_state_ = {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), 1.0};
  find_moves(relaxed_, viscous_state_);
  tolerance_N_ = kSampleBalance * relaxed_.stiffness.norm() * stride_m_;
  latest_ = relaxed_;
}

void CondensedSampler::find_moves(State& state, const ViscousState& viscous_state) {
  ++factorisations_;
  if (!equilibrium_.factorise(state.position, viscous_state) || !equilibrium_.is_stable()) {
    throw Error(ExitCode::numerical, ErrorCause::buckled, "condensed model",
                fmt::format("with the contact at {} mm the tissue buckles{}: its stiffness is not "
                            "positive; expected a smaller depth",
                            significant(1e3 * state.contact.norm(), 4),
                            buckling_place(equilibrium_, state.position, viscous_state,
                                           state.position.cols())));
  }
  state.moves.resize(3 * rest_.cols(), 3);
  Eigen::Matrix3Xd shift;
  Eigen::Matrix3Xd force;
  for (Eigen::Index k = 0; k < 3; ++k) {
    shift.setZero(3, rest_.cols());
    shift(k, contact_) = 1.0;
    force.setZero(3, rest_.cols());
    bonds_.add_stiffness_times(state.position, viscous_state, shift, force);
    force = -force;
    equilibrium_.displace(force);
    shift += force;
    state.moves.col(k) = shift.reshaped();
    force.setZero(3, rest_.cols());
    bonds_.add_stiffness_times(state.position, viscous_state, shift, force);
    state.stiffness.col(k) = force.col(contact_);
  }
}

bool CondensedSampler::balance(Positions& position, const ViscousState& viscous_state) {
  Eigen::Matrix3Xd force;
  double before_N = std::numeric_limits<double>::infinity();
  bool factorised = false;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    equilibrium_.forces(position, viscous_state, no_load_, force);
    equilibrium_.constraints().project(force);
    const double left_N = force.colwise().norm().maxCoeff();
    if (left_N <= tolerance_N_) return true;
    if (!std::isfinite(left_N)) return false;
    if (!factorised || left_N > kSlow * before_N) {
      ++factorisations_;
      if (!equilibrium_.factorise(position, viscous_state) || !equilibrium_.is_stable())
        return false;
      factorised = true;
    }
    before_N = left_N;
    equilibrium_.displace(force);
    position += force;
  }
  return false;
}

void CondensedSampler::move(State& state, const Eigen::Vector3d& contact,
                            const ViscousState& viscous_state) {
  double stride = stride_m_;
  while (state.contact != contact) {
    const Eigen::Vector3d way = contact - state.contact;
    const double share = std::min(1.0, stride / way.norm());
    State next = state;
    next.contact = share < 1.0 ? Eigen::Vector3d(state.contact + share * way) : contact;
    const Eigen::Vector3d step = next.contact - state.contact;
    next.position += (state.moves * step).reshaped(3, rest_.cols());
    next.position.col(contact_) = rest_.col(contact_) + next.contact;
    const Positions predicted = next.position;
    if (balance(next.position, viscous_state)) {
      find_moves(next, viscous_state);
      state = std::move(next);
      continue;
    }
    // With a line search, and the reason if that fails too.
    next.position = predicted;
    const EquilibriumSearch search =
        equilibrium_.find(next.position, viscous_state, no_load_, tolerance_N_);
    factorisations_ += search.factorisations;
    if (search.converged && search.stable) {
      find_moves(next, viscous_state);
      state = std::move(next);
      continue;
    }
    stride *= 0.5;
    if (stride < kLeastStride * stride_m_) {
      throw Error(
          ExitCode::numerical, search.stable ? ErrorCause::snapped_through : ErrorCause::buckled,
          "condensed model",
          fmt::format("with the contact at {} mm the tissue {}{}; expected a smaller depth",
                      significant(1e3 * state.contact.norm(), 4),
                      search.stable ? "finds no equilibrium near: it may snap through" : "buckles",
                      buckling_place(equilibrium_, state.position, viscous_state, rest_.cols())));
    }
  }
}

CondensedSampler::Moves CondensedSampler::elongation_moves(const State& state) const {
  Moves result(static_cast<Eigen::Index>(bonds_.size()), 3);
  Eigen::VectorXd change;
  for (Eigen::Index k = 0; k < 3; ++k) {
    bonds_.elongation_changes(state.position, state.moves.col(k).reshaped(3, rest_.cols()), change);
    result.col(k) = change;
  }
  return result;
}

Eigen::VectorXd CondensedSampler::elongations(const State& state) const {
  Eigen::VectorXd l;
  bonds_.elongations(state.position, l);
  return l;
}

CondensedMetric CondensedSampler::relax_at(const Eigen::Vector3d& w_m) {
  const ViscousState all_follow{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size())),
                                1.0};
  move(relaxed_, w_m, all_follow);
  viscous_moves_ = elongation_moves(relaxed_);
  viscous_state_ = {elongations(relaxed_), 0.0};
  latest_ = relaxed_;
  find_moves(latest_, viscous_state_);

  const auto g = bonds_.relaxing().asDiagonal();
  const Moves held = elongation_moves(latest_);
  CondensedMetric found;
  found.w_m = w_m;
  found.metric = viscous_moves_.transpose() * g * viscous_moves_;
  const Moves second =
      held - viscous_moves_ * found.metric.llt().solve(viscous_moves_.transpose() * g * held);
  found.second_metric = second.transpose() * g * second;
  // The reduced energy of a change dy of the viscous state is dy' (g - g S g) dy / 2, S g dy = B
  // K^-1 B' g dy what the elongations answer to it: found as the displacement under the forces of
  // -g dy.
  Moves answer(second.rows(), 3);
  found.second_moves.resize(rest_.size(), 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    // add_forces is affine in the viscous state: the forces of dy alone are a difference.
    Eigen::Matrix3Xd with = no_load_;
    Eigen::Matrix3Xd without = no_load_;
    bonds_.add_forces(latest_.position, {viscous_state_.offset + second.col(k), 0.0}, with);
    bonds_.add_forces(latest_.position, viscous_state_, without);
    with -= without;
    equilibrium_.displace(with);
    found.second_moves.col(k) = with.reshaped();
    Eigen::VectorXd change;
    bonds_.elongation_changes(latest_.position, with, change);
    answer.col(k) = change;
  }
  found.second_energy = found.second_metric - second.transpose() * g * answer;
  found.second_energy = 0.5 * (found.second_energy + found.second_energy.transpose().eval());
  return found;
}

CondensedSample CondensedSampler::sample_at(const Eigen::Vector3d& u_m) {
  if ((u_m - relaxed_.contact).norm() < (u_m - latest_.contact).norm()) {
    latest_ = relaxed_;
    find_moves(latest_, viscous_state_);
  }
  move(latest_, u_m, viscous_state_);
  CondensedSample sample;
  sample.u_m = u_m;
  sample.w_m = relaxed_.contact;
  // All branches alike.
  sample.energy_J = bonds_.stored_energy_J(
      latest_.position, viscous_state_.offset.replicate(1, bonds_.most_branches()));
  Eigen::Matrix3Xd force = no_load_;
  bonds_.add_forces(latest_.position, viscous_state_, force);
  sample.by_u_N = -force.col(contact_);
  const auto weighted = viscous_moves_.transpose() * bonds_.relaxing().asDiagonal();
  sample.by_w_N = weighted * (viscous_state_.offset - elongations(latest_));
  sample.by_uu = 0.5 * (latest_.stiffness + latest_.stiffness.transpose());
  sample.by_wu = -(weighted * elongation_moves(latest_));
  sample.position_m = latest_.position;
  sample.moves = latest_.moves;
  return sample;
}

}  // namespace tpm::contact
