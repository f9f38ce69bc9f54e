#include "tpmkit/bond_element.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

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

double BondElement::relaxation_time_s() const {
  return branches.empty() ? std::numeric_limits<double>::infinity()
                          : branches.front().relaxation_time_s;
}

BondElement BondElement::with_relaxation_time(double time_s) const {
  BondElement other = *this;
  other.branches.front().relaxation_time_s = time_s;
  return other;
}

bool BondElement::has_one_branch() const {
  return branches.size() == 1 && potential.is_linear() && kernel.is_linear() &&
         lateral != LateralBond::relaxing;
}

BondElement paper_element(double relaxation_time_s) {
  BondElement element;
  element.equilibrium_Pa = 6e3;
  element.branches = {{6e3, relaxation_time_s}};
  element.lateral_Pa = 12e3;
  return element;
}

void require_one_branch(const BondElement& element, std::string_view where) {
  require_valid(element, where);
  if (!(element.spacing_m > 0.0) || !std::isfinite(element.spacing_m)) {
    throw bad_input(where, fmt::format("spacing = {} m", shortest(element.spacing_m)), "above 0");
  }
  if (!element.has_one_branch()) {
    throw bad_input(where, "an element with other than one linear branch",
                    "E1, E2, Eprime and eta1, or Einf and one branch");
  }
}

double equilibrium_depth_m(const BondElement& element, double modulus_Pa, double load_N) {
  const TensionLaw tension = element.tension();
  const double stress_length = load_N / element.modulus_to_stiffness_m();
  if (stress_length == 0.0) return 0.0;
  // The left side is odd and convex for e > 0 up to its linear asymptote, so Newton from the
  // right of the root decreases monotonically; the smaller of two bounds is such a start.
  const double target = std::abs(stress_length);
  double e = std::numeric_limits<double>::infinity();
  if (modulus_Pa > 0.0) e = target / modulus_Pa;
  if (element.lateral_Pa > 0.0)
    e = std::min(e, target / (2.0 * element.lateral_Pa) + element.spacing_m);
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
