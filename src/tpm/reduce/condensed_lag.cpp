#include "tpm/reduce/condensed_lag.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/network/quasistatic.hpp"

namespace tpm {
namespace {

constexpr std::array<double, 3> kDurations{0.2, 1.0, 5.0};  // of a ramp, in relaxation times
constexpr int kStepsOfRamp = 50;
constexpr double kReferenceTolerance = 1e-5;
/// Errors under other motions than the ones compared: the rule of the plan's step candidates.
constexpr double kLagSafety = 2.0;
constexpr double kLeastLag = 0.05;  // a smaller lag does not explain an error

double mean_relaxation_time_s(const std::vector<CondensedBranch>& branches) {
  double sum = 0.0;
  for (const CondensedBranch& b : branches) sum += b.share * std::log(b.relaxation_time_s);
  return std::exp(sum);
}

}  // namespace

double condensed_lag(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double depth_m) noexcept {
  return 4.0 * std::sqrt(w.squaredNorm() * (u - w).squaredNorm()) / (depth_m * depth_m);
}

double condensed_lag_error_N(const CondensedContact& model, const CondensedFit& fit,
                             const BondSystem& bonds, const Positions& rest, const Freedom& freedom,
                             const Eigen::Vector3d& into_tissue) {
  const double depth_m = 2.0 * fit.frame.half_depth_m;
  Probe probe;
  probe.sphere = static_cast<std::size_t>(fit.contact);
  probe.direction = into_tissue;
  Freedom guided = freedom;
  guided.guide(probe.sphere, into_tissue);
  const QuasiStatic network(bonds, rest, guided, probe, {.tolerance = kReferenceTolerance});
  double per_lag_N = 0.0;
  for (const double duration : kDurations) {
    const double ramp_s = duration * mean_relaxation_time_s(model.branches());
    const double step_s = ramp_s / kStepsOfRamp;
    const Protocol protocol(Drive::displacement,
                            {{0.0, 0.0},
                             {ramp_s, depth_m},
                             {2.0 * ramp_s, depth_m},
                             {3.0 * ramp_s, 0.0},
                             {4.0 * ramp_s, 0.0}},
                            "a ramp, a hold, a release and a rest");
    std::vector<double> times_s;
    for (int i = 1; i < 4 * kStepsOfRamp; ++i) times_s.push_back(step_s * i);
    times_s.push_back(protocol.end_s());
    const Eigen::VectorXd expected_N = network.run(protocol, times_s).response;
    CondensedContact contact = model.with_period(step_s);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double u_m = value_at(protocol, times_s[i]);
      const ContactAnswer answer = contact.step(u_m * into_tissue);
      const double lag = condensed_lag({u_m, 0.0, 0.0}, contact.memory().w_m, depth_m);
      const double error_N =
          std::abs(answer.force_N.dot(into_tissue) + expected_N[static_cast<Eigen::Index>(i)]);
      if (lag >= kLeastLag)
        per_lag_N = std::max(per_lag_N, (kLagSafety * error_N - answer.error_N) / lag);
    }
  }
  return per_lag_N;
}

}  // namespace tpm
