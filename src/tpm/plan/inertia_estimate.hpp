#pragma once
#include "tpm/plan/plan_scene.hpp"

namespace tpm {

/// What masses do to the response where the network is linear about rest.
struct InertiaEstimate {
  double of_rates = 0.0;    ///< largest difference where what is imposed changes its rate, N or m
  double of_jumps = 0.0;    ///< the same where a load jumps; infinite where a depth does
  double lowest_Hz = 0.0;   ///< frequency of the lowest mode
  double highest_Hz = 0.0;  ///< of the highest that the contact moves
};

/// The free spheres' deviation from their balance is driven by the acceleration of the balanced
/// field u: M z'' + alpha M z' + K z = -M u (d'' + alpha d'), and changes the response by
/// -u' K z. The modes are gathered by Lanczos' method from M^(1/2) u (24 steps), which needs no
/// eigenvectors; every change of rate starts them anew, and they are summed over the protocol. K is
/// that of the lowest mode's frequency, alpha the damping of the scene. What the driven sphere's
/// own mass weighs in the drag is in it, its blows are not, as in InertialRun::response. Throws as
/// lowest_mode and masses_kg do.
[[nodiscard]] InertiaEstimate estimate_inertia(const PlanScene& scene);

}  // namespace tpm
