#include "tpm/material/tpm_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"

namespace tpm {

TpmVector to_vector(const TpmParameters& p) {
  return {p.E1_Pa, p.E2_Pa, p.Eprime_Pa, p.eta1_Pa_s, p.spacing_m, p.A0_m2, p.l0_m};
}

TpmParameters from_vector(const TpmVector& v) {
  return {v[kE1], v[kE2], v[kEprime], v[kEta1], v[kSpacing], v[kA0], v[kL0]};
}

void require_valid(const TpmParameters& p, std::string_view where) {
  const TpmVector v = to_vector(p);
  for (std::size_t i = 0; i < v.size(); ++i) {
    const bool may_be_zero = i == kE1 || i == kE2 || i == kEprime;
    if (std::isfinite(v[i]) && (v[i] > 0.0 || (may_be_zero && v[i] == 0.0))) continue;
    throw bad_input(where,
                    fmt::format("{} = {} {}", kTpmParameterTable[i].name, shortest(v[i]),
                                si_symbol(kTpmParameterTable[i].dimension)),
                    may_be_zero ? "a finite value of at least 0" : "a finite value above 0");
  }
  if (!(p.E1_Pa + p.E2_Pa > 0.0)) {
    throw bad_input(where, "E1 and E2 are both 0", "at least one spring above 0");
  }
}

double TensionLaw::slope(double e) const {
  // d/de of 2 E' (e - x e / sqrt(x^2 + e^2)) = 2 E' (1 - cos^3), and 1 - c^3 = (1 - c)(1 + c +
  // c^2).
  const double m = one_minus_cosine(e, spacing_m);
  const double c = 1.0 - m;
  return 2.0 * Eprime_Pa * m * (1.0 + c + c * c);
}

double TensionLaw::d_spacing(double e) const {
  // d(cos)/dx = e^2 / (x^2 + e^2)^(3/2)
  const double r2 = spacing_m * spacing_m + e * e;
  return -2.0 * Eprime_Pa * e * e * e / (r2 * std::sqrt(r2));
}

double step_relaxation_force_N(const TpmParameters& p, double lambda1, double depth_m,
                               double time_s) {
  const double relaxed_share = -std::expm1(-time_s / p.relaxation_time_s());
  return ((p.E2_Pa + lambda1) - p.relaxing_modulus_Pa() * relaxed_share) * depth_m *
         p.modulus_to_stiffness_m();
}

double creep_depth_m(const TpmParameters& p, double lambda1, double load_N, double time_s) {
  const double sum = p.E1_Pa + p.E2_Pa;
  const double relaxed = p.relaxed_modulus_Pa() + lambda1;
  const double at_once = p.E2_Pa + lambda1;
  // T = (P3 + lambda1 P1) / (P2 + lambda1), the retardation time
  const double retardation = p.eta1_Pa_s * at_once / sum / relaxed;
  const double stress_length = load_N / p.modulus_to_stiffness_m();
  const double grown = -std::expm1(-time_s / retardation);
  return stress_length * (1.0 / at_once + (1.0 / relaxed - 1.0 / at_once) * grown);
}

double equilibrium_depth_m(const TpmParameters& p, double modulus_Pa, double load_N) {
  const TensionLaw tension{p.Eprime_Pa, p.spacing_m};
  const double stress_length = load_N / p.modulus_to_stiffness_m();
  if (stress_length == 0.0) return 0.0;
  // The left side is odd and convex for e > 0 up to its linear asymptote, so Newton from the
  // right of the root decreases monotonically; the smaller of two bounds is such a start.
  const double target = std::abs(stress_length);
  double e = std::numeric_limits<double>::infinity();
  if (modulus_Pa > 0.0) e = target / modulus_Pa;
  if (p.Eprime_Pa > 0.0) e = std::min(e, target / (2.0 * p.Eprime_Pa) + p.spacing_m);
  if (!std::isfinite(e)) {
    throw Error(ExitCode::numerical, "equilibrium depth", "no spring carries the load");
  }
  for (int iteration = 0; iteration < 200; ++iteration) {
    const double residual = modulus_Pa * e + tension.value(e) - target;
    const double step = residual / (modulus_Pa + tension.slope(e));
    e -= step;
    if (std::abs(step) <= 4.0 * std::numeric_limits<double>::epsilon() * e) {
      return std::copysign(e, stress_length);
    }
  }
  throw Error(ExitCode::numerical, "equilibrium depth", "Newton's method did not converge");
}

}  // namespace tpm
