#pragma once
#include <vector>

#include "tpm/plan/plan_scene.hpp"
#include "tpm/plan/scalar_model.hpp"

namespace tpm::plan {

/// The linear network at rest, seen along what is imposed: its stiffness where a share theta of all
/// that can relax has relaxed. At a rate s of the Laplace transform theta = sum gamma_j/(1 + s
/// tau_j), so these numbers are the whole relaxation of the contact. Its exponentials relax between
/// the shortest tau_j and the longest times (E1 + E2)/E1 (instantaneous over equilibrium modulus).
struct ContactSpectrum {
  std::vector<double> per_rate_s;         ///< 1/s, rising, from 0 to infinity
  std::vector<double> stiffness_N_per_m;  ///< falling
  double shortest_s = 0.0;                ///< relaxation time of the contact
  double longest_s = 0.0;
  /// Displacements of the spheres per unit of depth, instantaneous and relaxed.
  Eigen::Matrix3Xd field_instantaneous, field_relaxed;

  [[nodiscard]] double instantaneous() const { return stiffness_N_per_m.front(); }
  [[nodiscard]] double equilibrium() const { return stiffness_N_per_m.back(); }
};

/// One factorisation of the stiffness for each of a dozen theta; with several branches a polynomial
/// through these gives the stiffness at eight rates a decade.
/// Throws Error(numerical) if the network does not stand, Error(bad_input) if a depth that is
/// imposed touches nothing at rest, and for bonds that do not relax alike or whose branches act on
/// a kernel.
[[nodiscard]] ContactSpectrum contact_spectrum(const PlanScene& scene);

/// The exponentials, at most `most` of them (1 to 3), whose stiffness is nearest to the spectrum's
/// in the largest deviation, the ends exact: shares of its fall, above 0, sum 1. Times are sought
/// among 21 (eight a decade if that is more, at most 31) between the shortest and the longest,
/// shares by least squares. None if nothing relaxes.
[[nodiscard]] std::vector<ScalarBranch> fitted_branches(const ContactSpectrum& spectrum, int most);

}  // namespace tpm::plan
