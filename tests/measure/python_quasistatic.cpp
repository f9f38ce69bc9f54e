// Prints the quasi-static run of the paper's liver beside scripts/reference_quasistatic.py, force
// and time in one run: build/release/tests/measure_python_quasistatic
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <vector>

#include "python_reference.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/network_file.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

void measure() {
  const std::string source = TPM_TEST_SOURCE_DIR;
  const std::string file = (std::filesystem::temp_directory_path() / "reference_liver.h5").string();
  const Tissue tissue = read_tissue(source + "/configs/liver_scene.json");
  (void)write_network(tissue, file);
  const Organ& organ = tissue.network.organ;
  const std::size_t contact = organ.contact.value();
  const Probe probe{contact, -organ.normal.col(static_cast<Eigen::Index>(contact))};
  fmt::print("{:>8} {:>12} {:>12} {:>10} {:>9} {:>9} {:>7}\n", "tau, s", "end, N", "Python, N",
             "difference", "CPU ms", "Python ms", "ratio");
  for (const double tau : {2e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0}) {
    const TpmParameters material = TpmParameters{}.with_relaxation_time(tau);
    const BondSystem bonds(tissue.network, material);
    const QuasiStatic solver(bonds, organ.position, tissue.constraints(), probe, {});
    std::vector<double> taken;
    Eigen::VectorXd force;
    for (int i = 0; i < 7; ++i) {
      const std::clock_t start = std::clock();
      force = solver.run(ramp_and_hold(8e-3, 4e-3, 29.0), std::vector<double>{2.0, 31.0}).response;
      taken.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    std::sort(taken.begin(), taken.end());
    const Json reference = tpm_test::python_reference("reference_quasistatic.py",
                                                      fmt::format("'{}' --tau {}", file, tau));
    const double end_N = reference.at("force_at_end_N").get<double>();
    const double python_ms = 1e3 * reference.at("cpu_s").get<double>();
    const double median_ms = taken[taken.size() / 2];
    fmt::print("{:>8g} {:>12.8f} {:>12.8f} {:>10.1e} {:>9.2f} {:>9.0f} {:>7.0f}\n", tau, force[1],
               end_N, std::abs(force[1] - end_N) / force[0], median_ms, python_ms,
               python_ms / median_ms);
  }
}

}  // namespace

int main() {
  try {
    measure();
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
