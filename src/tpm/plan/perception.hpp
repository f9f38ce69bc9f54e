#pragma once
// Thresholds of perception of a hand.

namespace tpm::plan {

/// Just noticeable difference of force, a share of it: between thumb and finger (Pang, Tan and
/// Durlach 1991: about 7 %). docs/theory.md lists the sources.
inline constexpr double kForceJnd = 0.07;

/// Just noticeable difference of stiffness, a share of it: 8 to 23 %, depending on whether work and
/// the last force are cues (Tan and others 1995; Jones and Hunter 1990). The lowest is used.
inline constexpr double kStiffnessJnd = 0.08;

/// Just noticeable difference of viscosity, a share of it: by forced choice, and by adjustment
/// (Jones, Hunter and Lafontaine, Perception 26 (1997) 1571, abstract).
inline constexpr double kViscosityJnd = 0.19, kViscosityAdjusted = 0.34;

/// Just noticeable difference of the compliance of silicone that is touched, a share of its Young's
/// modulus, and of one whose surface does not deform under the finger, as through a tool: "more
/// than trebled" (Bergmann Tiest and Kappers, IEEE Trans. Haptics 2 (2009), doi
/// 10.1109/TOH.2009.16, abstract).
inline constexpr double kStiffnessTouched = 0.15, kStiffnessThroughTool = 0.45;

}  // namespace tpm::plan
