#include "tpm/plan/plan_surrogate.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace tpm::plan {
namespace {

// Those of the reference, whose run is one of these, and which other runs are compared with.
constexpr int kTimesOfPiece = 64, kMostTimes = 800;
constexpr int kTimesOfPieceWithMasses = 640, kMostTimesWithMasses = 3000;
constexpr int kTimesOfPieceUnderTools = 160, kMostTimesUnderTools = 1280;
// Of a run at a tenth of the tolerance, where masses count, about.
constexpr double kFinerRunTakes = 2.5;
constexpr int kCurvePoints = 33;
constexpr double kCurveTolerance = 1e-5;
constexpr double kRamp_s = 1.0;       // in which static curves are followed
constexpr double kMargin = 1.02;      // of the depths of curves
constexpr double kSame = 1.0 + 1e-9;  // tolerances that differ by rounding alone
constexpr double kRounding = 1e-12;   // what no run shows

/// Relaxed share of the branches.
enum class Relaxed { nothing, all };

/// Forces at `points` even depths from 0 to `last_m`.
Eigen::VectorXd static_forces(const PlanScene& scene, double last_m, int points, Relaxed relaxed,
                              double most_s) {
  const Protocol ramp(Drive::displacement, {{0.0, 0.0}, {kRamp_s, last_m}}, "ramp");
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) times.push_back(kRamp_s * i / (points - 1));
  QuasiStaticOptions options;
  options.tolerance = kCurveTolerance;
  const PlanScene driven = scene.with_protocol(ramp);
  return (relaxed == Relaxed::all ? driven.all_relaxed() : driven.nothing_relaxing())
      .quasi_static(options, times, false, most_s)
      .response;
}

/// A static curve from a depth of 0 or less to one above.
DepthCurve static_curve(const PlanScene& scene, double least_m, double most_m, Relaxed relaxed,
                        double most_s) {
  DepthCurve curve;
  const double spacing = (most_m - least_m) / (kCurvePoints - 1);
  // Even points of which one is at rest.
  const int below =
      least_m < 0.0 ? std::max(1, static_cast<int>(std::ceil(-least_m / spacing))) : 0;
  const int above = most_m > 0.0 ? std::max(1, static_cast<int>(std::ceil(most_m / spacing))) : 0;
  curve.first_m = -below * spacing;
  curve.last_m = above * spacing;
  if (below > 0) {
    const Eigen::VectorXd force = static_forces(scene, curve.first_m, below + 1, relaxed, most_s);
    for (Eigen::Index i = below; i > 0; --i) curve.force_N.push_back(force[i]);
  }
  curve.force_N.push_back(0.0);
  if (above > 0) {
    const Eigen::VectorXd force = static_forces(scene, curve.last_m, above + 1, relaxed, most_s);
    for (Eigen::Index i = 1; i <= above; ++i) curve.force_N.push_back(force[i]);
  }
  return curve;
}

std::vector<double> times_of(const PlanScene& scene, int per_piece, int most) {
  return sampled_times(scene.corners(), per_piece, most,
                       scene.driven().bonds.shortest_relaxation_time_s());
}

std::vector<double> times_of_claims(const PlanScene& scene, bool inertial) {
  if (!inertial) return times_of(scene, kTimesOfPiece, kMostTimes);
  if (!scene.has_tools()) return times_of(scene, kTimesOfPieceWithMasses, kMostTimesWithMasses);
  return times_of(scene, kTimesOfPieceUnderTools, kMostTimesUnderTools);
}

/// The run at a tolerance, or of those made that are finer the coarsest; none if there is none.
const Trajectory* as_fine_as(const std::map<double, Trajectory>& runs, double tolerance) {
  if (runs.empty() || runs.begin()->first > kSame * tolerance) return nullptr;
  return &std::prev(runs.upper_bound(kSame * tolerance))->second;
}

}  // namespace

InertialOptions inertial_options(const PlanScene& scene, double tolerance) {
  InertialOptions options;
  options.tolerance = tolerance;
  options.damping_ratio = scene.scene().formulation.damping_ratio;
  return options;
}

PlanSurrogate::PlanSurrogate(PlanScene scene, const PlanMeasure& measure, bool inertial,
                             double most_s)
    : scene_(std::move(scene)),
      measure_(measure),
      inertial_(inertial),
      most_s_(most_s),
      times_(times_of_claims(scene_, inertial)) {}

