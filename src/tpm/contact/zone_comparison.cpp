// Declared in tpm/contact/zone_network.hpp.
// The claim of a zone: compared with the whole network when it is built.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/contact/condensed/compared_motion.hpp"
#include "tpm/contact/zone_network.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"

namespace tpm::contact {
namespace {

/// Errors under other motions than the ones compared: the rule of the plan's step candidates.
constexpr double kZoneSafety = 2.0;
const std::vector<double> kZoneDurations{0.05, 5.0};  // of a ramp, in relaxation times
constexpr int kZoneStepsOfRamp = 120;
constexpr int kStepsApart = 3;        // compared after so many
constexpr double kAsideDepths = 2.0;  // frozen depths at which it is compared across
constexpr double kAside_m = 2e-3;     // compared across the normal
constexpr double kWalk_m = 1e-3;      // the zone goes to equilibria in such strides
constexpr int kStepsOfStride = 4;
constexpr int kStepsAtEnd = 12;           // of the way, where elastic
constexpr int kStepsToEquilibrium = 100;  // the same, where viscous elongations follow

/// Weights with which a step leads to the elastic equilibrium with the stiffness of a period's end.
ServoWeights elastic(ServoWeights weights) {
  weights.keep = weights.of_start = 0.0F;
  for (ServoBranch& branch : weights.branches) branch.keep = branch.of_start = 0.0F;
  return weights;
}

/// Weights with which steps lead to equilibrium: viscous elongations go half of their way each.
/// (All of it would be one step, but the frozen stiffness then differs too much from the real one.)
ServoWeights relaxing_by_halves(ServoWeights weights) {
  weights.of_start = 0.0F;
  weights.keep = weights.of_end = 0.5F;
  for (ServoBranch& branch : weights.branches) {
    branch.of_start = 0.0F;
    branch.keep = branch.of_end = 0.5F;
  }
  return weights;
}

/// The force of a tissue on its contact at an equilibrium, N.
Eigen::Vector3d force_at(PushedContact& tissue, const Eigen::Vector3d& displacement_m,
                         double relaxed) {
  const Positions position = tissue.at(displacement_m, relaxed);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, position.cols());
  tissue.bonds().add_forces(position, tissue.viscous_state(position, relaxed, relaxed), force);
  return tissue.contact().sum(force);
}

}  // namespace

void ZoneNetwork::compare_along(const ComparedMotion& motion) {
  const double peak_N = motion.contact_N.colwise().norm().maxCoeff();
  int steps = 0;
  for (const double depth_m : motion.depth_m) {
    const ContactAnswer answer = step(depth_m * into_);
    if (++steps % kStepsApart != 0) continue;
    const double error_N = (answer.force_N - motion.contact_N.col(steps / kStepsApart - 1)).norm();
    // Of a zone that diverges nothing is claimed.
    claim_.require(claim_.place(), std::isfinite(error_N) ? kZoneSafety * error_N : peak_N);
  }
}

Eigen::Vector3d ZoneNetwork::force_after(const Eigen::Vector3d& displacement_m, int steps_there) {
  reset();
  const auto steps = kStepsOfStride * static_cast<int>(std::ceil(displacement_m.norm() / kWalk_m));
  for (int i = 1; i <= steps; ++i) step(static_cast<double>(i) / steps * displacement_m);
  ContactAnswer answer;
  for (int i = 0; i < steps_there; ++i) answer = step(displacement_m);
  return answer.force_N;
}

void ZoneNetwork::compare_aside(PushedContact& tissue, double relaxed, int steps_there) {
  const double depth_m = std::min(kAsideDepths * options_.frozen_depth_m, options_.deepest_m);
  Eigen::Index least = 0;
  into_.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d first = into_.cross(Eigen::Vector3d::Unit(least)).normalized();
  for (const Eigen::Vector3d& aside : {first, Eigen::Vector3d(into_.cross(first))}) {
    for (const double way_m : {kAside_m, -kAside_m}) {
      const Eigen::Vector3d there_m = depth_m * into_ + way_m * aside;
      const Eigen::Vector3d expected_N = force_at(tissue, there_m, relaxed);
      const double error_N = (force_after(there_m, steps_there) - expected_N).norm();
      claim_.require_aside({depth_m, false}, kAside_m,
                           std::isfinite(error_N) ? kZoneSafety * error_N : expected_N.norm());
    }
  }
}

void ZoneNetwork::compare(PushedContact& tissue, const Constraints& constraints,
                          const Parts& parts) {
  claim_ = ZoneClaim(options_.deepest_m);
  std::vector<WeightedTime> branches;
  for (const ViscousLaw::Branch& branch : common_branches(tissue.bonds())) {
    branches.push_back({branch.share, branch.relaxation_time_s});
  }
  const ServoWeights of_period = weights_;
  const Dense stiff = stiff_;
  const Packed inverse = inverse_;
  const std::array<AlignedFloats, 3> field = field_;
  const ComparedMotions asked{.depth_m = options_.deepest_m,
                              .durations = kZoneDurations,
                              .mean_relaxation_time_s = mean_relaxation_time_s(branches),
                              .steps_of_ramp = kZoneStepsOfRamp,
                              .least_step_s = options_.period_s,
                              .every = kStepsApart,
                              .contact_forces = true};
  std::vector<Probe> probes;
  for (const std::size_t sphere : contact_) probes.push_back({sphere, into_, 1.0});
  for (const ComparedMotion& motion : compared_motions(tissue.bonds(), tissue.rest(), constraints,
                                                       Probes(std::move(probes)), asked)) {
    set_weights(tissue, parts, servo_weights(tissue.bonds(), motion.step_s));
    reset();
    compare_along(motion);
  }
  set_weights(tissue, parts, relaxing_by_halves(of_period));
  compare_aside(tissue, 1.0, kStepsToEquilibrium);
  stiff_ = stiff;
  inverse_ = inverse;
  field_ = field;
  weights_ = elastic(of_period);
  compare_aside(tissue, static_cast<double>(weights_.of_end), kStepsAtEnd);
  weights_ = of_period;
  claim_.set_weights(weights_);
  reset();
}

}  // namespace tpm::contact
