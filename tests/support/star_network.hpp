#pragma once
// The four-sphere star of docs/theory.md as a network.
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/bonds/network.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm_test {
using namespace tpm::organ;

/// B between A and C at the spacing, its partner D below; only B may move.
inline tpm::organ::Organ star_organ(double spacing) {
  tpm::organ::Organ organ;
  organ.name = "star";
  organ.position.resize(3, 4);
  organ.position << 0, -spacing, spacing, 0,  //
      0, 0, 0, 0,                             //
      0, 0, 0, 0.02;
  organ.normal = Eigen::Vector3d(0, 0, -1).replicate(1, 4);
  organ.layer = {0, 0, 0, 1};
  organ.radius = 0.01;
  organ.spacing = spacing;
  organ.contact = 0;
  return organ;
}

struct Star {
  explicit Star(const tpm::TpmParameters& p)
      : network(tpm::organ::join(star_organ(p.spacing_m), pairs(), {}, "star")),
        bonds(network, p),
        constraints(4) {
    constraints.slide(0, Eigen::Vector3d::UnitZ());
    for (const std::size_t i : {1, 2, 3}) constraints.fix(i);
  }
  static const std::vector<tpm::organ::NeighbourPair>& pairs() {
    static const std::vector<tpm::organ::NeighbourPair> list{{0, 1}, {0, 2}, {0, 3}};
    return list;
  }
  [[nodiscard]] tpm::organ::QuasiStaticRun run(const tpm::Protocol& protocol,
                                               std::span<const double> times,
                                               tpm::organ::QuasiStaticOptions options) const {
    return tpm::organ::QuasiStatic(bonds, network.organ.position, constraints, probe(),
                                   std::move(options))
        .run(protocol, times);
  }
  [[nodiscard]] static tpm::organ::Probe probe() { return {0, Eigen::Vector3d::UnitZ()}; }
  tpm::organ::Network network;
  tpm::organ::BondSystem bonds;
  tpm::organ::Constraints constraints;
};

inline std::vector<double> even_times(double end, int n) {
  std::vector<double> times;
  for (int i = 0; i <= n; ++i) times.push_back(end * i / n);
  return times;
}

}  // namespace tpm_test
