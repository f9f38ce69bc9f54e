// The component fit alone: the fit of a recording that the law itself made.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <tpmkit/fit.hpp>

int main() {
  std::ofstream file("made.csv");
  file << "time [s],depth [mm],force [N]\n";
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.05 * i, depth_mm = std::min(2.0, 2.0 * t);
    // A ramp of 2 mm/s for 1 s and a hold on a spring of 100 N/m beside one of 50 N/m that relaxes
    // with 2 s.
    const double rate = 2e-3, tau = 2.0, ramp = std::min(t, 1.0);
    const double relaxing = rate * tau * (std::exp(-(t - ramp) / tau) - std::exp(-t / tau));
    file << t << "," << depth_mm << "," << 100.0 * depth_mm * 1e-3 + 50.0 * relaxing << "\n";
  }
  file.close();
  tpm::fit::FitRequest request;
  request.law = "linear-1";
  request.starts = 5;
  const tpm::fit::FitSummary fit = tpm::fit::fit_recordings({"made.csv"}, request);
  const double expected[] = {100.0, 50.0, 2.0};
  bool right = fit.law.has_value();
  for (std::size_t i = 0; i < 3; ++i) {
    std::printf("%s %.4f\n", fit.parameters[i].name.c_str(), fit.parameters[i].estimate);
    right = right && std::abs(fit.parameters[i].estimate / expected[i] - 1.0) < 1e-2;
  }
  // The depth of contact and the reading without a load are known: nothing else is fitted of them.
  request.contact = 0.0;
  request.zero = 0.0;
  request.from_s = 0.0;
  request.until_s = 8.0;
  const tpm::fit::FitSummary held = tpm::fit::fit_recordings({"made.csv"}, request);
  right = right && held.parameters.size() == 3;
  return right ? 0 : 1;
}
