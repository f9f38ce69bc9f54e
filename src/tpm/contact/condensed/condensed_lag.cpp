#include "tpm/contact/condensed/condensed_lag.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/contact/condensed/compared_motion.hpp"

namespace tpm::contact {
namespace {

constexpr int kStepsOfRamp = 50;
/// Errors under other motions than the ones compared: the rule of the plan's step candidates.
constexpr double kLagSafety = 2.0;
constexpr double kLeastLag = 0.05;  // a smaller lag does not explain an error

}  // namespace

double condensed_lag(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double depth_m) noexcept {
  return 4.0 * std::sqrt(w.squaredNorm() * (u - w).squaredNorm()) / (depth_m * depth_m);
}

double condensed_lag_error_N(const CondensedContact& model, const CondensedFit& fit,
                             const BondSystem& bonds, const Positions& rest,
                             const Constraints& constraints, const Eigen::Vector3d& into_tissue) {
  const double depth_m = 2.0 * fit.frame.half_depth_m;
  std::vector<WeightedTime> branches;
  for (const CondensedBranch& b : model.branches()) {
    branches.push_back({b.share, b.relaxation_time_s});
  }
  const Probe probe{static_cast<std::size_t>(fit.contact), into_tissue, 1.0};
  double per_lag_N = 0.0;
  for (const ComparedMotion& motion :
       compared_motions(bonds, rest, constraints, probe,
                        {.depth_m = depth_m,
                        .durations = {0.2, 1.0, 5.0},
                        .mean_relaxation_time_s = mean_relaxation_time_s(branches),
                        .steps_of_ramp = kStepsOfRamp})) {
    CondensedContact contact = model.with_period(motion.step_s);
    for (Eigen::Index i = 0; i < motion.force_N.size(); ++i) {
      const double u_m = motion.depth_m[static_cast<std::size_t>(i)];
      const ContactAnswer answer = contact.step(u_m * into_tissue);
      const double lag = condensed_lag({u_m, 0.0, 0.0}, contact.viscous_state().w_m, depth_m);
      const double error_N = std::abs(answer.force_N.dot(into_tissue) + motion.force_N[i]);
      if (lag < kLeastLag) continue;
      per_lag_N = std::max(per_lag_N, (kLagSafety * error_N - answer.error_N) / lag);
    }
  }
  return per_lag_N;
}

}  // namespace tpm::contact
