#include "tpm/contact/condensed/condensed_branches.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/contact/condensed/condensed_phi.hpp"

namespace tpm::contact {
namespace {

using Eigen::Index;

/// Motion of a mode of rate lambda within a step. With D = diag(tau_j) its branches follow
///
///     d xi/dt = -B xi,   B = D^-1 (1 + (lambda - 1) 1 gamma')
///
/// which is similar to the symmetric D^-1 + (lambda - 1) p p', p_j = sqrt(gamma_j/tau_j), by
/// diag(sqrt(gamma_j tau_j)).
class BranchMode {
 public:
  BranchMode(double lambda, const std::vector<CondensedBranch>& branches, double period_s)
      : scale_(static_cast<Index>(branches.size())) {
    const Index n = scale_.size();
    Eigen::VectorXd p(n);
    Eigen::VectorXd rate(n);
    for (Index j = 0; j < n; ++j) {
      const CondensedBranch& branch = branches[static_cast<std::size_t>(j)];
      rate[j] = period_s / branch.relaxation_time_s;
      p[j] = std::sqrt(branch.share * rate[j]);
      scale_[j] = std::sqrt(branch.share / rate[j]);
    }
    Eigen::MatrixXd symmetric = (lambda - 1.0) * p * p.transpose();
    symmetric.diagonal() += rate;
    modes_ = symmetric_modes(symmetric);
  }

  /// f(h B)
  template <class Function>
  [[nodiscard]] Eigen::MatrixXd of(Function&& f) const {
    Eigen::VectorXd values = modes_.values;
    for (double& value : values) value = f(std::max(value, 0.0));
    return scale_.cwiseInverse().asDiagonal() *
           (modes_.vectors * values.asDiagonal() * modes_.vectors.transpose()) *
           scale_.asDiagonal();
  }

 private:
  Eigen::VectorXd scale_;
  SymmetricModes modes_;
};

}  // namespace

CondensedModes condensed_modes(const CondensedFit& fit) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  // A mode that hardly exists is kept from dividing by zero.
  const Eigen::Matrix3d ridge = 1e-9 * fit.mean_metric.trace() * Eigen::Matrix3d::Identity();
  Matrix6 metric = Matrix6::Zero();
  metric.topLeftCorner<3, 3>() = fit.mean_metric;
  metric.bottomRightCorner<3, 3>() = fit.mean_coupling + ridge;
  Matrix6 energy;
  energy << fit.mean_energy, fit.mean_coupling, fit.mean_coupling, fit.mean_second + ridge;
  const SymmetricModes modes = symmetric_modes(energy, metric);
  return {modes.values, modes.vectors.transpose() * metric, modes.vectors};
}

CondensedBranches::CondensedBranches(const CondensedFit& fit,
                                     const std::vector<CondensedBranch>& branches, double period_s)
    : tables_(&fit.tables), modes_(condensed_modes(fit)), second_metric_(fit.mean_coupling) {
  const auto n = static_cast<Index>(branches.size());
  share_.resize(n);
  for (Index j = 0; j < n; ++j) share_[j] = branches[static_cast<std::size_t>(j)].share;
  const SymmetricModes of_w = symmetric_modes(fit.mean_energy, fit.mean_metric);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(n);
  const auto decay = [](double y) { return -std::expm1(-y); };
  // Of a linear tissue that moves straight the mean viscous state ends where it should
  // (condensed.cpp).
  const BranchMode middle(of_w.values.mean(), branches, period_s);
  relaxation_point_ =
      (1.0 - share_.dot(middle.of(first_phi) * one)) / share_.dot(middle.of(decay) * one);

  follow_.resize(6, n * n);
  drift_.resize(6, n);
  later_.setZero(6, n);
  pending_ = spread_ = lacks_ = moved_ = next_ = Columns::Zero(6, n);
  for (Index k = 0; k < 6; ++k) {
    const BranchMode mode(modes_.rate[k], branches, period_s);
    const Eigen::MatrixXd first = mode.of(first_phi);
    const Eigen::MatrixXd after = mode.of(second_phi);
    drift_.row(k) = one - relaxation_point_ * (mode.of(decay) * one) - first * one;
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i < n; ++i) {
        const double steps = period_s / branches[static_cast<std::size_t>(i)].relaxation_time_s;
        follow_(k, j * n + i) = first(j, i) * steps;
        later_(k, j) += after(j, i) * steps;
      }
    }
  }
  reset();
}

