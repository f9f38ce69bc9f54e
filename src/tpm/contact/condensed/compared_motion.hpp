#pragma once
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/quasistatic.hpp"

namespace tpm::contact {

/// A motion along which a reduced model is compared with the network when it is built: to a depth,
/// a hold, a release and a rest of one length each, in steps of one length.
struct ComparedMotion {
  double step_s = 0.0;
  std::vector<double> depth_m;  ///< at the end of each step
  /// Of the quasi-static network after each step, along the push: the force on what pushes is
  /// minus that.
  Eigen::VectorXd force_N;
};

/// Motions to compare, and settings of the comparison.
struct ComparedMotions {
  double depth_m = 0.0;                 ///< > 0
  std::vector<double> durations;        ///< of the ramp, in mean relaxation times, > 0
  double mean_relaxation_time_s = 0.0;  ///< 0 where nothing relaxes
  int steps_of_ramp = 50;               ///< > 0
};

struct WeightedTime {
  double share, relaxation_time_s;
};
/// The relaxation time whose logarithm is the mean, weighted by the shares of the branches; 0 if
/// there is none.
[[nodiscard]] double mean_relaxation_time_s(const std::vector<WeightedTime>& branches);

/// Runs the quasi-static network along the motions, none of them twice. A relaxed tissue that is
/// released fast can buckle: then there is no equilibrium to compare with, and the forces end with
/// the hold.
/// @param probes what is pushed together, and where to; it does not yield to the side
/// Throws Error(numerical) where the network cannot be balanced before the release.
[[nodiscard]] std::vector<ComparedMotion> compared_motions(const BondSystem& bonds,
                                                           const Positions& rest,
                                                           const Constraints& constraints,
                                                           const Probes& probes,
                                                           const ComparedMotions& asked);

}  // namespace tpm::contact
