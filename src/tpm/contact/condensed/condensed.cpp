#include "tpm/contact/condensed/condensed.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/contact/condensed/condensed_fit.hpp"
#include "tpm/contact/condensed/condensed_lag.hpp"
#include "tpm/contact/condensed/condensed_phi.hpp"
#include "tpmkit/error.hpp"

namespace tpm::contact {
namespace {

/// std::hypot guards against numbers that no place in an organ has, and takes tens of nanoseconds.
double across(double y, double z) {
  return std::sqrt(y * y + z * z);
}

/// The share of the second mode's force, were it coupled as strongly everywhere as where it is
/// strongest, that further modes and its own nonlinearity are taken to make.
constexpr double kSecondModeError = 0.35;
/// Misfits grow aside: their share of the largest along the normal, to which the square of the way
/// aside (of u or w, over the range) adds.
constexpr double kMisfitAlong = 0.3;

/// 1/(1 - exp(-y)) - 1/y: where a straight motion must rest for the exact end value.
double rest_share(double y) {
  return second_phi(y) / first_phi(y);
}

using Matrix6 = Eigen::Matrix<double, 6, 6>;

double positive(double value, std::string_view name) {
  if (value > 0.0 && std::isfinite(value)) return value;
  throw Error(ExitCode::bad_input, "condensed model",
              fmt::format("the {} is {} s; expected a number above 0", name, value));
}

}  // namespace

CondensedContact::CondensedContact(std::shared_ptr<const CondensedFit> fit,
                                   std::vector<CondensedBranch> branches, double period_s)
    : fit_(std::move(fit)),
      branches_(std::move(branches)),
      period_s_(positive(period_s, "period")),
      state_(fit_->tables) {
  double whole = 0.0;
  for (const CondensedBranch& branch : branches_) {
    (void)positive(branch.relaxation_time_s, "relaxation time");
    whole += branch.share;
    if (!(branch.share > 0.0) || !std::isfinite(whole)) {
      throw Error(
          ExitCode::bad_input, "condensed model",
          fmt::format("the share of a branch is {}; expected a number above 0", branch.share));
    }
  }
  if (branches_.empty()) {
    throw Error(ExitCode::bad_input, "condensed model", "nothing relaxes; expected a branch");
  }
  for (CondensedBranch& branch : branches_) branch.share /= whole;
  if (several()) {
    of_branches_.emplace(*fit_, branches_, period_s_);
  } else {
    set_rates(branches_.front().relaxation_time_s);
  }
}

CondensedContact CondensedContact::with_relaxation_time(double relaxation_time_s) const {
  return with_branches({{1.0, relaxation_time_s}});
}

CondensedContact CondensedContact::with_branches(std::vector<CondensedBranch> branches) const {
  return {fit_, std::move(branches), period_s_};
}

CondensedContact CondensedContact::with_period(double period_s) const {
  return {fit_, branches_, period_s};
}

void CondensedContact::set_rates(double relaxation_time_s) {
  const double x = period_s_ / relaxation_time_s;
  const CondensedModes modes = condensed_modes(*fit_);
  const auto of_rate = [&](const auto& f) {
    CondensedVector values = modes.rate * x;
    for (double& y : values) y = f(y);
    return Matrix6(modes.right * values.asDiagonal() * modes.left);
  };
  rates_.rate = modes.rates();
  rates_.first = of_rate([&](double y) { return x * first_phi(y); });
  rates_.second = of_rate([&](double y) { return x * second_phi(y); });
  const SymmetricModes of_w = symmetric_modes(fit_->mean_energy, fit_->mean_metric);
  const double share = rest_share(of_w.values.mean() * x);
  // Of a linear tissue that moves straight, resting for that share of the way leaves this out: with
  // r = exp(-y) the state relative to the contact ends at phi1, not at 1 + (r - 1) share, per step
  // of the contact.
  rates_.drift =
      of_rate([&](double y) { return 1.0 + std::expm1(-y) * share - first_phi(y); }).leftCols<3>();
  rates_.relaxation_point = share;
}

void CondensedContact::reset() noexcept {
  state_ = CondensedState(fit_->tables);
  if (several()) of_branches_->reset();
  kept_ = 0;
}

CondensedViscousState CondensedContact::viscous_state() const noexcept {
  return {state_.viscous.head<3>(), state_.viscous.tail<3>(),
          several() ? of_branches_->spread_J() : 0.0};
}

double CondensedContact::stored_energy_J(const Eigen::Vector3d& displacement_m,
                                         const CondensedViscousState& viscous) const noexcept {
  return pull_of(displacement_m, viscous).energy_J + viscous.spread_J;
}

Eigen::Vector3d CondensedContact::force_N(const Eigen::Vector3d& displacement_m,
                                          const CondensedViscousState& viscous) const noexcept {
  return fit_->frame.axes * pull_of(displacement_m, viscous).force_N;
}

CondensedPull CondensedContact::pull_of(const Eigen::Vector3d& displacement_m,
                                        const CondensedViscousState& viscous) const noexcept {
  CondensedVector state;
  state << viscous.w_m, viscous.q_m;
  return condensed_pull(fit_->tables, fit_->frame.local(displacement_m), state,
                        condensed_matrices_at(fit_->tables, viscous.w_m));
}

ContactAnswer CondensedContact::step(const ToolPose& tool) noexcept {
  const Eigen::Vector3d u = fit_->frame.local(tool.displacement_m);
  if (several()) {
    of_branches_->step(state_, u);
  } else {
    step_condensed(fit_->tables, rates_, state_, u);
  }
  kept_ += state_.kept ? 1 : 0;
  ContactAnswer answer;
  answer.force_N = fit_->frame.axes * state_.force_N;
  const Eigen::Vector3d q =
      several() ? of_branches_->second_m(state_) : Eigen::Vector3d(state_.viscous.tail<3>());
  const double place_aside_m = across(u[1], u[2]);
  const double aside_m = std::max(place_aside_m, across(state_.viscous[1], state_.viscous[2]));
  const double aside = aside_m / fit_->frame.tangential_m;
  answer.error_N = (kMisfitAlong + aside * aside) * fit_->fit_error_N +
                   kSecondModeError * (fit_->coupling_along * std::abs(q[0]) +
                                       fit_->coupling_across * across(q[1], q[2])) +
                   fit_->lag_error_N *
                       condensed_lag(u, state_.viscous.head<3>(), 2.0 * fit_->frame.half_depth_m);
  answer.valid = u[0] >= fit_->least_depth_m && u[0] <= fit_->most_depth_m &&
                 place_aside_m <= fit_->most_tangential_m;
  return answer;
}

Eigen::Matrix3d CondensedContact::instantaneous_stiffness() const noexcept {
  return fit_->instantaneous;
}

Eigen::Matrix3d CondensedContact::equilibrium_stiffness() const noexcept {
  return fit_->equilibrium;
}

Eigen::Index CondensedContact::spheres() const noexcept {
  return fit_->field.spheres();
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void CondensedContact::displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  fit_->field.displacements(state_.u, state_.viscous.head<3>(), state_.viscous.tail<3>(), all);
  all.col(fit_->contact) = fit_->frame.axes * state_.u;
}

}  // namespace tpm::contact
