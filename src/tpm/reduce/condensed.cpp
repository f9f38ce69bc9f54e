#include "tpm/reduce/condensed.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "tpm/core/error.hpp"
#include "tpm/reduce/condensed_fit.hpp"

namespace tpm {
namespace {

/// (1 - exp(-y))/y, and the next one: (1 - that)/y.
double first_phi(double y) {
  return y == 0.0 ? 1.0 : -std::expm1(-y) / y;
}
double second_phi(double y) {
  if (y > 0.05) return (1.0 - first_phi(y)) / y;
  return 0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0 - y / 720.0)));
}
/// 1/(1 - exp(-y)) - 1/y: where a straight motion must rest for the exact end value.
double rest_share(double y) {
  return second_phi(y) / first_phi(y);
}

double positive(double value, std::string_view name) {
  if (value > 0.0 && std::isfinite(value)) return value;
  throw Error(ExitCode::bad_input, "condensed model",
              fmt::format("the {} is {} s; expected a number above 0", name, value));
}

}  // namespace

CondensedContact::CondensedContact(std::shared_ptr<const CondensedFit> fit,
                                   double relaxation_time_s, double period_s)
    : fit_(std::move(fit)),
      relaxation_time_s_(positive(relaxation_time_s, "relaxation time")),
      period_s_(positive(period_s, "period")) {
  set_rates();
}

CondensedContact CondensedContact::with_relaxation_time(double relaxation_time_s) const {
  return {fit_, relaxation_time_s, period_s_};
}

CondensedContact CondensedContact::with_period(double period_s) const {
  return {fit_, relaxation_time_s_, period_s};
}

void CondensedContact::set_rates() {
  const double x = period_s_ / relaxation_time_s_;
  // A mode that hardly exists is kept from dividing by zero.
  const Eigen::Matrix3d grain = 1e-9 * fit_->mean_metric.trace() * Eigen::Matrix3d::Identity();
  Matrix6 metric = Matrix6::Zero();
  metric.topLeftCorner<3, 3>() = fit_->mean_metric;
  metric.bottomRightCorner<3, 3>() = fit_->mean_coupling + grain;
  Matrix6 energy;
  energy << fit_->mean_energy, fit_->mean_coupling, fit_->mean_coupling, fit_->mean_second + grain;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> modes(energy, metric);
  const Matrix6 right = modes.eigenvectors();
  const Matrix6 left = right.transpose() * metric;
  const auto of_rate = [&](const auto& f) {
    State values;
    for (Eigen::Index k = 0; k < 6; ++k) values[k] = f(modes.eigenvalues()[k] * x);
    return Matrix6(right * values.asDiagonal() * left);
  };
  rate_ = of_rate([&](double y) { return y / x; });
  first_ = of_rate([&](double y) { return x * first_phi(y); });
  second_ = of_rate([&](double y) { return x * second_phi(y); });
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> of_w(fit_->mean_energy,
                                                                       fit_->mean_metric);
  resting_share_ = rest_share(of_w.eigenvalues().mean() * x);
  // Of a linear tissue that moves straight, resting_share_ leaves this out: with r = exp(-y) the
  // state relative to the contact ends at phi1, not at 1 + (r - 1) share, per step of the contact.
  const Matrix6 left_out =
      of_rate([&](double y) { return 1.0 + std::expm1(-y) * resting_share_ - first_phi(y); });
  drift_ = left_out.leftCols<3>();
}

void CondensedContact::reset() noexcept {
  u_.setZero();
  memory_ = {};
  kept_ = 0;
}

double CondensedContact::stored_energy_J(const Eigen::Vector3d& displacement_m,
                                         const CondensedMemory& memory) const noexcept {
  const Eigen::Vector3d u = fit_->frame.local(displacement_m);
  const auto m = fit_->matrices.at(memory.w_m);
  return fit_->potential.gradient(u, memory.w_m).value_J -
         (u - memory.w_m).dot(m.coupling * memory.q_m) +
         0.5 * memory.q_m.dot(m.second * memory.q_m);
}

Eigen::Vector3d CondensedContact::force_N(const Eigen::Vector3d& displacement_m,
                                          const CondensedMemory& memory) const noexcept {
  const Eigen::Vector3d u = fit_->frame.local(displacement_m);
  const auto m = fit_->matrices.at(memory.w_m);
  return fit_->frame.axes *
         (m.coupling * memory.q_m - fit_->potential.gradient(u, memory.w_m).by_u_N);
}

ContactAnswer CondensedContact::step(const Eigen::Vector3d& displacement_m) noexcept {
  const Eigen::Vector3d u = fit_->frame.local(displacement_m);
  const Eigen::Vector3d moved = u - u_;
  const Eigen::Vector3d resting = u_ + resting_share_ * moved;
  const Eigen::Matrix3d of_second = rate_.bottomRightCorner<3, 3>();
  const auto velocity = [&](const State& s) {
    const auto m = fit_->matrices.at(s.head<3>());
    State v;
    v.head<3>() = -m.mobility * (fit_->potential.gradient(resting, s.head<3>()).by_w_N +
                                 m.coupling * s.tail<3>());
    v.tail<3>() = resting - s.head<3>() - of_second * s.tail<3>();
    return v;
  };
  State before;
  before << memory_.w_m, memory_.q_m;
  const State v0 = velocity(before);
  const State ahead = before + first_ * v0;
  const State v1 = velocity(ahead);
  const State after = ahead + second_ * (v1 - v0 + rate_ * (ahead - before)) + drift_ * moved;
  const CondensedMemory next{after.head<3>(), after.tail<3>()};
  const Eigen::Vector3d at = fit_->frame.axes * resting;
  if (stored_energy_J(at, next) <= stored_energy_J(at, memory_)) {
    memory_ = next;
  } else {
    ++kept_;
  }
  u_ = u;
  ContactAnswer answer;
  answer.force_N = force_N(displacement_m, memory_);
  return answer;
}

Eigen::Matrix3d CondensedContact::instantaneous_stiffness() const noexcept {
  return fit_->instantaneous;
}

Eigen::Matrix3d CondensedContact::relaxed_stiffness() const noexcept {
  return fit_->relaxed;
}

Eigen::Index CondensedContact::spheres() const noexcept {
  return 0;
}

void CondensedContact::displacements(Eigen::Ref<Eigen::Matrix3Xd> all) const noexcept {
  all.setZero();
}

}  // namespace tpm
