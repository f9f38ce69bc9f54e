#include "tpmkit/tpm_element.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

TpmVector to_vector(const TpmParameters& p) {
  return {p.E1_Pa, p.E2_Pa, p.Eprime_Pa, p.eta1_Pa_s, p.spacing_m, p.A0_m2, p.l0_m};
}

TpmParameters from_vector(const TpmVector& v) {
  return {v[kE1], v[kE2], v[kEprime], v[kEta1], v[kSpacing], v[kA0], v[kL0]};
}

BondElement TpmParameters::bonds(LateralBond lateral) const {
  BondElement element;
  element.equilibrium_Pa = equilibrium_modulus_Pa();
  element.branches = {{relaxing_modulus_Pa(), relaxation_time_s()}};
  element.lateral_Pa = Eprime_Pa;
  element.lateral = lateral;
  element.A0_m2 = A0_m2;
  element.l0_m = l0_m;
  element.spacing_m = spacing_m;
  return element;
}

TpmVector element_constants(const BondElement& element) {
  require_one_branch(element, "element");
  const double E2 = element.instantaneous_Pa();
  const double g = element.relaxing_Pa();
  if (E2 > 0.0 && !(g > 0.0)) {
    throw bad_input("element", "nothing of it relaxes: E1 would be infinite", "a branch above 0");
  }
  // Without E2 every E1 does; its dashpot follows from the relaxation time.
  const double E1 = E2 > 0.0 ? element.equilibrium_Pa * E2 / g : 1e3;
  return {E1,
          E2,
          element.lateral_Pa,
          element.relaxation_time_s() * (E1 + E2),
          element.spacing_m,
          element.A0_m2,
          element.l0_m};
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

double step_relaxation_force_N(const TpmParameters& p, double lambda1, double depth_m,
                               double time_s) {
  const double relaxed_share = -std::expm1(-time_s / p.relaxation_time_s());
  return ((p.E2_Pa + lambda1) - p.relaxing_modulus_Pa() * relaxed_share) * depth_m *
         p.modulus_to_stiffness_m();
}

double creep_depth_m(const TpmParameters& p, double lambda1, double load_N, double time_s) {
  const double sum = p.E1_Pa + p.E2_Pa;
  const double relaxed = p.equilibrium_modulus_Pa() + lambda1;
  const double instantaneous = p.E2_Pa + lambda1;
  // T = (P3 + lambda1 P1) / (P2 + lambda1), the retardation time
  const double retardation = p.eta1_Pa_s * instantaneous / sum / relaxed;
  const double stress_length = load_N / p.modulus_to_stiffness_m();
  const double grown = -std::expm1(-time_s / retardation);
  return stress_length * (1.0 / instantaneous + (1.0 / relaxed - 1.0 / instantaneous) * grown);
}

}  // namespace tpm
