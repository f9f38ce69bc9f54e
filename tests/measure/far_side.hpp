#pragma once
#include "tpm/network/freedom.hpp"

namespace tpm_measure {

/// Spheres of the outer layer beyond 60 % of the organ's extent along z are held.
inline tpm::Freedom held_on_the_far_side(const tpm::Organ& organ) {
  tpm::Freedom freedom(organ.size());
  const Eigen::RowVectorXd z = organ.position.row(2);
  const double limit = z.minCoeff() + 0.6 * (z.maxCoeff() - z.minCoeff());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 0 && z[static_cast<Eigen::Index>(i)] > limit) freedom.hold(i);
  }
  return freedom;
}

}  // namespace tpm_measure
