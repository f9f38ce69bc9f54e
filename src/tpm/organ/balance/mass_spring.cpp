#include "tpm/organ/balance/mass_spring.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

double contact_stiffness_N_per_m(const BondSystem& bonds, const Positions& rest,
                                 const Constraints& constraints, const Probe& probe,
                                 double relaxation_factor) {
  require_valid(probe, constraints);
  require_rigid(bonds, rest, constraints, "contact stiffness");
  const ViscousState viscous_state{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())),
                                   relaxation_factor};
  Equilibrium equilibrium(bonds, constraints);
  if (!equilibrium.factorise(rest, viscous_state)) {
    throw Error(ExitCode::numerical, "contact stiffness", "the stiffness cannot be factorised");
  }
  const auto column = static_cast<Eigen::Index>(probe.sphere);
  Eigen::Matrix3Xd displacement = Eigen::Matrix3Xd::Zero(3, rest.cols());
  displacement.col(column) = probe.direction;  // 1 N
  equilibrium.displace(displacement);
  return 1.0 / displacement.col(column).dot(probe.direction);
}

Network msm_network(const Network& network, SpringRule rule) {
  Network msm = network;
  for (Bond& bond : msm.bonds) {
    bond.kind = BondKind::lateral;
    if (rule == SpringRule::equal) bond.factor = 1.0;
  }
  return msm;
}

BondMaterial msm_material(const Network& msm, const Constraints& constraints, const Probe& probe,
                          double stiffness_N_per_m) {
  if (!(stiffness_N_per_m > 0.0) || !std::isfinite(stiffness_N_per_m)) {
    throw bad_input("mass-spring model",
                    fmt::format("a contact stiffness of {} N/m", shortest(stiffness_N_per_m)),
                    "a stiffness above 0");
  }
  BondMaterial material;
  material.lateral_Pa = 1e4;  // any will do: the stiffness is in proportion to it
  const double per_Pa = contact_stiffness_N_per_m(BondSystem(msm, material), msm.organ.position,
                                                  constraints, probe, 0.0) /
                        material.lateral_Pa;
  material.lateral_Pa = stiffness_N_per_m / per_Pa;
  return material;
}

}  // namespace tpm::organ
