#pragma once
#include "tpm/plan/plan.hpp"

namespace tpm::plan {

/// The reference that a pick is verified against, and how sure it is.
struct VerifiedReference {
  std::vector<double> times_s;
  Trajectory trajectory;
  PlanReference reference;
  OperationCount work;  ///< of both
};

/// The full nonlinear network at a thousandth of the tolerance, or tighter until it and a second
/// run by other formulae agree: without masses Radau collocation with eight stages against three
/// (of order 15 and 5 in smooth motion); with masses BDF of order 2 against the trapezoidal rule at
/// ten times its tolerance. Throws Error(numerical) as the runs do, and where the two differ by
/// more than a tenth of the tolerance.
/// @param surrogate whose runs are shared: the reference is one of them but with masses and tools
[[nodiscard]] VerifiedReference verified_reference(const PlanSurrogate& surrogate,
                                                   double tolerance);

}  // namespace tpm::plan