void CondensedBranches::set_frame(const CondensedMatricesAt& matrices) noexcept {
  const Eigen::LLT<Eigen::Matrix3d> factor(matrices.mobility);
  if (factor.info() == Eigen::Success) frame_ = factor.matrixL();
}

void CondensedBranches::reset() noexcept {
  spread_.setZero();
  pending_.setZero();
  spread_J_ = 0.0;
  set_frame(CondensedState(*tables_).matrices);
}

Eigen::Vector3d CondensedBranches::second_m(const CondensedState& state) const noexcept {
  Eigen::Vector3d sum = state.viscous.tail<3>().cwiseAbs2();
  for (Index j = 0; j < share_.size(); ++j) {
    sum += share_[j] * spread_.col(j).tail<3>().cwiseAbs2();
  }
  return sum.cwiseSqrt();
}

void CondensedBranches::step(CondensedState& state, const Eigen::Vector3d& to) noexcept {
  const Index n = share_.size();
  const Eigen::Vector3d way = to - state.u;
  const Eigen::Vector3d midway = state.u + relaxation_point_ * way;
  const CondensedPull before = condensed_pull(*tables_, midway, state.viscous, state.matrices);
  // In modes: what each branch lacks is the motion of the mean less what the branch is ahead.
  const CondensedVector speed = modes_.left * before.velocity;
  const CondensedVector drift = modes_.left.leftCols<3>() * way;
  for (Index i = 0; i < n; ++i) {
    CondensedVector ahead = spread_.col(i);
    ahead.head<3>() = frame_ * spread_.col(i).head<3>();
    lacks_.col(i) = speed - modes_.left * ahead;
  }
  CondensedVector mean = CondensedVector::Zero();
  for (Index j = 0; j < n; ++j) {
    CondensedVector moved = pending_.col(j) + drift.cwiseProduct(drift_.col(j));
    for (Index i = 0; i < n; ++i) moved += follow_.col(j * n + i).cwiseProduct(lacks_.col(i));
    moved_.col(j) = moved;
    mean += share_[j] * moved;
  }
  double spread_J = 0.0;
  for (Index j = 0; j < n; ++j) {
    CondensedVector ahead = modes_.right * (moved_.col(j) - mean);
    frame_.triangularView<Eigen::Lower>().solveInPlace(ahead.head<3>());
    ahead += spread_.col(j);
    next_.col(j) = ahead;
    const Eigen::Vector3d p = ahead.tail<3>();
    spread_J += 0.5 * share_[j] * (ahead.head<3>().squaredNorm() + p.dot(second_metric_ * p));
  }
  const CondensedVector next = state.viscous + modes_.right * mean;

  const CondensedMatricesAt matrices = condensed_matrices_at(*tables_, next.head<3>());
  const CondensedPull after = condensed_pull(*tables_, midway, next, matrices);
  state.kept = !(after.energy_J + spread_J <= before.energy_J + spread_J_);
  if (state.kept) {
    pending_.setZero();
  } else {
    // The contribution of the rates' change within the step is added to the next step; the branches
    // have it in common.
    const CondensedVector change =
        modes_.left * after.velocity - speed + modes_.rate.cwiseProduct(mean);
    pending_ = later_.array().colwise() * change.array();
    state.viscous = next;
    state.matrices = matrices;
    spread_.swap(next_);
    spread_J_ = spread_J;
    set_frame(matrices);  // beyond the range the one before serves
  }
  state.u = to;
  state.force_N = condensed_pull(*tables_, to, state.viscous, state.matrices).force_N;
}

}  // namespace tpm::contact
