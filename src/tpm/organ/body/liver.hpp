#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tpm/organ/body/liver_surface.hpp"

namespace tpm::organ {

/// A liver filled with spheres. With a spacing, count and spacing decide the size, and of the shape
/// only the proportions count: the outer layer covers n x^2 sqrt(3)/2. Without one the shape has
/// the measures it states, and the count decides the spacing.
struct LiverRequest {
  LiverShape shape;
  std::size_t count = 424;                ///< all spheres, 2 to 1,000,000
  int layers = 2;                         ///< 1 to 100
  std::optional<double> spacing = 0.020;  ///< x, m
  std::uint64_t seed = 1;
};

/// The liver of the paper with its defaults: 424 spheres of radius 10 mm in two layers, sphere 71
/// at (0.002, 0.136, 0.057) m with normal (0, 0, -1), so that a probe that moves along +z indents
/// it.
///
/// The contact is the sphere of the outer layer nearest to the middle of the front of the right
/// lobe; the organ is turned by the smallest angle that points its normal along -z, and shifted.
/// Numbers run layer by layer from the patient's left to the right (rising x of LiverShape) and
/// wrap around, starting where the contact gets number 71, or the highest number of the inner
/// layers if that is smaller. Sphere i of a layer stands above sphere i of the next one. Throws
/// Error(bad_input).
[[nodiscard]] Organ fill_liver(const LiverRequest& request);

/// fill_liver with the defaults.
[[nodiscard]] Organ paper_liver();

}  // namespace tpm::organ
