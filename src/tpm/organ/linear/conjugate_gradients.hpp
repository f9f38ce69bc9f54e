#pragma once
#include "tpm/organ/linear/block_rows.hpp"

namespace tpm::organ {

/// An approximate inverse M^-1 of a symmetric positive definite matrix, symmetric and positive
/// definite itself.
class Preconditioner {
 public:
  Preconditioner() = default;
  Preconditioner(const Preconditioner&) = delete;
  Preconditioner& operator=(const Preconditioner&) = delete;
  virtual ~Preconditioner() = default;

  /// Takes note that the matrix has changed, as far as must be to stay symmetric and positive
  /// definite. False if the preconditioner has to be made anew.
  [[nodiscard]] virtual bool refresh() { return false; }
  /// False if making it proved that the matrix is not positive definite; it is then of no use.
  [[nodiscard]] virtual bool definite() const = 0;
  /// z = M^-1 r.
  virtual void apply(const BlockVector<3>& r, BlockVector<3>& z) const = 0;
};

enum class GradientsEnd {
  converged,
  not_definite,  ///< a direction p with p^T A p <= 0 was met (or r^T M^-1 r <= 0)
  unfinished,    ///< the iterations ran out, or a number is not finite
};

struct GradientsOutcome {
  GradientsEnd end = GradientsEnd::unfinished;
  int iterations = 0;
  double reduction = 1.0;  ///< of sqrt(r^T M^-1 r) from first to last
};

/// Solves A x = b by preconditioned conjugate gradients (Hestenes & Stiefel 1952), from x = 0,
/// until sqrt(r^T M^-1 r) has fallen to `tolerance` of what it was.
///
/// Every curvature p^T A p is looked at. Where all are positive, the residual of an eigenvector of
/// M^-1 A with an eigenvalue <= 0 cannot have fallen (the roots of the residual's polynomial, the
/// Ritz values, are all positive): so convergence shows that b holds less than `tolerance` of it.
[[nodiscard]] GradientsOutcome conjugate_gradients(const BlockRows<3, 3>& matrix,
                                                   const Preconditioner& preconditioner,
                                                   const BlockVector<3>& b, double tolerance,
                                                   int most_iterations, BlockVector<3>& x);

/// Looks for a direction of zero or negative curvature with a random right-hand side (from a seed):
/// converged if there is none. An eigenvector is overlooked only if its part in the right-hand side
/// is below `tolerance`: of a part that is normally distributed about 1/sqrt(coordinates), a
/// probability of about 0.8 sqrt(coordinates) tolerance.
[[nodiscard]] GradientsOutcome probe_definiteness(const BlockRows<3, 3>& matrix,
                                                  const Preconditioner& preconditioner,
                                                  double tolerance, int most_iterations,
                                                  std::uint64_t seed);

}  // namespace tpm::organ
