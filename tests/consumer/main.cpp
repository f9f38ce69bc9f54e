// Asks the installed library for the printed number of the paper's Sec. 4.2: 4 mm at x = 30 mm give
// 0.613 N at once (the paper cuts digits off).
#include <cmath>
#include <cstdio>

#include <tpmkit/model.hpp>
#include <tpmkit/tpm_element.hpp>
#include <tpmkit/version.hpp>

int main() {
  const auto model = tpm::make_model("closed_form");
  const double at_start = 0.0;
  const tpm::TpmVector paper = tpm::to_vector(tpm::TpmParameters{});
  const tpm::Response response =
      model->respond(tpm::step_and_hold(4e-3, 30.0), {&at_start, 1}, paper, tpm::Want::values);
  const double force_N = response.value[0];
  std::printf("tpmkit %s: %.4f N\n", std::string(tpm::version()).c_str(), force_N);
  return std::floor(force_N * 1e3) == 613.0 ? 0 : 1;
}
