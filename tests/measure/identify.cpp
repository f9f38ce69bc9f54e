// Prints the measured numbers of reports/haptics/report.md, "Identification", as CSV:
//     measure_identify
// A handle with the given mass, friction, delay and encoder, simulated apart from the library's own
// simulated device, moved by the forces of tpm hil identify for 20 s at 1 kHz.
#include <fmt/format.h>

#include <string>
#include <vector>

#include "identified_handle.hpp"
#include "program.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

void print_row(const char* what, const test::Handle& h) {
  const DeviceIdentification f = identify_device(test::moved(h), h.period_s);
  const double true_ms = 1e3 * (h.position_late_s + h.force_late_s);
  fmt::print("\"{}\",{},{},{},{},{},", what, true_ms, 1e3 * h.jitter_s, h.mass_kg,
             h.viscous_N_s_per_m, h.coulomb_N);
  if (!f.delay_mean_s) {
    fmt::print("not identified,,,,,,\n");
    return;
  }
  fmt::print("{:.3f},{:.3f},{:.3f},{:.4f},{},{:.4f},{:.4f} to {:.4f}\n", 1e3 * *f.delay_mean_s,
             1e3 * *f.delay_largest_s, 1e3 * *f.delay_jitter_s, *f.mass_kg,
             f.mass_certain ? "yes" : "interval", *f.viscous_lower_95_N_s_per_m, *f.coulomb_low_N,
             *f.coulomb_high_N);
}

void print_limits() {
  int above = 0;
  constexpr int kTries = 200;
  for (std::uint64_t seed = 1; seed <= kTries; ++seed) {
    test::Handle h;
    h.viscous_N_s_per_m = seed % 3 == 0 ? 0.1 : seed % 3 == 1 ? 0.5 : 1.0;
    h.coulomb_N = seed % 2 == 0 ? 0.03 : 0.0;
    h.force_late_s = 1e-3 * static_cast<double>(seed % 5);
    h.jitter_s = seed % 4 == 0 ? 0.5e-3 : 0.0;
    const DeviceIdentification f = identify_device(test::moved(h, seed), h.period_s);
    above += f.viscous_lower_95_N_s_per_m.value_or(1e9) > h.viscous_N_s_per_m ? 1 : 0;
  }
  fmt::print("lower limit of friction above the truth: {} of {}\n", above, kTries);
}

void print_all() {
  fmt::print(
      "what,delay_ms,jitter_ms,mass_kg,viscous_N_s_per_m,coulomb_N,found_mean_ms,found_largest_ms,"
      "found_spread_ms,found_mass_kg,mass_certain,viscous_above,coulomb_N_between\n");
  for (const double late_s : {0.0, 1e-3, 2.5e-3, 6.3e-3, 10e-3}) {
    test::Handle h;
    h.force_late_s = late_s;
    print_row("late forces", h);
    h.force_late_s = 0.0;
    h.position_late_s = late_s;
    print_row("late positions", h);
  }
  test::Handle h;
  h.force_late_s = 3e-3;
  h.jitter_s = 1.5e-3;
  print_row("jitter", h);
  for (const double coulomb_N : {0.01, 0.05, 0.1, 0.5}) {
    test::Handle rubs;
    rubs.coulomb_N = coulomb_N;
    rubs.force_late_s = 2e-3;
    print_row("rubs", rubs);
  }
  for (const double step_m : {1e-6, 3e-5, 1e-4}) {
    test::Handle coarse;
    coarse.encoder_step_m = step_m;
    coarse.force_late_s = 2e-3;
    print_row(fmt::format("encoder step {} um", 1e6 * step_m).c_str(), coarse);
  }
  test::Handle held;
  held.mass_kg = 0.85;
  held.viscous_N_s_per_m = 6.5;
  held.held_N_per_m = 135.0;
  held.force_late_s = 2e-3;
  print_row("held by the published hand", held);
  print_limits();
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 0, 0, "measure_identify",
                        [](const std::vector<std::string>&) { print_all(); });
}
