#include "tpm/plan/plan_reference.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

// Of the reference without masses, in parts of the plan's; tighter while the cross-check disagrees.
constexpr double kReferenceShare = 1e-3, kTightestReference = 1e-10, kTighterReference = 1e-2;
constexpr double kCheckTimesReference = 10.0;  // the tolerance of the cross-check
constexpr int kCheckStages = 3;
constexpr double kInertialTolerance = 1e-6, kTighter = 0.1, kTightest = 1e-8;
constexpr double kAgreement = 0.1;  // of the tolerance

}  // namespace

VerifiedReference verified_reference(const PlanSurrogate& surrogate, double tolerance) {
  VerifiedReference reference;
  const PlanScene& scene = surrogate.scene();
  const PlanMeasure& measure = surrogate.measure();
  const bool field = surrogate.wants_field();
  reference.times_s = surrogate.times_of_reference();
  Trajectory cross_check;
  if (surrogate.inertial()) {
    // Errors gather over the periods of ringing, which few steps of a rise do not show: as tight as
    // it takes for the two to agree.
    for (double own = kInertialTolerance;; own *= kTighter) {
      reference.trajectory =
          reference.times_s == surrogate.times()
              ? surrogate.with_masses(own)
              : scene.inertial(inertial_options(scene, own), reference.times_s, field);
      InertialOptions other = inertial_options(scene, kCheckTimesReference * own);
      other.formula = MotionFormula::trapezoidal;
      cross_check = scene.inertial(other, reference.times_s, field);
      reference.reference.method =
          fmt::format("network with masses, BDF of order 2, tolerance {}", shortest(own));
      reference.reference.cross_check =
          fmt::format("trapezoidal rule, tolerance {}", significant(kCheckTimesReference * own, 3));
      const double apart = trajectory_error(cross_check, reference.trajectory, measure);
      if (apart <= kAgreement * tolerance || own < kTightest * (1.0 + kTighter)) break;
    }
  } else {
    for (double own = std::max(kReferenceShare * tolerance, kTightestReference);;
         own = std::max(kTighterReference * own, kTightestReference)) {
      reference.trajectory = surrogate.collocation(own);
      QuasiStaticOptions options;
      options.tolerance = kCheckTimesReference * own;
      options.stages = kCheckStages;
      cross_check = scene.quasi_static(options, reference.times_s, field);
      reference.reference.method =
          fmt::format("nonlinear network, Radau collocation of {} stages, tolerance {}", kLanes,
                      significant(own, 3));
      reference.reference.cross_check =
          fmt::format("Radau collocation of {} stages, tolerance {}", kCheckStages,
                      significant(kCheckTimesReference * own, 3));
      const double apart = trajectory_error(cross_check, reference.trajectory, measure);
      if (apart <= kAgreement * tolerance || own <= kTightestReference) break;
    }
  }
  reference.work += reference.trajectory.work;
  reference.work += cross_check.work;
  reference.reference.peak = reference.trajectory.response.cwiseAbs().maxCoeff();
  if (!(reference.reference.peak > 0.0)) {
    throw bad_input("scene", "nothing is imposed, or nothing answers", "a protocol with a peak");
  }
  reference.reference.difference = trajectory_error(cross_check, reference.trajectory, measure);
  reference.reference.response_difference = trajectory_error(cross_check, reference.trajectory, {});
  if (reference.reference.difference <= kAgreement * tolerance) return reference;
  throw Error(
      ExitCode::numerical, "reference",
      fmt::format("it and its cross-check differ by {} of the peak",
                  significant(reference.reference.difference, 2)),
      fmt::format("at most {}: a looser tolerance", significant(kAgreement * tolerance, 2)));
}

}  // namespace tpm::plan
