#include "tpm/network/material_directions.hpp"

namespace tpm {

std::array<TangentDirection, 3> material_directions(const Network& network,
                                                    const TpmParameters& material) {
  // Radial: k ~ E2, g ~ E2^2/(E1 + E2), tau = eta1/(E1 + E2). Lateral: k ~ E'.
  const double sum_Pa = material.E1_Pa + material.E2_Pa;
  const double share2 = material.E2_Pa / sum_Pa;
  const auto size = static_cast<Eigen::Index>(network.bonds.size());
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd radial = zero;
  Eigen::VectorXd lateral = zero;
  for (Eigen::Index i = 0; i < size; ++i) {
    const Bond& bond = network.bonds[static_cast<std::size_t>(i)];
    Eigen::VectorXd& kind = bond.kind == BondKind::radial ? radial : lateral;
    kind[i] = bond.factor * material.modulus_to_stiffness_m();
  }
  return {{{zero, -share2 * share2 * radial, -1.0 / sum_Pa, 0.0},
           {radial, (2.0 - share2) * share2 * radial, -1.0 / sum_Pa, 0.0},
           {lateral, zero, 0.0, 0.0}}};
}

}  // namespace tpm
