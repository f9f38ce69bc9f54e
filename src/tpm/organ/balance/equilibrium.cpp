#include "tpm/organ/balance/equilibrium.hpp"

#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kServes = 0.1;      // of the forces left: a factor that leaves more is made anew
constexpr double kSamePlace = 1e-6;  // of the shortest bond
constexpr double kOperationsPerProduct = 54.0;  // of 3x3 blocks

}  // namespace

SolverChoice choose_solver(const BondSystem& bonds, const Constraints& constraints,
                           const EquilibriumOptions& options) {
  SolverChoice choice;
  choice.direct = options.solver != StiffnessSolver::iterative;
  if (!choice.direct) return choice;
  const auto graph = moving_graph(bonds, constraints);
  const BlockPattern& pattern = graph->pattern;
  choice.operations = kOperationsPerProduct * static_cast<double>(pattern.factor_products());
  choice.bytes = static_cast<double>(pattern.factor_bytes());
  if (options.solver == StiffnessSolver::direct) return choice;
  choice.direct =
      choice.operations <= options.most_operations && choice.bytes <= options.most_bytes;
  return choice;
}

Equilibrium::Equilibrium(const BondSystem& bonds, const Constraints& constraints,
                         EquilibriumOptions options)
    : bonds_(bonds),
      constraints_(constraints),
      choice_(choose_solver(bonds, constraints, options)) {
  if (choice_.direct) direct_.emplace(bonds, constraints);
}

Equilibrium::~Equilibrium() = default;
Equilibrium::Equilibrium(Equilibrium&&) noexcept = default;

LargeEquilibrium& Equilibrium::iterative(const Positions& position) {
  if (!iterative_) iterative_ = std::make_unique<LargeEquilibrium>(bonds_, constraints_, position);
  return *iterative_;
}

void Equilibrium::forces(const Positions& position, const ViscousState& viscous_state,
                         const Eigen::Matrix3Xd& load, Eigen::Matrix3Xd& force) const {
  balance_forces(bonds_, position, viscous_state, load, force);
}

bool Equilibrium::factorise(const Positions& position, const ViscousState& viscous_state) {
  if (!direct_) {
    LargeEquilibrium& large = iterative(position);
    large.assemble(position, viscous_state);
    const TangentAnswer answer = large.probe();
    stable_ = answer == TangentAnswer::solved;
    return answer != TangentAnswer::failed;
  }
  const bool done = direct_->factor.factorise(direct_->blocks.assemble(position, viscous_state));
  stable_ = direct_->factor.negative_count() == 0;
  return done;
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void Equilibrium::displace(Eigen::Ref<Eigen::Matrix3Xd> vectors, double tolerance) const {
  if (!direct_) {
    Eigen::Matrix3Xd x = vectors;
    if (iterative_->displace(x, tolerance) != TangentAnswer::solved) {
      throw Error(ExitCode::numerical, "network",
                  "conjugate gradients do not solve for the displacements");
    }
    vectors = x;
    return;
  }
  constraints_.project(vectors);
  direct_->factor.solve(vectors);
  constraints_.project(vectors);
}

EquilibriumSearch Equilibrium::find(Positions& position, const ViscousState& viscous_state,
                                    const Eigen::Matrix3Xd& load, double tolerance_N) {
  if (direct_) return find_directly(position, viscous_state, load, tolerance_N);
  return iterative(position).find(position, viscous_state, load, tolerance_N);
}

EquilibriumSearch Equilibrium::find_directly(Positions& position, const ViscousState& viscous_state,
                                             const Eigen::Matrix3Xd& load, double tolerance_N) {
  // Contacts close and open between iterations: a factor of other contacts serves nothing.
  const bool keeps = bonds_.contact_count() == 0;
  Positions factorised_at;
  double last_residual_N = 0.0;
  int kept = 0;
  const auto solve = [&](const Positions& at, const ViscousState& with, Eigen::Matrix3Xd& forces) {
    const double residual_N = forces.colwise().norm().maxCoeff();
    const bool serves =
        keeps && factorised_at.size() > 0 && residual_N <= kServes * last_residual_N;
    last_residual_N = residual_N;
    if (serves) {
      ++kept;
    } else {
      if (!factorise(at, with)) return TangentAnswer::failed;
      if (!is_stable()) return TangentAnswer::not_definite;
      factorised_at = at;
    }
    displace(forces);
    return TangentAnswer::solved;
  };
  EquilibriumSearch search =
      newton_balance(bonds_, constraints_, position, viscous_state, load, tolerance_N, solve);
  search.factorisations -= kept;
  if (!keeps || !search.converged || !search.stable) return search;
  // The equilibrium itself is looked at, unless the factor was made as good as there.
  const double moved_m = (position - factorised_at).colwise().norm().maxCoeff();
  const auto joined = static_cast<Eigen::Index>(bonds_.first_contact());
  const double shortest_m = bonds_.rest_length_m().head(joined).minCoeff();
  if (moved_m <= kSamePlace * shortest_m) return search;
  ++search.factorisations;
  search.converged = factorise(position, viscous_state);
  search.stable = search.converged && is_stable();
  return search;
}

}  // namespace tpm::organ
