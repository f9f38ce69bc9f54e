#pragma once
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm_measure {

/// Spheres of the outer layer beyond 60 % of the organ's extent along z are fixed.
inline tpm::organ::Constraints held_on_the_far_side(const tpm::organ::Organ& organ) {
  tpm::organ::Constraints constraints(organ.size());
  const Eigen::RowVectorXd z = organ.position.row(2);
  const double limit = z.minCoeff() + 0.6 * (z.maxCoeff() - z.minCoeff());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 0 && z[static_cast<Eigen::Index>(i)] > limit) constraints.fix(i);
  }
  return constraints;
}

}  // namespace tpm_measure
