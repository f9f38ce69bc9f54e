#pragma once
#include <span>
#include <vector>

#include "tpmkit/law_file.hpp"

namespace tpm::haptics {

/// The force of a law with branches along a motion that is linear between instants, by Gauss's rule
/// with eight points on each stretch of the integral of G dV: another way to the same number than
/// the loop's update and than LawModel's quadrature. One-sided: where the force would pull, it is
/// 0. Contact point and offset are taken as 0.
/// @param depth_m from the surface; the contact begins at rest
/// Throws Error(bad_input) for a fractional law.
[[nodiscard]] std::vector<double> law_forces_by_gauss(const LawFile& law,
                                                      std::span<const double> time_s,
                                                      std::span<const double> depth_m);

}  // namespace tpm::haptics
