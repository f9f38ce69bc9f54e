#pragma once
#include <vector>

#include "tpm/plan/plan_scene.hpp"

namespace tpm::plan {

/// A mode as the contact sees it.
struct SeenMode {
  double omega2 = 0.0;          ///< rad^2/s^2
  std::vector<double> weights;  ///< Gamma_0 Gamma_g omega^2 of each group g that is driven
};

/// Modes of the network with masses about rest.
struct InertiaModes {
  std::vector<SeenMode> modes;
  double lowest_Hz = 0.0;      ///< frequency of the lowest mode
  double alpha_per_s = 0.0;    ///< damping in proportion to mass
  double own_drag_kg_s = 0.0;  ///< of what an imposed depth drives, kg/s; 0 under a load
};

/// Effect of masses on the response where the network is linear about rest.
struct InertiaEstimate {
  double of_rates = 0.0;    ///< largest difference where what is imposed changes its rate, N or m
  double of_jumps = 0.0;    ///< the same where a load jumps; infinite where a depth does
  double lowest_Hz = 0.0;   ///< frequency of the lowest mode
  double highest_Hz = 0.0;  ///< of the highest that the contact moves
};

/// The free spheres' deviation from their balance is driven by the acceleration of the balanced
/// field u: M z'' + alpha M z' + K z = -M u (d'' + alpha d'), and changes the response by
/// -u' K z. The modes are gathered by Lanczos' method from M^(1/2) u (24 steps), which needs no
/// eigenvectors; every change of rate starts them anew, and they are summed over the protocol.
/// Where contacts have protocols of their own each one's balanced field drives the same modes, and
/// the response is that of the first. K is
/// that of the lowest mode's frequency, alpha the damping of the scene. What the driven sphere's
/// own mass weighs in the drag is in it, its impacts are not, as in InertialRun::response. A tool
/// whose depth is imposed needs no mass. Throws as lowest_mode and masses_kg do.
[[nodiscard]] InertiaEstimate estimate_inertia(const PlanScene& scene);

/// Part of it that no protocol changes. Throws as estimate_inertia does.
[[nodiscard]] InertiaModes inertia_modes(const PlanScene& scene);

}  // namespace tpm::plan
