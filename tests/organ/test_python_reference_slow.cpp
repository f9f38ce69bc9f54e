// Against independent implementations in numpy and scipy that share no code.
#include <catch2/catch.hpp>
#include <vector>

#include "python_reference.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/network_file.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm_test::python_reference;

TEST_CASE("an independent optimiser finds the same minimum of the relaxation problem") {
  const std::string source = TPM_TEST_SOURCE_DIR;
  FitConfig config = read_fit_config(source + "/configs/liver_relaxation.json");
  config.profiles = false;
  config.hypotheses.clear();
  for (const int rate : {1, 2, 4}) {
    CAPTURE(rate);
    config.data[0].protocol.rate_m_per_s = rate * 1e-3;
    const FitResult fit = run_fit(config);
    const Json reference =
        python_reference("reference_relaxation.py",
                         fmt::format("'{}/data/evren_relaxation.csv' --rate {}", source, rate));
    CHECK_THAT(fit.chi_square, WithinRel(reference.at("chi_square").get<double>(), 1e-5));
    CHECK_THAT(fit.best.natural[0], WithinRel(reference.at("E_Pa").get<double>(), 1e-5));
    CHECK_THAT(fit.best.natural[1], WithinRel(reference.at("eta1_Pa_s").get<double>(), 1e-5));
  }
}

TEST_CASE(
    "an independent solver finds the same contact force of the liver at every step, pushed and "
    "held") {
  const std::string source = TPM_TEST_SOURCE_DIR;
  const std::string file = std::string(TPM_TEST_BINARY_DIR) + "/reference_liver.h5";
  const Tissue tissue = read_tissue(source + "/configs/liver_scene.json");
  (void)write_network(tissue, file);
  const Organ& organ = tissue.network.organ;
  const std::size_t contact = organ.contact.value();
  const Probe probe{contact, -organ.normal.col(static_cast<Eigen::Index>(contact))};
  for (const double tau : {0.5, 10.0}) {
    CAPTURE(tau);
    const BondSystem bonds(tissue.network, TpmParameters{}.with_relaxation_time(tau));
    const Json reference =
        python_reference("reference_quasistatic.py", fmt::format("'{}' --tau {}", file, tau));
    const auto times_s = reference.at("time_s").get<std::vector<double>>();
    const auto expected_N = reference.at("force_N").get<std::vector<double>>();
    const double peak_N = reference.at("force_at_peak_N").get<double>();
    REQUIRE(times_s.size() >= 19);
    const Eigen::VectorXd force =
        QuasiStatic(bonds, organ.position, tissue.constraints(), probe, {.tolerance = 1e-8})
            .run(ramp_and_hold(8e-3, 4e-3, 29.0), times_s)
            .response;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      CAPTURE(times_s[i]);
      CHECK_THAT(force[static_cast<Eigen::Index>(i)], WithinAbs(expected_N[i], 1e-6 * peak_N));
    }
  }
}
