#include "tpm/contact/condensed/condensed_potential.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace tpm::contact {
namespace {

constexpr double kEnergyLength_m = 2e-3;  // an error of energy counts as one of force over it
constexpr double kSlopeLength_m = 1e-3;   // an error of stiffness counts as one of force over it
constexpr double kRestWeight = 30.0;      // of what holds at rest

/// Rows of a least-squares problem, gathered into its normal equations.
class NormalEquations {
 public:
  explicit NormalEquations(Eigen::Index unknowns)
      : unknowns_(unknowns),
        matrix_(Eigen::MatrixXd::Zero(unknowns, unknowns)),
        right_(Eigen::VectorXd::Zero(unknowns)),
        rows_(kBatch, unknowns),
        values_(kBatch) {}

  template <class Row>
  void add(double weight, double value, const Row& row) {
    for (Eigen::Index k = 0; k < unknowns_; ++k) rows_(filled_, k) = weight * row(k);
    values_[filled_] = weight * value;
    if (++filled_ == kBatch) gather();
  }

  [[nodiscard]] Eigen::VectorXd solve() {
    gather();
    matrix_.diagonal().array() += 1e-13 * matrix_.diagonal().maxCoeff();
    return matrix_.selfadjointView<Eigen::Lower>().ldlt().solve(right_);
  }

 private:
  static constexpr Eigen::Index kBatch = 256;
  void gather() {
    const auto rows = rows_.topRows(filled_);
    matrix_.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
    right_.noalias() += rows.transpose() * values_.head(filled_);
    filled_ = 0;
  }

  Eigen::Index unknowns_;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
  Eigen::MatrixXd rows_;
  Eigen::VectorXd values_;
  Eigen::Index filled_ = 0;
};

}  // namespace

CondensedPotential::CondensedPotential(const CondensedFrame& frame,
                                       std::span<const CondensedSample> samples)
    : frame_(frame), monomials_(condensed_monomials(kCondensedDegrees)) {
  const auto& monomials = monomials_;
  NormalEquations equations(static_cast<Eigen::Index>(monomials.size()));
  for (const CondensedSample& sample : samples) {
    const Eigen::Vector3d u = frame.local(sample.u_m);
    const Eigen::Vector3d w = frame.local(sample.w_m);
    const CondensedPowers powers(frame, u, w);
    const double weight = u.isZero() && w.isZero() ? kRestWeight : 1.0;
    const auto add = [&](double share, double value, int by, int again) {
      const double scale =
          (by < 0 ? 1.0 : frame.scale_m(by)) * (again < 0 ? 1.0 : frame.scale_m(again));
      equations.add(weight * share / scale, value * scale, [&](Eigen::Index k) {
        return powers.monomial(monomials[static_cast<std::size_t>(k)], by, again);
      });
    };
    add(1.0 / kEnergyLength_m, sample.energy_J, -1, -1);
    const Eigen::Vector3d by_u = frame.local(sample.by_u_N);
    const Eigen::Vector3d by_w = frame.local(sample.by_w_N);
    const Eigen::Matrix3d by_uu = frame.axes.transpose() * sample.by_uu * frame.axes;
    const Eigen::Matrix3d by_wu = frame.axes.transpose() * sample.by_wu * frame.axes;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      add(1.0, by_u[row], kCondensedOfU[i], -1);
      add(1.0, by_w[row], kCondensedOfW[i], -1);
      for (std::size_t j = 0; j < 3; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        if (j <= i) add(kSlopeLength_m, by_uu(row, column), kCondensedOfU[i], kCondensedOfU[j]);
        add(kSlopeLength_m, by_wu(row, column), kCondensedOfW[i], kCondensedOfU[j]);
      }
    }
  }
  const Eigen::VectorXd found = equations.solve();
  coefficients_.assign(found.begin(), found.end());
  // The constant and the linear terms take up the residual of the fit at rest.
  const Gradient rest = gradient(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    const CondensedExponents& e = monomials[m];
    int degree = 0;
    std::size_t which = 0;
    for (std::size_t c = 0; c < e.size(); ++c) {
      degree += e[c];
      if (e[c] != 0) which = c;
    }
    if (degree != 1) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double scale = frame.scale_m(static_cast<int>(which));
      if (static_cast<std::size_t>(kCondensedOfU[i]) == which)
        coefficients_[m] -= rest.by_u_N[row] * scale;
      if (static_cast<std::size_t>(kCondensedOfW[i]) == which)
        coefficients_[m] -= rest.by_w_N[row] * scale;
    }
  }
  coefficients_[0] -= gradient(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()).value_J;
  for (const CondensedSample& sample : samples) {
    const Gradient there = gradient(frame.local(sample.u_m), frame.local(sample.w_m));
    worst_N_ = std::max(worst_N_, (there.by_u_N - frame.local(sample.by_u_N)).norm());
  }
}

CondensedPotential::Gradient CondensedPotential::gradient(const Eigen::Vector3d& u_m,
                                                          const Eigen::Vector3d& w_m) const {
  const auto& monomials = monomials_;
  const CondensedPowers powers(frame_, u_m, w_m);
  Gradient result;
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    result.value_J += coefficients_[m] * powers.monomial(monomials[m]);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      result.by_u_N[row] += coefficients_[m] * powers.monomial(monomials[m], kCondensedOfU[i]) /
                            frame_.scale_m(kCondensedOfU[i]);
      result.by_w_N[row] += coefficients_[m] * powers.monomial(monomials[m], kCondensedOfW[i]) /
                            frame_.scale_m(kCondensedOfW[i]);
    }
  }
  return result;
}

}  // namespace tpm::contact
