#pragma once
#include <Eigen/Core>
#include <span>

#include "tpmkit/tpm_element.hpp"

namespace tpm_test {

/// Depth, m, at these times of a sphere of the star under a load put on at once, from rest, without
/// tension: x'' = (F - k x + g y)/m - drag x', tau y' = x - y. The modes of its matrix are the
/// solution.
Eigen::VectorXd loaded_oscillator(const tpm::BondElement& p, double mass_kg, double drag_per_s,
                                  double load_N, std::span<const double> times_s);

}  // namespace tpm_test
