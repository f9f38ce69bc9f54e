#pragma once
#include <optional>

#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/linear/lane_factor.hpp"

namespace tpm::organ {

/// Solutions with the stiffness of an Equilibrium for states side by side, good to about 1e-4: to
/// correct iterates whose residual is found in double precision. Direct: a copy of the
/// factorisation in single precision. Iterative: conjugate gradients for each lane that differs
/// from the one before.
class LaneStiffness {
 public:
  /// @param equilibrium must live as long as this
  explicit LaneStiffness(const Equilibrium& equilibrium);

  /// Takes over the stiffness that the equilibrium has prepared last. Where it iterates, no other
  /// may be prepared before the last solve() with it.
  void take();

  /// Replaces forces on the free spheres by displacements, lane by lane.
  /// Throws Error(numerical) if an iterative solution does not come to an end.
  void solve(LaneMatrix& x);

 private:
  const Equilibrium& equilibrium_;
  std::optional<LaneFactor> factor_;
};

}  // namespace tpm::organ
