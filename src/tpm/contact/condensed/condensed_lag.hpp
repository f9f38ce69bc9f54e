#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/condensed/condensed_fit.hpp"
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::contact {

/// Lag of the viscous state behind the contact, weighted by how far it has left rest:
///
///     4 |w| |u - w| / D²,
///
/// 0 where everything or nothing has relaxed, 1 half way at the depth D. Elongations of bonds are
/// then means over places that the contact passed, and the elongation of a mean place (which is
/// what the condensed model takes) is another.
/// @param u, w contact and viscous state in the axes of the contact, m
[[nodiscard]] double condensed_lag(const Eigen::Vector3d& u, const Eigen::Vector3d& w,
                                   double depth_m) noexcept;

/// Addition to the claim of a condensed model per condensed_lag(), N. The model is compared
/// with the quasi-static network where it lags: loaded to the depth, held, released and left alone,
/// each for 0.2, 1 and 5 relaxation times (of several branches the mean of their logarithms). The
/// result is twice the largest excess of an error over the claim so far, per lag.
/// A release during which the tissue buckles is left out: nothing is claimed of a buckled tissue.
/// @param model with a claim that has no such part yet
/// Throws Error(numerical) where the network cannot be balanced before the release.
[[nodiscard]] double condensed_lag_error_N(const CondensedContact& model, const CondensedFit& fit,
                                           const BondSystem& bonds, const Positions& rest,
                                           const Constraints& constraints,
                                           const Eigen::Vector3d& into_tissue);

}  // namespace tpm::contact
