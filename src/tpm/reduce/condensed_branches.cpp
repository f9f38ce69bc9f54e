#include "tpm/reduce/condensed_branches.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/core/dense_algebra.hpp"
#include "tpm/reduce/condensed_phi.hpp"

namespace tpm::organ {
namespace {

using Eigen::Index;

/// What a mode of rate lambda does within a step. With D = diag(tau_j) its branches follow
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

/// The Cholesky factor C (00, 10, 11, 20, 21, 22) of a symmetric matrix (00, 11, 22, 01, 02, 12);
/// false where it has none.
bool factor_of(const double* m, std::array<double, 6>& c) {
  if (!(m[0] > 0.0)) return false;
  const double c00 = std::sqrt(m[0]);
  const double c10 = m[3] / c00;
  const double c20 = m[4] / c00;
  const double b = m[1] - c10 * c10;
  if (!(b > 0.0)) return false;
  const double c11 = std::sqrt(b);
  const double c21 = (m[5] - c20 * c10) / c11;
  const double d = m[2] - c20 * c20 - c21 * c21;
  if (!(d > 0.0)) return false;
  c = {c00, c10, c11, c20, c21, std::sqrt(d)};
  return true;
}

constexpr std::size_t kWide = 8;  // numbers of a vector, 3 and a 0 twice
std::size_t packed(Index i) {
  return static_cast<std::size_t>(i < 3 ? i : i + 1);
}

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
    : tables_(&fit.tables) {
  const auto n = static_cast<Index>(branches.size());
  Eigen::VectorXd share(n);
  for (Index j = 0; j < n; ++j) share[j] = branches[static_cast<std::size_t>(j)].share;
  share_.assign(share.begin(), share.end());
  const CondensedModes modes = condensed_modes(fit);
  for (Index k = 0; k < 6; ++k) {
    mode_rate_[packed(k)] = modes.rate[k];
    for (Index i = 0; i < 6; ++i) {
      modes_.left[k][packed(i)] = modes.left(i, k);
      modes_.right[k][packed(i)] = modes.right(i, k);
    }
  }
  const Eigen::Matrix3d& second = fit.mean_coupling;
  const std::array<double, 6> metric{second(0, 0), second(1, 1), second(2, 2),
                                     second(0, 1), second(0, 2), second(1, 2)};
  std::copy(metric.begin(), metric.end(), modes_.second_metric);
  const Eigen::Matrix<double, 6, 6> rate = modes.right * modes.rate.asDiagonal() * modes.left;
  for (Index k = 0; k < 3; ++k) {
    for (Index i = 0; i < 3; ++i) rates_.of_second[k][i] = rate(3 + i, 3 + k);
  }
  const SymmetricModes of_w = symmetric_modes(fit.mean_energy, fit.mean_metric);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(n);
  const auto decay = [](double y) { return -std::expm1(-y); };
  // Of a linear tissue that moves straight the mean viscous state ends where it should
  // (condensed.cpp).
  const BranchMode middle(of_w.values.mean(), branches, period_s);
  relaxation_point_ =
      (1.0 - share.dot(middle.of(first_phi) * one)) / share.dot(middle.of(decay) * one);

  const auto size = kWide * branches.size();
  follow_.assign(size * branches.size(), 0.0);
  for (std::vector<double>* all :
       {&drift_, &later_, &spread_, &pending_, &lacks_, &moved_, &next_}) {
    all->assign(size, 0.0);
  }
  for (Index k = 0; k < 6; ++k) {
    const BranchMode mode(modes.rate[k], branches, period_s);
    const Eigen::MatrixXd first = mode.of(first_phi);
    const Eigen::MatrixXd after = mode.of(second_phi);
    const Eigen::VectorXd left_out = one - relaxation_point_ * (mode.of(decay) * one) - first * one;
    for (Index j = 0; j < n; ++j) {
      const std::size_t at = kWide * static_cast<std::size_t>(j) + packed(k);
      drift_[at] = left_out[j];
      for (Index i = 0; i < n; ++i) {
        const double steps = period_s / branches[static_cast<std::size_t>(i)].relaxation_time_s;
        follow_[kWide * static_cast<std::size_t>(j * n + i) + packed(k)] = first(j, i) * steps;
        later_[at] += after(j, i) * steps;
      }
    }
  }
  reset();
}

void CondensedBranches::reset() noexcept {
  std::fill(spread_.begin(), spread_.end(), 0.0);
  std::fill(pending_.begin(), pending_.end(), 0.0);
  spread_J_ = 0.0;
  CondensedState rest;
  settle_condensed(*tables_, rest);
  (void)factor_of(rest.matrices, frame_);
}

Eigen::Vector3d CondensedBranches::second_m(const CondensedState& state) const noexcept {
  const Eigen::Vector3d mean = Eigen::Vector3d::Map(&state.viscous[4]);
  Eigen::Vector3d sum = mean.cwiseAbs2();
  for (std::size_t j = 0; j < share_.size(); ++j) {
    sum += share_[j] * Eigen::Vector3d::Map(&spread_[kWide * j + 4]).cwiseAbs2();
  }
  return sum.cwiseSqrt();
}

void CondensedBranches::step(CondensedState& state, const double* to) noexcept {
  std::array<double, 3> way{};
  std::array<double, 3> midway{};
  for (std::size_t k = 0; k < 3; ++k) {
    way[k] = to[k] - state.u[k];
    midway[k] = state.u[k] + relaxation_point_ * way[k];
  }
  CondensedPull pull;
  pull_condensed(*tables_, rates_, midway.data(), state.viscous, state.matrices, pull);
  const double before_J = pull.energy_J + spread_J_;
  CondensedAdvance advance;
  advance_condensed(modes_,
                    {static_cast<int>(share_.size()), share_.data(), follow_.data(), drift_.data(),
                     pending_.data(), spread_.data(), lacks_.data(), moved_.data(), next_.data()},
                    pull.velocity, way.data(), frame_.data(), advance);
  alignas(32) std::array<double, kWide> next;
  for (std::size_t k = 0; k < kWide; ++k) next[k] = state.viscous[k] + advance.change[k];

  alignas(32) std::array<double, CondensedTables::kMatrixEntries> matrices;
  matrices_of_condensed(*tables_, next.data(), matrices.data());
  pull_condensed(*tables_, rates_, midway.data(), next.data(), matrices.data(), pull);
  state.kept = !(pull.energy_J + advance.spread_J <= before_J);
  if (state.kept) {
    std::fill(pending_.begin(), pending_.end(), 0.0);
  } else {
    // What the change of the rates within the step would have added is added to the next; the
    // branches have it in common.
    std::array<double, kWide> change{};
    for (std::size_t k = 0; k < kWide; ++k) {
      change[k] = mode_rate_[k] * advance.mean[k] - advance.speed[k];
      for (std::size_t i = 0; i < 6; ++i) {
        change[k] += modes_.left[i][k] * pull.velocity[packed(static_cast<Index>(i))];
      }
    }
    for (std::size_t j = 0; j < share_.size(); ++j) {
      for (std::size_t k = 0; k < kWide; ++k) {
        pending_[kWide * j + k] = later_[kWide * j + k] * change[k];
      }
    }
    std::copy(next.begin(), next.end(), state.viscous);
    std::copy(matrices.begin(), matrices.end(), state.matrices);
    spread_.swap(next_);
    spread_J_ = advance.spread_J;
    (void)factor_of(state.matrices, frame_);  // beyond the range the one before serves
  }
  std::copy(to, to + 3, state.u);
  pull_condensed(*tables_, rates_, to, state.viscous, state.matrices, pull);
  std::copy(pull.force, pull.force + 3, state.force);
}

}  // namespace tpm::organ
