#include "tpm/law/relaxation/laplace_contour.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace tpm::law {

namespace {

/// Half of the nodes; the others are their complex conjugates.
constexpr std::size_t kHalf = 20;

std::array<ContourNode, kHalf> parabola() {
  using std::numbers::pi;
  constexpr double kCount = kHalf;
  constexpr double kStep = 3.0 / kCount;
  constexpr double kMu = pi * kCount / 12.0;
  std::array<ContourNode, kHalf> nodes;
  for (std::size_t k = 0; k < kHalf; ++k) {
    const std::complex<double> root(1.0, (static_cast<double>(k) + 0.5) * kStep);
    const std::complex<double> s = kMu * root * root;
    // ds/du / (2 pi i) = mu root / pi, and twice for the conjugate
    nodes[k] = {s, std::log(s), 2.0 * kStep * kMu / pi * root * std::exp(s)};
  }
  return nodes;
}

}  // namespace

std::span<const ContourNode> contour_nodes() {
  static const std::array<ContourNode, kHalf> nodes = parabola();
  return nodes;
}

}  // namespace tpm::law
