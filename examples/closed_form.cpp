// How hard does liver push back after a step to 4 mm, and which parameter matters most? Asks the
// paper's element in closed form; the component core is enough.
//
// Prints:
//     0.0 ms: 0.6135 N
//     0.1 ms: 0.4985 N
//     0.2 ms: 0.4274 N
//     1.0 ms: 0.3145 N
//     1 % more E1      changes it by +1.44 mN
//     1 % more E2      changes it by +1.48 mN
//     1 % more Eprime  changes it by +0.11 mN
//     1 % more eta1    changes it by +0.12 mN
//     1 % more spacing changes it by -0.21 mN
//     1 % more A0      changes it by +3.14 mN
//     1 % more l0      changes it by -3.14 mN
#include <cstdio>
#include <tpmkit/model.hpp>
#include <tpmkit/protocol.hpp>
#include <tpmkit/tpm_element.hpp>
#include <vector>

int main() {
  const auto model = tpm::make_closed_form();
  const tpm::TpmVector liver = tpm::to_vector(tpm::TpmParameters{});  // the paper's values
  const std::vector<double> times_s{0.0, 0.1e-3, 0.2e-3, 1e-3};
  const tpm::Response answer = model->respond(tpm::step_and_hold(4e-3, 1.0), times_s, liver,
                                              tpm::Want::values_and_sensitivity);
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    std::printf("%.1f ms: %.4f N\n", times_s[i] * 1e3, answer.value[static_cast<Eigen::Index>(i)]);
  }
  // Change of the last force by one per cent of each parameter.
  for (std::size_t j = 0; j < liver.size(); ++j) {
    const double by_one_percent =
        answer.sensitivity(3, static_cast<Eigen::Index>(j)) * 0.01 * liver[j];
    std::printf("1 %% more %-7.*s changes it by %+.2f mN\n",
                static_cast<int>(tpm::kTpmParameterTable[j].name.size()),
                tpm::kTpmParameterTable[j].name.data(), by_one_percent * 1e3);
  }
}