std::vector<double> PlanSurrogate::times_of_reference() const {
  if (!inertial_ || !scene_.has_tools()) return times_;
  return times_of(scene_, kTimesOfPieceWithMasses, kMostTimesWithMasses);
}

const Trajectory& PlanSurrogate::collocation(double tolerance) const {
  const auto found = collocation_.find(tolerance);
  if (found != collocation_.end()) return found->second;
  QuasiStaticOptions options;
  options.tolerance = tolerance;
  const bool with_field = wants_field() || tolerance == kRoughTolerance;  // its validity is read
  return collocation_.emplace(tolerance, scene_.quasi_static(options, times_, with_field, most_s_))
      .first->second;
}

bool PlanSurrogate::has_collocation_as_fine_as(double tolerance) const {
  return as_fine_as(collocation_, tolerance) != nullptr;
}

const Trajectory& PlanSurrogate::collocation_as_fine_as(double tolerance) const {
  const Trajectory* made = as_fine_as(collocation_, tolerance);
  return made != nullptr ? *made : collocation(tolerance);
}

const Trajectory& PlanSurrogate::coarse() const {
  return collocation(kTolerance);
}

const Trajectory& PlanSurrogate::coarse_or_first() const {
  return has_collocation(kTolerance) ? coarse() : rough();
}

OperationCount PlanSurrogate::work_to_compare() const {
  return has_collocation(kTolerance) ? OperationCount{} : rough().work;
}

double PlanSurrogate::coarse_error() const {
  return trajectory_error(rough(), coarse(), measure_);
}

const Trajectory& PlanSurrogate::with_masses(double tolerance) const {
  const auto found = with_masses_.find(tolerance);
  if (found != with_masses_.end()) return found->second;
  return with_masses_
      .emplace(tolerance,
               scene_.inertial(inertial_options(scene_, tolerance), times_, wants_field()))
      .first->second;
}

const Trajectory& PlanSurrogate::with_masses_as_fine_as(double tolerance) const {
  const Trajectory* made = as_fine_as(with_masses_, tolerance);
  return made != nullptr ? *made : with_masses(tolerance);
}

double PlanSurrogate::finest_with_masses(double tolerance) const {
  return with_masses_.empty() ? tolerance : std::min(tolerance, with_masses_.begin()->first);
}

const InertiaEstimate& PlanSurrogate::inertia() const {
  if (!inertia_) inertia_ = estimate_inertia(scene_);
  return *inertia_;
}

double PlanSurrogate::inertia_share() const {
  return inertia().of_rates / coarse_or_first().response.cwiseAbs().maxCoeff();
}

const ContactCurves& PlanSurrogate::curves() const {
  if (curves_) return *curves_;
  double least = 0.0, most = 0.0;
  const auto see = [&](double depth) {
    least = std::min(least, kMargin * depth);
    most = std::max(most, kMargin * depth);
  };
  if (scene_.by_depth()) {
    for (const Knot& knot : scene_.protocol().knots()) see(knot.value);
  } else {
    for (const double depth : coarse().response) see(depth);
  }
  ContactCurves curves;
  curves.equilibrium = static_curve(scene_, least, most, Relaxed::all, most_s_);
  curves.relaxing = static_curve(scene_, least, most, Relaxed::nothing, most_s_);
  for (std::size_t i = 0; i < curves.equilibrium.force_N.size(); ++i) {
    curves.relaxing.force_N[i] -= curves.equilibrium.force_N[i];
  }
  curves_ = std::move(curves);
  return *curves_;
}

OperationCount PlanSurrogate::work_of_claims() const {
  OperationCount work = coarse_or_first().work;
  if (inertial_) {
    const OperationCount& rough_work = with_masses(kRoughTolerance).work;
    const auto finer = with_masses_.find(kTolerance);
    work += rough_work;
    work += finer != with_masses_.end() ? finer->second.work : rough_work.times(kFinerRunTakes);
  } else {
    work += rough().work;
  }
  return work;
}

double PlanSurrogate::claim_of(const Trajectory& model) const {
  if (!inertial_) {
    return kSafety * trajectory_error(model, coarse(), measure_) + coarse_error() + kRounding;
  }
  // By runs, not by the linear estimate: where tissue stiffens masses do more than that says.
  const Trajectory& moving = with_masses_as_fine_as(kTolerance);
  return kSafety * trajectory_error(model, moving, measure_) +
         trajectory_error(with_masses(kRoughTolerance), moving, measure_);
}

}  // namespace tpm::plan
