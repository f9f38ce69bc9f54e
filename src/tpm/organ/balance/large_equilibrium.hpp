#pragma once
#include <array>
#include <memory>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/newton_balance.hpp"
#include "tpm/organ/bonds/stiffness_rows.hpp"
#include "tpm/organ/linear/multigrid.hpp"

namespace tpm::organ {

/// Preconditioner of conjugate gradients.
enum class PreconditionerKind { block_jacobi, incomplete_cholesky, multigrid };

inline constexpr std::array<Word<PreconditionerKind>, 3> kPreconditionerWords{
    {{PreconditionerKind::block_jacobi, "block_jacobi"},
     {PreconditionerKind::incomplete_cholesky, "incomplete_cholesky"},
     {PreconditionerKind::multigrid, "multigrid"}}};

struct LargeEquilibriumOptions {
  PreconditionerKind preconditioner = PreconditionerKind::multigrid;
  int most_iterations = 5000;     ///< of conjugate gradients in one solution, >= 1
  double probe_tolerance = 1e-6;  ///< of the search for negative stiffness at the end
  std::uint64_t probe_seed = 1;
};

/// Cost so far of the solutions of a LargeEquilibrium.
struct LargeEquilibriumWork {
  int solutions = 0;
  int preconditioners = 0;  ///< made anew
  int iterations = 0;       ///< of conjugate gradients, without those of probes
  int probe_iterations = 0;
};

/// Equilibrium for networks whose factor does not fit into memory: the same Newton method, its
/// steps solved by preconditioned conjugate gradients, as exactly as they deserve (Eisenstat &
/// Walker, SIAM J. Sci. Comput. 17, 1996, choice 2).
///
/// Negative stiffness is noticed where a direction of a solution shows it, and looked for with a
/// random right-hand side at the equilibrium (probe_definiteness): `stable` means that neither met
/// any. A search whose probe does not come to an end has not converged.
class LargeEquilibrium {
 public:
  /// @param bonds, constraints must live as long as this
  /// @param rest positions of the spheres, m: whence the rigid motions of the multigrid
  /// Throws Error(bad_input) if a solution is allowed no iteration.
  LargeEquilibrium(const BondSystem& bonds, const Constraints& constraints, const Positions& rest,
                   LargeEquilibriumOptions options = {});

  /// As Equilibrium::find; `factorisations` counts linear solutions.
  [[nodiscard]] EquilibriumSearch find(Positions& position, const ViscousState& viscous_state,
                                       const Eigen::Matrix3Xd& load, double tolerance_N);

  /// Replaces forces on the free spheres by displacements, with the stiffness at a position.
  /// @param tolerance of sqrt(r^T M^-1 r) against its start
  [[nodiscard]] TangentAnswer solve(const Positions& position, const ViscousState& viscous_state,
                                    Eigen::Matrix3Xd& vectors, double tolerance);

  /// Assembles the stiffness at a position, for displace() and probe().
  void assemble(const Positions& position, const ViscousState& viscous_state);
  /// As solve(), with the stiffness assembled last.
  [[nodiscard]] TangentAnswer displace(Eigen::Matrix3Xd& vectors, double tolerance);
  /// Looks for negative stiffness in the matrix assembled last.
  [[nodiscard]] TangentAnswer probe();

  [[nodiscard]] const LargeEquilibriumWork& work() const { return work_; }
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }

 private:
  [[nodiscard]] std::unique_ptr<Preconditioner> preconditioner() const;
  /// Makes the preconditioner fit the matrix: anew, unless what there is still serves.
  void prepare();

  const BondSystem& bonds_;
  const Constraints& constraints_;
  LargeEquilibriumOptions options_;
  RigidModes<3> modes_;
  StiffnessRows stiffness_;
  std::unique_ptr<Preconditioner> preconditioner_;
  double rate_when_new_ = 0.0, last_rate_ = 0.0;  ///< iterations per decade; 0: not known yet
  LargeEquilibriumWork work_;
};

}  // namespace tpm::organ
