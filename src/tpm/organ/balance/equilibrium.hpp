#pragma once
#include <array>
#include <memory>
#include <optional>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/newton_balance.hpp"
#include "tpm/organ/bonds/stiffness_blocks.hpp"

namespace tpm::organ {

class LargeEquilibrium;

/// Solver of linear systems with the stiffness matrix.
enum class StiffnessSolver {
  automatic,  ///< direct, unless the factor is too large or takes too long; see EquilibriumOptions
  direct,     ///< by a factorisation (BlockLdlt)
  iterative,  ///< by conjugate gradients with multigrid (LargeEquilibrium)
};

inline constexpr std::array<Word<StiffnessSolver>, 3> kStiffnessSolverWords{
    {{StiffnessSolver::automatic, "automatic"},
     {StiffnessSolver::direct, "direct"},
     {StiffnessSolver::iterative, "iterative"}}};

/// Limits are numbers, not what the machine has free, so that results do not depend on it.
struct EquilibriumOptions {
  StiffnessSolver solver = StiffnessSolver::direct;
  /// `automatic` iterates where a factorisation takes more operations, counted from its pattern:
  /// 100 s of one core at 20 Gflop/s.
  double most_operations = 2e12;
  /// The same for what a factor takes: 8 GiB.
  double most_bytes = 8.0 * 1024.0 * 1024.0 * 1024.0;
};

/// Solver chosen for a network, and the reason.
struct SolverChoice {
  bool direct = true;
  double operations = 0.0;  ///< of a factorisation, additions and multiplications
  double bytes = 0.0;       ///< of the factor
};

/// The solver that options choose for a network. Finds the pattern of what moves unless the options
/// say `iterative`.
[[nodiscard]] SolverChoice choose_solver(const BondSystem& bonds, const Constraints& constraints,
                                         const EquilibriumOptions& options);

/// Balances the forces on the free spheres of a network by Newton's method with solutions of the
/// stiffness matrix.
///
/// Direct: pivots tell whether the stiffness is positive definite. A factorisation is kept as long
/// as each step with it leaves a tenth of the forces at most; the equilibrium that is found is
/// looked at itself. Iterative: as LargeEquilibrium.
class Equilibrium {
 public:
  /// @param bonds, constraints must live as long as this
  Equilibrium(const BondSystem& bonds, const Constraints& constraints,
              EquilibriumOptions options = {});
  ~Equilibrium();
  Equilibrium(Equilibrium&&) noexcept;

  /// @param position start, with what is imposed in place; the equilibrium if converged
  /// @param load on each sphere, N
  /// @param tolerance_N of the force left on each sphere
  [[nodiscard]] EquilibriumSearch find(Positions& position, const ViscousState& viscous_state,
                                       const Eigen::Matrix3Xd& load, double tolerance_N);

  /// Force of bonds and loads on every sphere, N: what is left of it on free coordinates is 0 in
  /// equilibrium; on the others it is minus the reaction.
  void forces(const Positions& position, const ViscousState& viscous_state,
              const Eigen::Matrix3Xd& load, Eigen::Matrix3Xd& force) const;

  /// Prepares solutions with the stiffness at a position. False if it cannot be; see also
  /// is_stable().
  [[nodiscard]] bool factorise(const Positions& position, const ViscousState& viscous_state);
  /// The stiffness prepared last is positive definite; where solutions iterate, a search for
  /// negative stiffness has found none.
  [[nodiscard]] bool is_stable() const { return stable_; }
  /// Replaces forces on the spheres by the displacements of the free coordinates under them, with
  /// the stiffness prepared last.
  /// @param tolerance of iterative solutions, in parts
  /// Throws Error(numerical) if an iterative solution does not come to an end.
  void displace(Eigen::Ref<Eigen::Matrix3Xd> vectors, double tolerance = 1e-10) const;

  [[nodiscard]] const SolverChoice& choice() const { return choice_; }
  /// The factorisation of a direct solver, null otherwise.
  [[nodiscard]] const BlockLdlt* factor() const { return direct_ ? &direct_->factor : nullptr; }
  /// Of that. There is none where solutions iterate.
  [[nodiscard]] const BlockPattern& pattern() const { return direct_->blocks.pattern(); }
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }

 private:
  [[nodiscard]] EquilibriumSearch find_directly(Positions& position,
                                                const ViscousState& viscous_state,
                                                const Eigen::Matrix3Xd& load, double tolerance_N);
  /// Made when first needed: its multigrid takes the rigid motions from a position.
  [[nodiscard]] LargeEquilibrium& iterative(const Positions& position);

  struct Direct {
    Direct(const BondSystem& bonds, const Constraints& constraints)
        : blocks(bonds, constraints), factor(blocks.pattern()) {}
    StiffnessBlocks blocks;
    BlockLdlt factor;
  };

  const BondSystem& bonds_;
  const Constraints& constraints_;
  SolverChoice choice_;
  std::optional<Direct> direct_;
  std::unique_ptr<LargeEquilibrium> iterative_;
  bool stable_ = false;
};

}  // namespace tpm::organ
