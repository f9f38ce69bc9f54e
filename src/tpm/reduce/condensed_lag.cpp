#include "tpm/reduce/condensed_lag.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tpm/network/quasistatic.hpp"
#include "tpmkit/error.hpp"

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

/// A ramp to a depth, a hold and, if asked, a release and a rest, all of one length.
Protocol ramp_hold_release(double ramp_s, double depth_m, bool released) {
  std::vector<Knot> knots{{0.0, 0.0}, {ramp_s, depth_m}, {2.0 * ramp_s, depth_m}};
  if (released) knots.insert(knots.end(), {{3.0 * ramp_s, 0.0}, {4.0 * ramp_s, 0.0}});
  return Protocol(Drive::displacement, std::move(knots), "to compare a condensed model with");
}

std::vector<double> ends_of_steps(const Protocol& protocol, double step_s) {
  std::vector<double> times_s;
  const auto count = std::lround(protocol.end_s() / step_s);
  for (long i = 1; i < count; ++i) times_s.push_back(step_s * static_cast<double>(i));
  times_s.push_back(protocol.end_s());
  return times_s;
}

/// Forces at the ends of steps. A relaxed tissue that is released fast can buckle: then there is no
/// equilibrium to compare with, and the forces end with the hold.
Eigen::VectorXd forces_until_it_buckles(const QuasiStatic& network, const Protocol& protocol,
                                        const Protocol& not_released, double step_s) {
  try {
    return network.run(protocol, ends_of_steps(protocol, step_s)).response;
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
  }
  return network.run(not_released, ends_of_steps(not_released, step_s)).response;
}

}  // namespace

double condensed_lag(const Eigen::Vector3d& u, const Eigen::Vector3d& w, double depth_m) noexcept {
  return 4.0 * std::sqrt(w.squaredNorm() * (u - w).squaredNorm()) / (depth_m * depth_m);
}

double condensed_lag_error_N(const CondensedContact& model, const CondensedFit& fit,
                             const BondSystem& bonds, const Positions& rest,
                             const Constraints& constraints, const Eigen::Vector3d& into_tissue) {
  const double depth_m = 2.0 * fit.frame.half_depth_m;
  Probe probe;
  probe.sphere = static_cast<std::size_t>(fit.contact);
  probe.direction = into_tissue;
  Constraints guided = constraints;
  guided.guide(probe.sphere, into_tissue);
  const QuasiStatic network(bonds, rest, guided, probe, {.tolerance = kReferenceTolerance});
  double per_lag_N = 0.0;
  for (const double duration : kDurations) {
    const double ramp_s = duration * mean_relaxation_time_s(model.branches());
    const double step_s = ramp_s / kStepsOfRamp;
    const Protocol protocol = ramp_hold_release(ramp_s, depth_m, true);
    const Eigen::VectorXd expected_N = forces_until_it_buckles(
        network, protocol, ramp_hold_release(ramp_s, depth_m, false), step_s);
    CondensedContact contact = model.with_period(step_s);
    for (Eigen::Index i = 0; i < expected_N.size(); ++i) {
      const double u_m = value_at(protocol, step_s * static_cast<double>(i + 1));
      const ContactAnswer answer = contact.step(u_m * into_tissue);
      const double lag = condensed_lag({u_m, 0.0, 0.0}, contact.memory().w_m, depth_m);
      const double error_N = std::abs(answer.force_N.dot(into_tissue) + expected_N[i]);
      if (lag < kLeastLag) continue;
      per_lag_N = std::max(per_lag_N, (kLagSafety * error_N - answer.error_N) / lag);
    }
  }
  return per_lag_N;
}

}  // namespace tpm
