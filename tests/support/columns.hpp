#pragma once
#include <utility>
#include <vector>

#include "tpm/organ/bonds/network.hpp"

namespace tpm::test {
using namespace organ;

/// Columns of two spheres with one radial bond each, side by side along x; the top of each lower by
/// a step than that before it.
inline organ::Network columns(int count, double step_m) {
  organ::Organ organ;
  organ.name = "columns";
  organ.position.resize(3, 2 * count);
  std::vector<organ::NeighbourPair> pairs;
  for (int i = 0; i < count; ++i) {
    organ.position.col(2 * i) = Eigen::Vector3d(0.05 * i, 0, step_m * i);
    organ.position.col(2 * i + 1) = Eigen::Vector3d(0.05 * i, 0, step_m * i + 0.02);
    organ.layer.insert(organ.layer.end(), {0, 1});
    pairs.push_back({organ.layer.size() - 2, organ.layer.size() - 1});
  }
  organ.normal = Eigen::Vector3d(0, 0, -1).replicate(1, 2 * count);
  organ.radius = 0.01;
  organ.spacing = 0.02;
  return join(std::move(organ), pairs, {.rule = organ::StiffnessRule::per_bond}, "test");
}

}  // namespace tpm::test
