#include "tpm/organ/linear/conjugate_gradients.hpp"

#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"

namespace tpm::organ {
namespace {

double dot(const BlockVector<3>& a, const BlockVector<3>& b) {
  return a.reshaped().dot(b.reshaped());
}

}  // namespace

GradientsOutcome conjugate_gradients(const BlockRows<3, 3>& matrix,
                                     const Preconditioner& preconditioner, const BlockVector<3>& b,
                                     double tolerance, int most_iterations, BlockVector<3>& x) {
  GradientsOutcome outcome;
  const auto ends = [&](GradientsEnd end) {
    outcome.end = end;
    return outcome;
  };
  x.setZero(3, b.cols());
  if (!preconditioner.definite()) return ends(GradientsEnd::not_definite);
  BlockVector<3> r = b;
  BlockVector<3> z;
  BlockVector<3> product;
  preconditioner.apply(r, z);
  BlockVector<3> p = z;
  double rho = dot(r, z);
  if (b.isZero(0.0)) return ends(GradientsEnd::converged);
  if (rho == 0.0) return ends(GradientsEnd::not_definite);
  const double first = rho;
  for (;;) {
    if (!std::isfinite(rho)) return ends(GradientsEnd::unfinished);
    if (rho < 0.0) return ends(GradientsEnd::not_definite);
    outcome.reduction = std::sqrt(rho / first);
    if (outcome.reduction <= tolerance) return ends(GradientsEnd::converged);
    if (outcome.iterations == most_iterations) return ends(GradientsEnd::unfinished);
    ++outcome.iterations;
    multiply(matrix, p, product);
    const double curvature = dot(p, product);
    if (curvature <= 0.0) return ends(GradientsEnd::not_definite);
    const double length = rho / curvature;
    x += length * p;
    r -= length * product;
    preconditioner.apply(r, z);
    const double next = dot(r, z);
    p = z + (next / rho) * p;
    rho = next;
  }
}

GradientsOutcome probe_definiteness(const BlockRows<3, 3>& matrix,
                                    const Preconditioner& preconditioner, double tolerance,
                                    int most_iterations, std::uint64_t seed) {
  BlockVector<3> b(3, static_cast<Eigen::Index>(matrix.rows()));
  Random random(seed);
  for (double& value : b.reshaped()) value = random.normal();
  BlockVector<3> x;
  return conjugate_gradients(matrix, preconditioner, b, tolerance, most_iterations, x);
}

}  // namespace tpm::organ
