#include "tpm/organ/balance/large_equilibrium.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/organ/linear/preconditioners.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

// Eisenstat and Walker's choice 2 and its safeguard.
constexpr double kForcingFactor = 0.9;
constexpr double kFirstForcing = 0.1;
constexpr double kSafeguard = 0.1;
constexpr double kLeastForcing = 1e-10;
constexpr double kTired = 1.5;  // growth of the iterations that makes a preconditioner too old

/// Tolerance of the next step's linear solve.
class Forcing {
 public:
  explicit Forcing(double target) : adjoint_(target) {}
  /// @param residual now, in the unit of the target
  double next(double residual) {
    double eta = kFirstForcing;
    if (last_residual_ > 0.0) {
      const double ratio = residual / last_residual_;
      eta = kForcingFactor * ratio * ratio;
      const double safe = kForcingFactor * last_eta_ * last_eta_;
      if (safe > kSafeguard) eta = std::max(eta, safe);
    }
    // Not more exactly than the target asks for; by a good part, as norms differ.
    eta = std::max(eta, kSafeguard * kSafeguard * adjoint_ / residual);
    last_eta_ = std::clamp(eta, kLeastForcing, kFirstForcing);
    last_residual_ = residual;
    return last_eta_;
  }

 private:
  double adjoint_;
  double last_residual_ = 0.0, last_eta_ = 0.0;
};

/// Translations, and turns about the middle scaled to the size of the body.
RigidModes<3> rigid_modes(const Positions& rest, const Constraints& constraints) {
  const Eigen::Vector3d middle = rest.rowwise().mean();
  const Positions from = rest.colwise() - middle;
  const double size = std::max(from.colwise().norm().maxCoeff(), 1e-300);
  RigidModes<3> modes(constraints.size());
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const Eigen::Vector3d p = from.col(static_cast<Eigen::Index>(i)) / size;
    Eigen::Matrix<double, 3, 6> mode;
    mode.leftCols<3>().setIdentity();
    mode.rightCols<3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
    modes[i] = constraints.projector(i) * mode;
  }
  return modes;
}

TangentAnswer answer_of(GradientsEnd end) {
  if (end == GradientsEnd::converged) return TangentAnswer::solved;
  return end == GradientsEnd::not_definite ? TangentAnswer::not_definite : TangentAnswer::failed;
}

}  // namespace

LargeEquilibrium::LargeEquilibrium(const BondSystem& bonds, const Constraints& constraints,
                                   const Positions& rest, LargeEquilibriumOptions options)
    : bonds_(bonds),
      constraints_(constraints),
      options_(options),
      modes_(rigid_modes(rest, constraints)),
      stiffness_(bonds, constraints) {
  if (options.most_iterations < 1) {
    throw bad_input("iterations of conjugate gradients", fmt::format("{}", options.most_iterations),
                    "1 or more");
  }
}

std::unique_ptr<Preconditioner> LargeEquilibrium::preconditioner() const {
  switch (options_.preconditioner) {
    case PreconditionerKind::block_jacobi:
      return std::make_unique<BlockJacobi>(stiffness_.matrix());
    case PreconditionerKind::incomplete_cholesky:
      return std::make_unique<IncompleteCholesky>(stiffness_.matrix());
    case PreconditionerKind::multigrid:
      break;
  }
  return std::make_unique<Multigrid>(stiffness_.matrix(), modes_);
}

void LargeEquilibrium::prepare() {
  const bool serves = last_rate_ <= kTired * rate_when_new_ + 1.0;
  if (preconditioner_ && serves && preconditioner_->refresh()) return;
  preconditioner_.reset();  // the old one's memory is needed
  preconditioner_ = preconditioner();
  rate_when_new_ = last_rate_ = 0.0;
  ++work_.preconditioners;
}

void LargeEquilibrium::assemble(const Positions& position, const ViscousState& viscous_state) {
  stiffness_.assemble(position, viscous_state);
  prepare();
}

TangentAnswer LargeEquilibrium::displace(Eigen::Matrix3Xd& vectors, double tolerance) {
  constraints_.project(vectors);
  Eigen::Matrix3Xd x;
  const GradientsOutcome outcome = conjugate_gradients(
      stiffness_.matrix(), *preconditioner_, vectors, tolerance, options_.most_iterations, x);
  ++work_.solutions;
  work_.iterations += outcome.iterations;
  if (outcome.iterations > 0) {
    last_rate_ = -outcome.iterations / std::log10(std::min(outcome.reduction, 0.5));
    if (rate_when_new_ == 0.0) rate_when_new_ = last_rate_;
  }
  constraints_.project(x);
  vectors = std::move(x);
  return answer_of(outcome.end);
}

TangentAnswer LargeEquilibrium::probe() {
  const GradientsOutcome outcome =
      probe_definiteness(stiffness_.matrix(), *preconditioner_, options_.probe_tolerance,
                         options_.most_iterations, options_.probe_seed);
  work_.probe_iterations += outcome.iterations;
  return answer_of(outcome.end);
}

TangentAnswer LargeEquilibrium::solve(const Positions& position, const ViscousState& viscous_state,
                                      Eigen::Matrix3Xd& vectors, double tolerance) {
  assemble(position, viscous_state);
  return displace(vectors, tolerance);
}

EquilibriumSearch LargeEquilibrium::find(Positions& position, const ViscousState& viscous_state,
                                         const Eigen::Matrix3Xd& load, double tolerance_N) {
  Forcing forcing(tolerance_N);
  const auto step = [&](const Positions& at, const ViscousState& with, Eigen::Matrix3Xd& forces) {
    const double residual = forces.colwise().norm().maxCoeff();
    return solve(at, with, forces, forcing.next(residual));
  };
  EquilibriumSearch search =
      newton_balance(bonds_, constraints_, position, viscous_state, load, tolerance_N, step);
  if (!search.converged || !search.stable) return search;
  assemble(position, viscous_state);
  const TangentAnswer answer = probe();
  search.stable = answer != TangentAnswer::not_definite;
  search.converged = answer != TangentAnswer::failed;  // an equilibrium without an error tolerance
  return search;
}

}  // namespace tpm::organ
