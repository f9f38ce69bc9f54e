#include "tpm/reduce/condensed_potential.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace tpm {
namespace {

constexpr double kEnergyLength_m = 2e-3;  // an error of energy counts as one of force over it
constexpr double kSlopeLength_m = 1e-3;   // an error of stiffness counts as one of force over it
constexpr double kRestWeight = 30.0;      // of what holds at rest

constexpr int kCoordinates = 6;
constexpr std::array<int, 3> kOfU{0, 2, 3};
constexpr std::array<int, 3> kOfW{1, 4, 5};

/// Powers of six coordinates.
struct Powers {
  std::array<std::array<double, 8>, kCoordinates> of{};

  explicit Powers(const Eigen::Matrix<double, kCoordinates, 1>& x) {
    for (std::size_t c = 0; c < kCoordinates; ++c) {
      of[c][0] = 1.0;
      for (std::size_t n = 1; n < 8; ++n) of[c][n] = of[c][n - 1] * x[static_cast<int>(c)];
    }
  }

  /// A monomial differentiated by up to two coordinates (-1: by none).
  [[nodiscard]] double monomial(CondensedExponents e, int by = -1, int again = -1) const {
    double factor = 1.0;
    for (const int c : {by, again}) {
      if (c < 0) continue;
      int& power = e[static_cast<std::size_t>(c)];
      if (power == 0) return 0.0;
      factor *= power--;
    }
    for (std::size_t c = 0; c < kCoordinates; ++c) factor *= of[c][static_cast<std::size_t>(e[c])];
    return factor;
  }
};

Eigen::Matrix<double, kCoordinates, 1> scaled(const CondensedFrame& frame, const Eigen::Vector3d& u,
                                              const Eigen::Vector3d& w) {
  Eigen::Matrix<double, kCoordinates, 1> x;
  x << (u[0] - frame.middle_depth_m) / frame.half_depth_m,
      (w[0] - frame.middle_depth_m) / frame.half_depth_m, u[1] / frame.tangential_m,
      u[2] / frame.tangential_m, w[1] / frame.tangential_m, w[2] / frame.tangential_m;
  return x;
}

double scale_of(const CondensedFrame& frame, int coordinate) {
  return coordinate < 2 ? frame.half_depth_m : frame.tangential_m;
}

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

std::vector<CondensedExponents> condensed_monomials() {
  std::vector<CondensedExponents> all;
  for (int b = 0; b < static_cast<int>(kCondensedDegrees.size()); ++b) {
    for (int i = b; i >= 0; --i) {
      for (int j = b - i; j >= 0; --j) {
        for (int k = b - i - j; k >= 0; --k) {
          const int highest = kCondensedDegrees[static_cast<std::size_t>(b)];
          for (int a = 0; a <= highest; ++a) {
            for (int n = 0; n <= a; ++n) all.push_back({a - n, n, i, j, k, b - i - j - k});
          }
        }
      }
    }
  }
  return all;
}

CondensedPotential::CondensedPotential(const CondensedFrame& frame,
                                       std::span<const CondensedSample> samples)
    : frame_(frame) {
  const auto monomials = condensed_monomials();
  NormalEquations equations(static_cast<Eigen::Index>(monomials.size()));
  for (const CondensedSample& sample : samples) {
    const Eigen::Vector3d u = frame.local(sample.u_m);
    const Eigen::Vector3d w = frame.local(sample.w_m);
    const Powers powers(scaled(frame, u, w));
    const double weight = u.isZero() && w.isZero() ? kRestWeight : 1.0;
    const auto add = [&](double share, double value, int by, int again) {
      const double scale =
          (by < 0 ? 1.0 : scale_of(frame, by)) * (again < 0 ? 1.0 : scale_of(frame, again));
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
      add(1.0, by_u[row], kOfU[i], -1);
      add(1.0, by_w[row], kOfW[i], -1);
      for (std::size_t j = 0; j < 3; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        if (j <= i) add(kSlopeLength_m, by_uu(row, column), kOfU[i], kOfU[j]);
        add(kSlopeLength_m, by_wu(row, column), kOfW[i], kOfU[j]);
      }
    }
  }
  const Eigen::VectorXd found = equations.solve();
  coefficients_.assign(found.begin(), found.end());
  // What the fit leaves at rest is taken out of the constant and the linear terms.
  const Gradient rest = gradient(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    const CondensedExponents& e = monomials[m];
    int degree = 0;
    std::size_t which = 0;
    for (std::size_t c = 0; c < kCoordinates; ++c) {
      degree += e[c];
      if (e[c] != 0) which = c;
    }
    if (degree != 1) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double scale = scale_of(frame, static_cast<int>(which));
      if (static_cast<std::size_t>(kOfU[i]) == which) coefficients_[m] -= rest.by_u_N[row] * scale;
      if (static_cast<std::size_t>(kOfW[i]) == which) coefficients_[m] -= rest.by_w_N[row] * scale;
    }
  }
  coefficients_[0] -= gradient(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()).value_J;
}

CondensedPotential::Gradient CondensedPotential::gradient(const Eigen::Vector3d& u_m,
                                                          const Eigen::Vector3d& w_m) const {
  static const auto monomials = condensed_monomials();
  const Powers powers(scaled(frame_, u_m, w_m));
  Gradient result;
  for (std::size_t m = 0; m < monomials.size(); ++m) {
    result.value_J += coefficients_[m] * powers.monomial(monomials[m]);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      result.by_u_N[row] +=
          coefficients_[m] * powers.monomial(monomials[m], kOfU[i]) / scale_of(frame_, kOfU[i]);
      result.by_w_N[row] +=
          coefficients_[m] * powers.monomial(monomials[m], kOfW[i]) / scale_of(frame_, kOfW[i]);
    }
  }
  return result;
}

}  // namespace tpm
