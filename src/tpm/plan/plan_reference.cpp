#include "tpm/plan/plan_reference.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/core/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
namespace {

constexpr int kTimesOfPiece = 64;
constexpr int kMostTimes = 800;
constexpr int kTimesOfPieceWithMasses = 640;
constexpr int kMostTimesWithMasses = 3000;
constexpr double kTolerance = 1e-10, kJudgeTolerance = 1e-9;
constexpr int kJudgeStages = 3;
constexpr double kInertialTolerance = 1e-6, kTighter = 0.1, kTightest = 1e-8;
constexpr int kJudgeOrder = 3;
constexpr double kAgreement = 0.1;  // of the tolerance

}  // namespace

VerifiedReference verified_reference(const PlanScene& scene, const PlanMeasure& measure,
                                     bool inertial, double tolerance) {
  VerifiedReference reference;
  const bool field = measure.output == PlanOutput::field;
  const double tau_s = scene.driven().bonds.shortest_relaxation_time_s();
  Trajectory cross_check;
  if (inertial) {
    reference.times_s =
        sampled_times(scene.protocol(), kTimesOfPieceWithMasses, kMostTimesWithMasses, tau_s);
    // Errors gather over the periods of ringing, which few steps of a rise do not show: as tight as
    // it takes for the two to agree.
    for (double own = kInertialTolerance;; own *= kTighter) {
      reference.trajectory = scene.inertial(inertial_options(scene, own), reference.times_s, field);
      InertialOptions other = inertial_options(scene, own);
      other.newton = NewtonSolver::klu;
      other.highest_order = kJudgeOrder;
      cross_check = scene.inertial(other, reference.times_s, field);
      reference.reference.method =
          fmt::format("network with masses, BDF of order 2, tolerance {}", shortest(own));
      reference.reference.cross_check =
          fmt::format("BDF of order 3 with KLU, tolerance {}", shortest(own));
      const double apart = trajectory_error(cross_check, reference.trajectory, measure);
      if (apart <= kAgreement * tolerance || own < kTightest * (1.0 + kTighter)) break;
    }
  } else {
    reference.times_s = sampled_times(scene.protocol(), kTimesOfPiece, kMostTimes, tau_s);
    QuasiStaticOptions options;
    options.tolerance = kTolerance;
    reference.trajectory = scene.quasi_static(options, reference.times_s, field);
    options.tolerance = kJudgeTolerance;
    options.stages = kJudgeStages;
    cross_check = scene.quasi_static(options, reference.times_s, field);
    reference.reference.method =
        fmt::format("nonlinear network, Radau collocation of {} stages, tolerance {}", kLanes,
                    shortest(kTolerance));
    reference.reference.cross_check = fmt::format("Radau collocation of {} stages, tolerance {}",
                                                  kJudgeStages, shortest(kJudgeTolerance));
  }
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

}  // namespace tpm
