// Prints the numbers of reports/fits/report.md: errors, rates and times of the
// exponential sums, and the time of a response: build/release/tests/measure_fractional
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "fractional_reference.hpp"
#include "tpm/base/random.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::law;

namespace {

/// Wall time of a call, s.
template <class Call>
double seconds(Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  std::forward<Call>(call)();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Worst errors of the sums over a window of times, and the mean time of finding the weights.
struct SumErrors {
  double mittag_leffler = 0.0, integral = 0.0, slope = 0.0, springpot = 0.0;
  double seconds_per_call = 0.0;
};

void add_mittag_leffler_errors(const ExponentialSum& exponentials, const FractionalWeights& w,
                               double alpha, double tau, double span, SumErrors& worst) {
  const FractionalWeights slopes = by_log_tau(w);
  for (const double t : decades(1.0, span, 31)) {
    const auto raise = [](double& most, double error) { most = std::max(most, std::abs(error)); };
    raise(worst.mittag_leffler, sum_at(exponentials, w, t) - relaxation(alpha, tau, t));
    raise(worst.slope, sum_at(exponentials, slopes, t) - relaxation_by_log_tau(alpha, tau, t));
    raise(worst.integral,
          (sum_integral_s(exponentials, w, t) - relaxation_integral(alpha, tau, t)) / t);
  }
}

SumErrors sum_errors(const ExponentialSum& exponentials, double span) {
  SumErrors worst;
  FractionalWeights w;
  int calls = 0;
  for (const double alpha : kAlphas) {
    for (const double tau : decades(1e-3, 1e3 * span, 53)) {
      worst.seconds_per_call += seconds([&] { exponentials.mittag_leffler(alpha, tau, w); });
      ++calls;
      add_mittag_leffler_errors(exponentials, w, alpha, tau, span, worst);
    }
    if (alpha == 1.0) continue;
    exponentials.springpot(alpha, w);
    for (const double t : decades(1.0, span, 31)) {
      const double error =
          std::abs(sum_at(exponentials, w, t) - springpot(alpha, t)) / springpot(alpha, 1.0);
      worst.springpot = std::max(worst.springpot, error);
    }
  }
  worst.seconds_per_call /= calls;
  return worst;
}

void print_sums() {
  fmt::print(
      "window tolerance rates   worst M   worst mean of M   worst P/P(t_min)   "
      "worst dM/d(ln tau)   us/call\n");
  for (const double span : {1e2, 1e4, 1e8}) {
    for (const double tolerance : {1e-6, 1e-9, 1e-11}) {
      const ExponentialSum exponentials(1.0, span, tolerance);
      const SumErrors e = sum_errors(exponentials, span);
      fmt::print("{:6.0e} {:9.0e} {:5} {:9.1e} {:17.1e} {:18.1e} {:20.1e} {:9.1f}\n", span,
                 tolerance, exponentials.rates_per_s().size(), e.mittag_leffler, e.integral,
                 e.springpot, e.slope, 1e6 * e.seconds_per_call);
    }
  }
}

/// A ramp and hold of 500 samples over 30 s, sampled evenly or not.
Protocol ramp_and_hold_of_500(bool even) {
  Random random(1);
  std::vector<double> times;
  std::vector<double> depth;
  for (int i = 0; i < 500; ++i) {
    times.push_back(0.06 * (i + (even ? 0.0 : 0.5 * random.uniform())));
    depth.push_back(4e-3 * std::min(1.0, i / 50.0));
  }
  return measured_history(Drive::displacement, times, depth);
}

void print_responses() {
  constexpr int kRepeats = 20;
  for (const char* name : {"linear-fspringpot", "linear-fzener", "power-fzener"}) {
    const LawModel law(parse_law_name(name, "law"));
    std::vector<double> values;
    for (const LawParameter& p : law.law_parameters()) {
      values.push_back(p.preset.value_or(p.name == "alpha" ? 0.4 : 1.5));
    }
    for (const bool even : {true, false}) {
      const Protocol protocol = ramp_and_hold_of_500(even);
      std::vector<double> times;
      for (const Knot& knot : protocol.knots()) times.push_back(knot.time_s);
      for (const Want want : {Want::values, Want::values_and_sensitivity}) {
        const double spent = seconds([&] {
          for (int k = 0; k < kRepeats; ++k) (void)law.respond(protocol, times, values, want);
        });
        fmt::print("{} {} {}: {:.3f} ms\n", name, even ? "even" : "uneven",
                   want == Want::values ? "values" : "with sensitivities", 1e3 * spent / kRepeats);
      }
    }
  }
}

}  // namespace

int main() {
  print_sums();
  print_responses();
  return 0;
}
