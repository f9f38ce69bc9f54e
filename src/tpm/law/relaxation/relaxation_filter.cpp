#include "tpm/law/relaxation/relaxation_filter.hpp"

#include <cmath>

namespace tpm::law {

RelaxationWeights relaxation_weights(double z) {
  RelaxationWeights k{};
  k.r = std::exp(-z);
  if (z < 1.0) {
    // w1 = z/2! - z^2/3! + z^3/4! - ...; the closed form cancels here.
    const int terms = z < 1e-3 ? 6 : z < 0.1 ? 11 : 19;  // the rest is below rounding
    double sum = 0.0;
    for (int n = terms; n >= 1; --n) sum = (1.0 - sum) * z / (n + 1);
    k.w1 = sum;
    k.w0 = -std::expm1(-z) - k.w1;
  } else {
    const double mean = -std::expm1(-z) / z;
    k.w1 = 1.0 - mean;
    k.w0 = mean - k.r;
  }
  const double zr = k.r > 0.0 ? z * k.r : 0.0;  // z may be infinite
  k.d_r = zr;
  k.d_w0 = k.w0 - zr;
  k.d_w1 = -k.w0;
  return k;
}

void run_relaxation(
    const Protocol& protocol, double tau_s, std::span<const double> times_s,
    std::span<const std::size_t> order,
    const std::function<void(std::size_t, double, const RelaxationState&)>& report) {
  const std::span<const Knot> knots = protocol.knots();
  RelaxationState state;
  std::size_t next = 0;
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const Knot& from = knots[i];
    const bool last = i + 1 == knots.size();
    const Knot& to = last ? from : knots[i + 1];
    const double h = to.time_s - from.time_s;
    while (next < order.size() && (last || times_s[order[next]] < to.time_s)) {
      // Each asked time is reached from the knot in one update, so nothing accumulates.
      const double part = times_s[order[next]] - from.time_s;
      const double u =
          part > 0.0 && !last ? from.value + (to.value - from.value) * (part / h) : from.value;
      const RelaxationState then =
          part > 0.0 ? state.after(relaxation_weights(part / tau_s), from.value, u) : state;
      report(order[next], u, then);
      ++next;
    }
    if (h > 0.0) state = state.after(relaxation_weights(h / tau_s), from.value, to.value);
  }
}

}  // namespace tpm::law
