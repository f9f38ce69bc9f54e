// The condensed contact on the 424 spheres of the paper.
#include <catch2/catch.hpp>

#include "condensed_passivity.hpp"
#include "expected_values.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/scene.hpp"

using namespace tpm;
using namespace tpm::contact;
using namespace tpm::testing;

namespace {

struct Liver {
  explicit Liver(const std::string& file)
      : tissue(read_tissue(std::string(TPM_TEST_SOURCE_DIR) + "/configs/" + file)),
        contact(tissue.network.organ.contact.value()),
        into(-tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact))),
        built(build_condensed(tissue.bonds(), tissue.network.organ.position, tissue.constraints(),
                              contact, into)) {}
  Tissue tissue;
  std::size_t contact;
  Eigen::Vector3d into;
  CondensedContact built;
};

/// Ramp to 8 mm and hold, against the quasi-static network in fixed steps.
double error_of_ramp(const Liver& liver, double relaxation_time_s, double ramp_s, double hold_s) {
  const BondSystem bonds(liver.tissue.network,
                         liver.tissue.element().with_relaxation_time(relaxation_time_s));
  Constraints constraints = liver.tissue.constraints();
  constraints.slide(liver.contact, liver.into);
  CondensedContact contact = liver.built.with_relaxation_time(relaxation_time_s);
  std::vector<double> times;
  std::vector<double> forces;
  const auto steps = static_cast<int>(std::lround((ramp_s + hold_s) / contact.period_s()));
  for (int i = 1; i <= steps; ++i) {
    const double t = contact.period_s() * i;
    const double depth = 8e-3 * std::min(1.0, t / ramp_s);
    const double force = -contact.step(depth * liver.into).force_N.dot(liver.into);
    if (i % std::max(1, steps / 100) != 0) continue;
    times.push_back(std::min(t, ramp_s + hold_s));
    forces.push_back(force);
  }
  QuasiStaticOptions options;
  options.tolerance = 1e-9;
  options.step_s = 0.5 * relaxation_time_s;
  const QuasiStaticRun run = QuasiStatic(bonds, liver.tissue.network.organ.position, constraints,
                                         Probe{liver.contact, liver.into}, options)
                                 .run(ramp_and_hold(8e-3, 8e-3 / ramp_s, hold_s), times);
  double error = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    error = std::max(error, std::abs(forces[i] - run.response[static_cast<Eigen::Index>(i)]));
  }
  return error / run.response.maxCoeff();
}

}  // namespace

TEST_CASE("ramps into the paper's liver, its far side fixed", "[condensed]") {
  const Liver liver("liver_scene.json");
  CHECK(error_of_ramp(liver, 0.02, 0.08, 0.1) <
        test::allowed_error("condensed.paper_liver_far_side_fixed"));
  CHECK(error_of_ramp(liver, 0.1, 0.08, 0.3) <
        test::allowed_error("condensed.paper_liver_far_side_fixed"));
  CHECK(error_of_ramp(liver, 1.0, 2.0, 3.0) <
        test::allowed_error("condensed.paper_liver_far_side_fixed"));
}

TEST_CASE("ramps into the paper's liver, its inner layer fixed", "[condensed]") {
  const Liver liver("liver_inner_fixed_scene.json");
  CHECK(error_of_ramp(liver, 0.02, 0.08, 0.1) <
        test::allowed_error("condensed.paper_liver_inner_layer_fixed"));
  CHECK(error_of_ramp(liver, 1.0, 0.08, 1.0) <
        test::allowed_error("condensed.paper_liver_inner_layer_fixed"));
}

// A million steps each: measure_condensed (reports/methods).
TEST_CASE("random steps in the paper's liver create no energy", "[condensed]") {
  constexpr int kSteps = 250'000;
  const Liver liver("liver_scene.json");
  for (const double tau : {2e-4, 0.01, 1.0, 100.0}) {
    CAPTURE(tau);
    CondensedContact contact = liver.built.with_relaxation_time(tau);
    const EnergyAccount account =
        account_of_random_motion(contact, liver.into, CondensedOptions{}, kSteps, 0);
    CHECK(account.created_J < 1e-13 * account.highest_J);
    CHECK(account.least_J > -1e-13 * account.highest_J);
  }
}
