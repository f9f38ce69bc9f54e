#pragma once
#include <algorithm>

#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/neighbours.hpp"

namespace tpm::test {

inline organ::Organ solid_of(const organ::Surface& surface, std::size_t count,
                             organ::Lattice lattice) {
  organ::SolidRequest request;
  request.count = count;
  request.lattice = lattice;
  return fill_solid(surface, request);
}

/// The least distance between spheres of a layer, over all layers, in spacings.
inline double least_distance(const organ::Organ& organ) {
  double least = 1e300;
  for (const organ::NearestDistances& layer : nearest_distances(organ)) {
    least = std::min(least, layer.min);
  }
  return least;
}

}  // namespace tpm::test
