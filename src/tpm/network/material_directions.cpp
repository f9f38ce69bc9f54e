#include "tpm/network/material_directions.hpp"

namespace tpm {

std::array<TangentDirection, 3> material_directions(const Network& network, const BondSystem& bonds,
                                                    const TpmParameters& material) {
  // Radial: k ~ E2, g ~ E2^2/(E1 + E2), tau = eta1/(E1 + E2). Lateral: k ~ E'.
  const double share1 = material.E1_Pa / (material.E1_Pa + material.E2_Pa);
  const double share2 = 1.0 - share1;
  const Eigen::VectorXd& k = bonds.stiffness();
  const Eigen::VectorXd& g = bonds.relaxing();
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(k.size());
  Eigen::VectorXd radial = zero;
  for (Eigen::Index i = 0; i < k.size(); ++i) {
    if (network.bonds[static_cast<std::size_t>(i)].kind == BondKind::radial) radial[i] = k[i];
  }
  return {{{zero, -share1 * g, -share1, 0.0},
           {radial, (2.0 - share2) * g, -share2, 0.0},
           {k - radial, zero, 0.0, 0.0}}};
}

}  // namespace tpm
