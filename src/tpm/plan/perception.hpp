#pragma once
// What a hand can feel.

namespace tpm {

/// Just noticeable difference of force, a share of it: between thumb and finger (Pang, Tan and
/// Durlach 1991: about 7 %). docs/plan.md says what was looked up.
inline constexpr double kForceJnd = 0.07;

/// Just noticeable difference of stiffness, a share of it: 8 to 23 %, depending on whether work and
/// the last force are cues (Tan and others 1995; Jones and Hunter 1990). The lowest is used.
inline constexpr double kStiffnessJnd = 0.08;

}  // namespace tpm
