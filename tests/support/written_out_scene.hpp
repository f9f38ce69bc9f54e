#pragma once
// A liver of 30 spheres under a ramp, as a network of tpm and with every branch written out.
#include <algorithm>
#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "organ_scene.hpp"
#include "tpm/law/relaxation/fractional_branches.hpp"
#include "tpm/organ/body/liver.hpp"
#include "written_out_network.hpp"

namespace tpm_test {
using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm::testing::OrganScene;

/// A material of branches with an equilibrium modulus; the relaxing share of the whole is given.
inline BondMaterial material_of(std::vector<double> times, double relaxing_share) {
  BondMaterial m;
  constexpr double kWhole_Pa = 12e3;
  m.equilibrium_Pa = (1.0 - relaxing_share) * kWhole_Pa;
  double weights = 0.0;
  for (std::size_t j = 0; j < times.size(); ++j) weights += 1.0 + 0.3 * static_cast<double>(j);
  for (std::size_t j = 0; j < times.size(); ++j) {
    const double share = (1.0 + 0.3 * static_cast<double>(j)) / weights;
    m.branches.push_back({relaxing_share * kWhole_Pa * share, times[j]});
  }
  m.lateral_Pa = 12e3;
  return m;
}

inline BondMaterial fractional_material() {
  BondMaterial m;
  m.equilibrium_Pa = 4e3;
  const FractionalBranches sum = fractional_branches(0.4, 0.5, {1e-2, 100.0, 2e-3}, 20);
  m.equilibrium_Pa += 8e3 * sum.constant;
  for (const auto& [share, time] : sum.branches) m.branches.push_back({8e3 * share, time});
  m.lateral_Pa = 12e3;
  return m;
}

inline Organ small_liver(std::size_t count) {
  LiverRequest request;
  request.count = count;
  return fill_liver(request);
}

inline const OrganScene& small_scene() {
  static const OrganScene scene(small_liver(30));
  return scene;
}

constexpr double kDepth = 6e-3, kRamp = 1.5;
inline const std::vector<double> kTimes{0.2, 0.75, 1.5, 1.55, 2.0, 4.0};

inline Protocol ramp() {
  return {Drive::displacement, {{0.0, 0.0}, {kRamp, kDepth}, {4.0, kDepth}}, "ramp"};
}

struct Pair {
  QuasiStaticRun run;
  std::vector<double> reference;
};

inline Pair both(const MaterialField& field, std::vector<WrittenBond> bonds,
                 double tolerance = 1e-7) {
  const OrganScene& scene = small_scene();
  const BondSystem system(scene.network, field);
  Pair pair;
  pair.run = QuasiStatic(system, scene.network.organ.position, scene.constraints, scene.probe,
                         {.tolerance = tolerance, .energies = true})
                 .run(ramp(), kTimes);
  WrittenNetwork written(scene.network, std::move(bonds), scene.constraints, scene.probe);
  pair.reference = written_ramp(written, kDepth, kRamp, kTimes);
  return pair;
}

inline void check_pair(const Pair& pair) {
  const double peak = *std::max_element(pair.reference.begin(), pair.reference.end());
  for (std::size_t i = 0; i < kTimes.size(); ++i) {
    CAPTURE(kTimes[i]);
    CHECK_THAT(pair.run.response[static_cast<Eigen::Index>(i)],
               WithinAbs(pair.reference[i], 1e-6 * peak));
  }
  const QuasiStaticEnergy& energy = pair.run.energy.value();
  CHECK(energy.dissipated_J > 0.0);
  CHECK_THAT(energy.stored_J + energy.dissipated_J, WithinRel(energy.work_J, 1e-5));
}

}  // namespace tpm_test
