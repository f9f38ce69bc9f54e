#pragma once
#include <span>

#include "tpmkit/protocol.hpp"

namespace tpm {

/// How far from a measured motion an organ may be driven, in parts of the depth. Every sample of a
/// recording would be a knot, and at every knot the steps of an organ end.
inline constexpr double kMotionWithin = 2e-3;

/// A measured history in as few straight pieces as keep it within a distance at every sample
/// (Douglas and Peucker 1973), of values at a time. Its knots are samples, the first and the last
/// among them.
/// @param within of the values' unit
[[nodiscard]] Protocol in_straight_pieces(Drive drive, std::span<const double> time_s,
                                          std::span<const double> value, double within);

/// What an organ follows of a measured history: straight pieces within kMotionWithin of its depth.
[[nodiscard]] Protocol followed_by_organ(const Protocol& measured);

}  // namespace tpm
