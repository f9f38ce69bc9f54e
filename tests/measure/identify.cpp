// Prints the measured numbers of reports/haptics/report.md, "Identification", as CSV:
//     measure_identify                  one handle a row
//     measure_identify handles COUNT    how often what is found of random handles holds
// A handle with the given mass, friction, delay and encoder, simulated apart from the library's own
// simulated device, moved by the forces of tpm hil identify for 20 s at 1 kHz.
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "identified_handle.hpp"
#include "program.hpp"
#include "tpm/base/random.hpp"
#include "tpmkit/error.hpp"

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
             f.mass_certain ? "yes" : "interval",
             f.viscous_lower_95_N_s_per_m.value_or(std::nan("")), *f.coulomb_low_N,
             *f.coulomb_high_N);
}

/// Clopper and Pearson: the shares of which k of n is not among the unlikely 5 %.
std::string exact_interval(int k, int n) {
  using boost::math::beta_distribution;
  using boost::math::quantile;
  const double low = k == 0 ? 0.0 : quantile(beta_distribution<>(k, n - k + 1), 0.025);
  const double high = k == n ? 1.0 : quantile(beta_distribution<>(k + 1, n - k), 0.975);
  return fmt::format("{:.1f} to {:.1f} %", 100.0 * low, 100.0 * high);
}

void print_share(const char* what, int k, int n) {
  if (n == 0) return;
  fmt::print("| {} | {} of {} | {} |\n", what, k, n, exact_interval(k, n));
}

/// A free handle of the kind whose mass, friction and delay have to be found.
test::Handle any_handle(base::Random& random) {
  const auto between = [&random](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  const auto over_decades = [&random](double low, double high) {
    return low * std::pow(high / low, random.uniform());
  };
  test::Handle h;
  h.mass_kg = over_decades(0.1, 0.8);
  h.viscous_N_s_per_m = over_decades(0.05, 2.0);
  h.coulomb_N = random.uniform() < 0.5 ? 0.0 : between(0.0, 0.05);
  (random.uniform() < 0.5 ? h.force_late_s : h.position_late_s) = between(0.0, 10e-3);
  h.jitter_s = random.uniform() < 0.5 ? 0.0 : between(0.0, 0.45e-3);
  h.encoder_step_m = over_decades(1e-6, 1e-5);
  return h;
}

/// How often what is found of many handles holds.
struct Held {
  int handles = 0, found = 0, mean = 0, largest = 0, certain = 0, mass = 0, mass_between = 0,
      coulomb = 0, above = 0, step = 0;
  std::vector<double> lower;  ///< limit in parts of the true value
};

void add(Held& held, const test::Handle& h, const DeviceIdentification& f) {
  ++held.handles;
  if (!f.delay_mean_s || !f.mass_kg || !f.viscous_lower_95_N_s_per_m) return;
  ++held.found;
  const double late_s = h.position_late_s + h.force_late_s;
  held.mean += std::abs(*f.delay_mean_s - late_s) <= 0.5 * h.period_s ? 1 : 0;
  held.largest += *f.delay_largest_s + h.period_s >= late_s + h.jitter_s ? 1 : 0;
  held.certain += f.mass_certain ? 1 : 0;
  if (f.mass_certain && std::abs(*f.mass_kg - h.mass_kg) <= 0.1 * h.mass_kg) ++held.mass;
  if (*f.mass_low_kg <= h.mass_kg && h.mass_kg <= *f.mass_high_kg) ++held.mass_between;
  if (*f.coulomb_low_N <= h.coulomb_N && h.coulomb_N <= *f.coulomb_high_N) ++held.coulomb;
  if (f.encoder_step_m && std::abs(*f.encoder_step_m - h.encoder_step_m) < 1e-3 * h.encoder_step_m)
    ++held.step;
  const double lower = *f.viscous_lower_95_N_s_per_m / h.viscous_N_s_per_m;
  held.above += lower > 1.0 ? 1 : 0;
  held.lower.push_back(lower);
}

void print_held(const char* title, Held& held) {
  std::sort(held.lower.begin(), held.lower.end());
  const auto at = [&held](double part) {
    return held.lower[static_cast<std::size_t>(part * static_cast<double>(held.lower.size() - 1))];
  };
  const int n = held.found;
  fmt::print("{}:\n\n| | handles | exact 95 % interval |\n| --- | --- | --- |\n", title);
  print_share("identified", held.found, held.handles);
  print_share("mean delay right to half a period", held.mean, n);
  print_share("largest delay and a period not below the true largest one", held.largest, n);
  print_share("encoder step found", held.step, n);
  print_share("mass given as a number", held.certain, n);
  print_share("of these, right to 10 %", held.mass, held.certain);
  print_share("interval of the mass holds it", held.mass_between, n);
  print_share("interval of Coulomb friction (95 %) holds it", held.coulomb, n);
  print_share("lower limit of viscous friction above the true value", held.above, n);
  if (n == 0) return;
  fmt::print(
      "\nlower limit in parts of the true value: 5 % of handles below {:.3f}, half below {:.3f}, "
      "95 % below {:.3f}, largest {:.3f}\n\n",
      at(0.05), at(0.5), at(0.95), at(1.0));
}

void print_handles(int count) {
  base::Random random(1);
  Held without, with;
  for (int i = 0; i < count; ++i) {
    const test::Handle h = any_handle(random);
    const DeviceIdentification f =
        identify_device(test::moved(h, static_cast<std::uint64_t>(i) + 1), h.period_s);
    add(h.coulomb_N > 0.0 ? with : without, h, f);
  }
  print_held("Without Coulomb friction", without);
  print_held("Coulomb friction up to 0.05 N", with);
  const int above = without.above + with.above, found = without.found + with.found;
  if (found == 0) return;
  fmt::print("lower limit of viscous friction above the true value, of all: {} of {}, {}\n", above,
             found, exact_interval(above, found));
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
}

}  // namespace

int main(int argc, char** argv) {
  return test::measured(argc, argv, 0, 2, "measure_identify [handles COUNT]",
                        [](const std::vector<std::string>& words) {
                          if (words.empty()) return print_all();
                          if (words[0] == "handles" && words.size() == 2) {
                            return print_handles(std::stoi(words[1]));
                          }
                          throw Error(ExitCode::usage, "measure_identify", words[0],
                                      "nothing, or handles COUNT");
                        });
}
