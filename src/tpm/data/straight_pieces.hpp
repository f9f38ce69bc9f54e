#pragma once
#include "tpmkit/protocol.hpp"

namespace tpm::data {

/// Largest distance of an organ's drive from a measured motion, in parts of its depth. Every sample
/// of a recording would be a knot, and at every knot the steps of an organ end.
inline constexpr double kMotionWithin = 2e-3;

/// Motion of an organ that follows a measured history: as few straight pieces as stay within
/// kMotionWithin of its depth beyond the contact, at every sample (Douglas and Peucker 1973). Knots
/// are samples, the first and the last among them.
/// @param contact where the tissue is met, of the history's unit
/// @param within another distance than kMotionWithin
[[nodiscard]] Protocol followed_by_organ(const Protocol& measured, double contact = 0.0,
                                         double within = kMotionWithin);

}  // namespace tpm::data
