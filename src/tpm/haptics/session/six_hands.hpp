#pragma once
#include <array>
#include <string>

#include "tpm/haptics/session/rendering_boundary.hpp"

namespace tpm::haptics {

/// A hand on the handle of a device, for which a rendering has to be safe: arm and moving parts
/// together, apart from the viscous friction of the device.
struct SafeHand {
  const char* name;
  double mass_kg;
  double damping_N_s_per_m;
  double stiffness_N_per_m;
};

/// The hands that the gate before a session guards. They span moving masses of 0.2 to 0.85 kg,
/// damping of 0.2 to 6.5 N s/m and stiffness of 5 to 300 N/m; the last one is a published fit of an
/// operator's arm (0.554 kg, 6.45 N s/m, 135 N/m) with 0.3 kg of an Omega.7. The others are
/// assumed.
inline constexpr std::array<SafeHand, 6> kSafeHands{{
    {"light and limp", 0.20, 0.2, 5.0},
    {"light and stiff", 0.20, 0.2, 300.0},
    {"resting", 0.30, 1.0, 50.0},
    {"gripping", 0.40, 2.0, 300.0},
    {"heavy and limp", 0.85, 0.2, 5.0},
    {"published", 0.85, 6.5, 135.0},
}};

/// Most energy that a rendering may put into any of these hands before forces are off, J.
inline constexpr double kMostIntoHand_J = 5e-3;

/// Delay of hardware whose delay nobody has measured, both paths, s.
inline constexpr double kUnmeasuredDelay_s = 0.020;

/// Longest measured delay for which it was tried that none of the hands receives kMostIntoHand_J
/// (reports/haptics/report.md), and the longest that the supervisor supposes, s. Hardware with a
/// longer one is refused.
inline constexpr double kLongestDelay_s = 0.020;

/// Largest stiffness that is rendered, N/m:
///
///     K (T/2 + delay) <= b + 1 N s/m,
///
/// the condition of passivity (Colgate and Schenkel) with 1 N s/m in addition to the friction b of
/// the device. Beyond passivity the rendering feeds a hand that damps little; with 1 N s/m in
/// excess it does so slowly enough for the supervisor, which stops at 2 mJ: none of kSafeHands
/// receives kMostIntoHand_J. Found by simulation (tests/measure/hands.cpp, docs/safety.md), not
/// derived.
[[nodiscard]] double largest_stiffness_for_hands(double delay_s, double friction_N_s_per_m,
                                                 double period_s);

/// Names of the hands with which the linear loop of device, hand and contact is stable; "none".
/// @param friction_N_s_per_m of the device
[[nodiscard]] std::string hands_that_are_stable(const RenderedContact& contact,
                                                double friction_N_s_per_m);

/// A device in such a hand, for simulations. @param friction_N_s_per_m of the device
[[nodiscard]] PlantSettings plant_with_hand(const SafeHand& hand, double friction_N_s_per_m);

}  // namespace tpm::haptics
