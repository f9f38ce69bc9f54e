#include "tpmkit/bond_law.hpp"

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>

#include "tpmkit/error.hpp"

namespace tpm {
namespace {

constexpr double kRoundingShare = 1e-14;  // of a bond's stiffness: below, a branch is rounding

/// Relaxation times that differ by rounding alone are one.
bool same_time(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::max(a, b);
}

/// G(s) at s = -r: c - ... of a linear law, N/m; r is none of its rates.
double modulus_at(const BondLaw& law, double rate_per_s) {
  double sum = law.equilibrium_N_per_m();
  for (const BondLaw::Branch& branch : law.branches) {
    const double z = -rate_per_s * branch.relaxation_time_s;
    sum += branch.stiffness_N_per_m * z / (1.0 + z);
  }
  return sum;
}

/// dG/ds there, N s/m.
double modulus_slope_at(const BondLaw& law, double rate_per_s) {
  double sum = 0.0;
  for (const BondLaw::Branch& branch : law.branches) {
    const double z = 1.0 - rate_per_s * branch.relaxation_time_s;
    sum += branch.stiffness_N_per_m * branch.relaxation_time_s / (z * z);
  }
  return sum;
}

/// The rate between two poles of G_1 + G_2 at which the sum vanishes. It falls from + to -
/// infinity... with the rate from `from` (exclusive) to `to` (exclusive).
double root_between(const BondLaw& a, const BondLaw& b, double from, double to) {
  const auto sum = [&](double rate) { return modulus_at(a, rate) + modulus_at(b, rate); };
  // Above a pole the sum is +infinite, below one -infinite; approach both to rounding.
  const double span = to - from;
  double low = from + 1e-13 * span;
  double high = to - 1e-13 * span;
  if (!(sum(low) > 0.0)) return low;
  if (!(sum(high) < 0.0)) return high;
  std::uintmax_t most = 200;
  const auto [x, y] = boost::math::tools::toms748_solve(
      sum, low, high, boost::math::tools::eps_tolerance<double>(50), most);
  return 0.5 * (x + y);
}

BondLaw mean_of(const BondLaw& a, const BondLaw& b, std::string_view where) {
  if (!a.branches.empty() && !b.branches.empty() && !(a.kernel == b.kernel)) {
    throw bad_input(where, "a bond between materials whose branches act on different kernels",
                    "regions whose materials name one kernel");
  }
  BondLaw law = a.scaled(0.5);
  const BondLaw other = b.scaled(0.5);
  if (law.branches.empty()) law.kernel = other.kernel;
  law.springs.insert(law.springs.end(), other.springs.begin(), other.springs.end());
  law.branches.insert(law.branches.end(), other.branches.begin(), other.branches.end());
  law.tidy();
  return law;
}

/// b = factor a, or 0.
double factor_between(const BondLaw& a, const BondLaw& b) {
  if (a.springs.size() != b.springs.size() || a.branches.size() != b.branches.size()) return 0.0;
  if (!a.branches.empty() && !(a.kernel == b.kernel)) return 0.0;
  const double factor = b.instantaneous_N_per_m() / a.instantaneous_N_per_m();
  const auto alike = [&](double x, double y) { return std::abs(factor * x - y) <= 1e-12 * y; };
  for (std::size_t i = 0; i < a.springs.size(); ++i) {
    if (!(a.springs[i].function == b.springs[i].function)) return 0.0;
    if (!alike(a.springs[i].stiffness_N_per_m, b.springs[i].stiffness_N_per_m)) return 0.0;
  }
  for (std::size_t j = 0; j < a.branches.size(); ++j) {
    if (!same_time(a.branches[j].relaxation_time_s, b.branches[j].relaxation_time_s)) return 0.0;
    if (!alike(a.branches[j].stiffness_N_per_m, b.branches[j].stiffness_N_per_m)) return 0.0;
  }
  return factor;
}

/// The relaxation time of b's branch that is one of a's too, as a branch of the series.
void add_shared_poles(const BondLaw& a, const BondLaw& b, BondLaw& series) {
  for (const BondLaw::Branch& x : a.branches) {
    for (const BondLaw::Branch& y : b.branches) {
      if (!same_time(x.relaxation_time_s, y.relaxation_time_s)) continue;
      const double sum = x.stiffness_N_per_m + y.stiffness_N_per_m;
      series.branches.push_back(
          {2.0 * x.stiffness_N_per_m * y.stiffness_N_per_m / sum, x.relaxation_time_s});
    }
  }
}

BondLaw series_of(const BondLaw& a, const BondLaw& b, std::string_view where) {
  const double k_a = a.instantaneous_N_per_m();
  const double k_b = b.instantaneous_N_per_m();
  if (!(k_a > 0.0) || !(k_b > 0.0)) return {};
  if (const double factor = factor_between(a, b); factor > 0.0) {
    return a.scaled(2.0 * factor / (1.0 + factor));
  }
  if (!a.is_linear() || !b.is_linear()) {
    throw bad_input(where, "a series of two bonds that stiffen has no law of this kind",
                    "\"between\": \"mean\"");
  }
  std::vector<double> poles;
  for (const BondLaw* law : {&a, &b}) {
    for (const BondLaw::Branch& branch : law->branches) {
      poles.push_back(1.0 / branch.relaxation_time_s);
    }
  }
  std::sort(poles.begin(), poles.end());
  poles.erase(std::unique(poles.begin(), poles.end(), same_time), poles.end());
  const double equilibrium = a.equilibrium_N_per_m() + b.equilibrium_N_per_m();
  const double instantaneous = 2.0 * k_a * k_b / (k_a + k_b);
  BondLaw series;
  add_shared_poles(a, b, series);
  for (std::size_t i = 0; i < poles.size(); ++i) {
    if (i == 0 && !(equilibrium > 0.0)) continue;  // the root at rate 0 cancels
    const double rate = root_between(a, b, i == 0 ? 0.0 : poles[i - 1], poles[i]);
    const double modulus = modulus_at(a, rate);
    const double slope = modulus_slope_at(a, rate) + modulus_slope_at(b, rate);
    const double stiffness = 2.0 * modulus * modulus / (rate * slope);
    series.branches.push_back({stiffness, 1.0 / rate});
  }
  double relaxing = 0.0;
  for (const BondLaw::Branch& branch : series.branches) relaxing += branch.stiffness_N_per_m;
  series.springs.push_back({std::max(instantaneous - relaxing, 0.0), {}});
  series.tidy();
  return series;
}

}  // namespace

double BondLaw::equilibrium_N_per_m() const {
  double sum = 0.0;
  for (const Spring& spring : springs) sum += spring.stiffness_N_per_m;
  return sum;
}

double BondLaw::relaxing_N_per_m() const {
  double sum = 0.0;
  for (const Branch& branch : branches) sum += branch.stiffness_N_per_m;
  return sum;
}

bool BondLaw::is_linear() const {
  return (branches.empty() || kernel.is_linear()) &&
         std::all_of(springs.begin(), springs.end(),
                     [](const Spring& spring) { return spring.function.is_linear(); });
}

BondLaw BondLaw::scaled(double factor) const {
  BondLaw law = *this;
  for (Spring& spring : law.springs) spring.stiffness_N_per_m *= factor;
  for (Branch& branch : law.branches) branch.stiffness_N_per_m *= factor;
  return law;
}

void BondLaw::tidy() {
  const double least = kRoundingShare * instantaneous_N_per_m();
  std::vector<Spring> kept_springs;
  for (const Spring& spring : springs) {
    if (!(spring.stiffness_N_per_m > least)) continue;
    const auto found = std::find_if(kept_springs.begin(), kept_springs.end(),
                                    [&](const Spring& s) { return s.function == spring.function; });
    if (found == kept_springs.end()) {
      kept_springs.push_back(spring);
    } else {
      found->stiffness_N_per_m += spring.stiffness_N_per_m;
    }
  }
  std::sort(branches.begin(), branches.end(), [](const Branch& x, const Branch& y) {
    return x.relaxation_time_s < y.relaxation_time_s;
  });
  std::vector<Branch> kept;
  for (const Branch& branch : branches) {
    if (!(branch.stiffness_N_per_m > least)) continue;
    if (!kept.empty() && same_time(kept.back().relaxation_time_s, branch.relaxation_time_s)) {
      kept.back().stiffness_N_per_m += branch.stiffness_N_per_m;
    } else {
      kept.push_back(branch);
    }
  }
  springs = std::move(kept_springs);
  branches = std::move(kept);
}

BondLaw blended(const BondLaw& a, const BondLaw& b, BlendRule rule, std::string_view where) {
  return rule == BlendRule::mean ? mean_of(a, b, where) : series_of(a, b, where);
}

}  // namespace tpm
