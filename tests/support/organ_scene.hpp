#pragma once
// An organ with its far side fixed, pushed at its contact sphere: for tests and measurements.
#include <utility>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::testing {
using namespace organ;

struct OrganScene {
  /// @param far_share spheres of the outer layer further than this share of the organ's extent
  ///   from the contact, along the push, are held
  explicit OrganScene(const Organ& organ, double far_share = 0.6)
      : network(build_network(organ, {}, "scene")), constraints(organ.size()) {
    probe.sphere = organ.contact.value_or(0);
    probe.direction = -organ.normal.col(static_cast<Eigen::Index>(probe.sphere));
    const Eigen::VectorXd along = organ.position.transpose() * probe.direction;
    const double near = along[static_cast<Eigen::Index>(probe.sphere)];
    for (std::size_t i = 0; i < organ.size(); ++i) {
      const double further = along[static_cast<Eigen::Index>(i)] - near;
      if (organ.layer[i] == 0 && further > far_share * (along.maxCoeff() - near))
        constraints.fix(i);
    }
  }

  [[nodiscard]] QuasiStaticRun run(const TpmParameters& material, const Protocol& protocol,
                                   std::span<const double> times_s,
                                   QuasiStaticOptions options) const {
    const BondSystem bonds(network, material);
    return QuasiStatic(bonds, network.organ.position, constraints, probe, std::move(options))
        .run(protocol, times_s);
  }

  Network network;
  Constraints constraints;
  Probe probe;
};

}  // namespace tpm::testing
