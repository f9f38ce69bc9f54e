#include "tpm/organ/bonds/viscous_law.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/organ/bonds/material_refusal.hpp"

namespace tpm::organ {
namespace {

bool alike(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::max(std::abs(a), std::abs(b));
}

}  // namespace

ViscousLaw::ViscousLaw(const BondLaw& law) : kernel(law.kernel) {
  const double equilibrium = law.equilibrium_N_per_m();
  for (const BondLaw::Spring& spring : law.springs) {
    springs.push_back({spring.stiffness_N_per_m / equilibrium, spring.function});
  }
  if (springs.empty()) springs.push_back({1.0, {}});
  const double relaxing = law.relaxing_N_per_m();
  for (const BondLaw::Branch& branch : law.branches) {
    branches.push_back({branch.stiffness_N_per_m / relaxing, branch.relaxation_time_s, 0});
  }
}

bool ViscousLaw::is_linear() const {
  return (branches.empty() || kernel.is_linear()) &&
         std::all_of(springs.begin(), springs.end(),
                     [](const Spring& spring) { return spring.function.is_linear(); });
}

bool ViscousLaw::serves(const ViscousLaw& other) const {
  const bool same_springs = std::equal(springs.begin(), springs.end(), other.springs.begin(),
                                       other.springs.end(), [](const Spring& a, const Spring& b) {
                                         return a.function == b.function && alike(a.share, b.share);
                                       });
  if (!same_springs) return false;
  return other.branches.empty() || relax_alike(*this, other);
}

bool relax_alike(const ViscousLaw& a, const ViscousLaw& b) {
  return a.kernel == b.kernel &&
         std::equal(a.branches.begin(), a.branches.end(), b.branches.begin(), b.branches.end(),
                    [](const ViscousLaw::Branch& x, const ViscousLaw::Branch& y) {
                      return alike(x.share, y.share) &&
                             alike(x.relaxation_time_s, y.relaxation_time_s);
                    });
}

double ViscousLaw::equilibrium(double l) const {
  double sum = 0.0;
  for (const Spring& spring : springs) sum += spring.share * spring.function.value(l);
  return sum;
}

double ViscousLaw::equilibrium_slope(double l) const {
  double sum = 0.0;
  for (const Spring& spring : springs) sum += spring.share * spring.function.slope(l);
  return sum;
}

double ViscousLaw::equilibrium_integral(double l) const {
  double sum = 0.0;
  for (const Spring& spring : springs) sum += spring.share * spring.function.integral(l);
  return sum;
}

}  // namespace tpm::organ
