#pragma once
#include <vector>

#include "tpm/plan/plan_scene.hpp"
#include "tpm/plan/scalar_model.hpp"

namespace tpm {

/// The linear network at rest, seen along what is imposed: stiffness k(theta) where a share theta
/// of all that can relax has relaxed. In the frequency domain theta = 1/(1 + s tau), so these
/// numbers are the whole relaxation of the contact.
struct ContactSpectrum {
  std::vector<double> theta;              ///< rising, from 0 to 1
  std::vector<double> stiffness_N_per_m;  ///< falling
  double tau_s = 0.0;                     ///< of the bonds
  double longest = 1.0;  ///< the longest relaxation time of the contact, in tau: (E1 + E2)/E1
  /// Displacements of the spheres per unit of depth, at once and relaxed.
  Eigen::Matrix3Xd field_at_once, field_relaxed;

  [[nodiscard]] double at_once() const { return stiffness_N_per_m.front(); }
  [[nodiscard]] double relaxed() const { return stiffness_N_per_m.back(); }
};

/// One factorisation of the stiffness for each of a dozen theta.
/// Throws Error(numerical) if the network does not stand, Error(bad_input) if a depth that is
/// imposed touches nothing at rest.
[[nodiscard]] ContactSpectrum contact_spectrum(const PlanScene& scene);

/// The exponentials, at most `most` of them (1 to 3), whose stiffness is nearest to k(theta) in the
/// largest deviation, the ends exact: shares of k(0) - k(1), above 0, sum 1. Times are sought among
/// 21 between tau and the longest, shares by least squares. None if nothing relaxes.
[[nodiscard]] std::vector<ScalarBranch> fitted_branches(const ContactSpectrum& spectrum, int most);

}  // namespace tpm
