#include "tpm/organ/bonds/lowest_mode.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr std::size_t kVectors = 6;  // iterated at once: the lowest converges by its gap to the 7th
constexpr int kMostModeIterations = 500;

/// Subspace iteration for the lowest eigenvalues of K against M.
class InverseIteration {
 public:
  InverseIteration(const BondSystem& bonds, const Positions& rest, const Constraints& constraints,
                   const Eigen::VectorXd& mass, double converged)
      : bonds_(bonds),
        rest_(rest),
        constraints_(constraints),
        converged_(converged),
        factor_(bonds.pattern()) {
    mass_ = mass.transpose().replicate(3, 1).reshaped();
    basis_.resize(mass_.size(), static_cast<Eigen::Index>(std::min(kVectors, constraints.count())));
    Random random(1);
    for (double& x : basis_.reshaped()) x = random.normal();
    for (Eigen::Index j = 0; j < basis_.cols(); ++j) constraints_.project(column(j));
  }

  /// The lowest omega^2 where a share of the relaxing stiffness has relaxed.
  double lowest(const RelaxationFactor& relaxation_factor) {
    const ViscousState viscous_state{
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds_.size())), relaxation_factor};
    BlockMatrix matrix(bonds_.pattern());
    bonds_.add_stiffness(rest_, viscous_state, matrix);
    constraints_.constrain(bonds_, matrix);
    if (!factor_.factorise(matrix) || factor_.negative_count() > 0) {
      throw Error(ExitCode::numerical, "lowest mode", "the stiffness at rest is not positive");
    }
    double last = 0.0;
    for (int i = 0; i < kMostModeIterations; ++i) {
      const double value = iterate();
      if (std::abs(value - last) <= converged_ * value) return value;
      last = value;
    }
    throw Error(ExitCode::numerical, "lowest mode", "inverse iteration does not converge");
  }

  [[nodiscard]] Eigen::Matrix3Xd shape() const {
    return basis_.col(0).reshaped(3, basis_.rows() / 3);
  }

 private:
  Eigen::Map<Eigen::Matrix3Xd> column(Eigen::Index j) {
    return {basis_.col(j).data(), 3, basis_.rows() / 3};
  }

  /// One inverse iteration and Rayleigh-Ritz in what it spans.
  double iterate() {
    const Eigen::MatrixXd pushed = mass_.asDiagonal() * basis_;
    basis_ = pushed;
    for (Eigen::Index j = 0; j < basis_.cols(); ++j) {
      factor_.solve(column(j));
      constraints_.project(column(j));
    }
    // basis = K^-1 pushed, so that basis' K basis = basis' pushed.
    const Eigen::MatrixXd stiffness = basis_.transpose() * pushed;
    const Eigen::MatrixXd mass = basis_.transpose() * mass_.asDiagonal() * basis_;
    const SymmetricModes ritz = symmetric_modes(0.5 * (stiffness + stiffness.transpose()), mass);
    basis_ = (basis_ * ritz.vectors).eval();
    return ritz.values[0];
  }

  const BondSystem& bonds_;
  const Positions& rest_;
  const Constraints& constraints_;
  double converged_;
  BlockLdlt factor_;
  Eigen::VectorXd mass_;   ///< of each coordinate
  Eigen::MatrixXd basis_;  ///< one column a vector, M-orthonormal
};

/// The relaxed share of each law at the square of an angular frequency.
RelaxationFactor relaxed_at(const BondSystem& bonds, double square) {
  std::vector<double> of_law;
  for (const ViscousLaw& law : bonds.laws()) {
    double share = 0.0;
    for (const ViscousLaw::Branch& branch : law.branches) {
      const double tau = branch.relaxation_time_s;
      share += branch.share / (1.0 + square * tau * tau);
    }
    of_law.push_back(share);
  }
  return RelaxationFactor(std::move(of_law));
}

}  // namespace

double LowestMode::angular_frequency() const {
  return 2.0 * std::numbers::pi * frequency_Hz;
}

Eigen::VectorXd sphere_masses_kg(const Organ& organ, double density_kg_per_m3) {
  const double volume = 4.0 / 3.0 * std::numbers::pi * std::pow(organ.radius, 3);
  return Eigen::VectorXd::Constant(organ.position.cols(), density_kg_per_m3 * volume);
}

LowestMode lowest_mode(const BondSystem& bonds, const Positions& rest,
                       const Constraints& constraints, const Eigen::VectorXd& mass_kg,
                       double converged) {
  if (bonds.contact_count() > 0) {
    const BondSystem tissue = bonds.without_tools();
    const auto spheres = static_cast<Eigen::Index>(tissue.spheres());
    LowestMode mode =
        lowest_mode(tissue, rest.leftCols(spheres), constraints.first(tissue.spheres()),
                    mass_kg.head(spheres), converged);
    mode.shape.conservativeResize(Eigen::NoChange, rest.cols());
    mode.shape.rightCols(rest.cols() - spheres).setZero();
    return mode;
  }
  require_rigid(bonds, rest, constraints, "lowest mode");
  if (constraints.count() == 0)
    throw bad_input("lowest mode", "nothing is free", "a free coordinate");
  InverseIteration iteration(bonds, rest, constraints, mass_kg, converged);
  LowestMode mode;
  // From the unrelaxed network downwards: omega falls steadily to its own fixed point.
  double square = iteration.lowest(0.0);
  for (int i = 0; i < kMostModeIterations; ++i) {
    mode.relaxation_factor = relaxed_at(bonds, square);
    const double last = square;
    square = iteration.lowest(mode.relaxation_factor);
    if (std::abs(square - last) > 10.0 * converged * square) continue;
    mode.frequency_Hz = std::sqrt(square) / (2.0 * std::numbers::pi);
    mode.shape = iteration.shape();
    return mode;
  }
  throw Error(ExitCode::numerical, "lowest mode", "its frequency does not settle");
}

}  // namespace tpm::organ
