#pragma once
// What a hand can feel.

namespace tpm {

/// Just noticeable difference of force, a share of it: matching by the elbow flexors (Jones 1989,
/// "Matching forces: constant errors and differential thresholds", Perception 18, 681-687: about 7
/// %; Tan, Srinivasan, Eberman and Cheng 1994 give the same for the output of the hand).
inline constexpr double kForceJnd = 0.07;

/// Just noticeable difference of stiffness, a share of it (Jones and Hunter 1990, "A perceptual
/// analysis of stiffness", Experimental Brain Research 79, 150-156: about 23 %; Tan and others: 8
/// to 22 %, depending on whether the work done is a cue). The lowest is used.
inline constexpr double kStiffnessJnd = 0.08;

}  // namespace tpm
