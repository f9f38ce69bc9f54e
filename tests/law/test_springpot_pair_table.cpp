// Laws of two spring-pots against a table of 20 digits.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "step_response.hpp"
#include "tpm/files/file.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::law;
using namespace tpm::files;

TEST_CASE("G, J, G' and G'' of two spring-pots agree with the table of 20 digits", "[pair]") {
  std::istringstream table(
      read_file(std::string(TPM_TEST_SOURCE_DIR) + "/tests/fixtures/springpot_laws.csv"));
  std::map<std::string, std::array<double, 4>> worst;  // of G, J, storage and loss, relative
  int rows = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with("#") || line.starts_with("law,")) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    std::string law;
    std::array<double, 7> x{};
    cells >> law;
    for (double& number : x) cells >> number;
    const auto [alpha, beta, t, modulus, compliance, storage, loss] = x;
    const LawSpec spec = parse_law_name("linear-" + law, "test");
    std::vector<double> values;
    for (const LawParameter& q : law_parameters(spec)) {
      values.push_back(q.name == "k1"      ? 2.0
                       : q.name == "k2"    ? 3.0
                       : q.name == "alpha" ? alpha
                       : q.name == "beta"  ? beta
                       : q.nuisance        ? 0.0
                                           : 1.0);  // k_inf and tau1
    }
    const std::vector<double> frequency{0.5 / (std::numbers::pi * t)};
    const auto spectrum = respond_spectrum(spec, values, frequency, std::nullopt, Want::values);
    const std::array<double, 4> off{law_relaxation(spec, values, t).value / modulus - 1.0,
                                    law_creep(spec, values, t).value / compliance - 1.0,
                                    spectrum.storage[0] / storage - 1.0,
                                    spectrum.loss[0] / loss - 1.0};
    for (std::size_t i = 0; i < off.size(); ++i) {
      worst[law][i] = std::max(worst[law][i], std::abs(off[i]));
    }
    ++rows;
  }
  CHECK(rows == 3 * 6 * 10);
  for (const auto& [law, off] : worst) {
    INFO(law << ": largest relative difference of G " << off[0] << ", J " << off[1] << ", G' "
             << off[2] << ", G'' " << off[3]);
    CHECK(*std::max_element(off.begin(), off.end()) < 1e-9);
  }
}
