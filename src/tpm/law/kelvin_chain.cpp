#include "tpm/law/kelvin_chain.hpp"

#include <ceres/jet.h>
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

// With s = -1/x (x a time), the operational stiffness of a Prony law and the compliance of a
// Kelvin chain are
//     g(x) = k_inf + sum k_i tau_i / (tau_i - x),     h(x) = 1/g(x)
//          = 1/k0 + sum (1/kc_j) x / (x - T_j) - x/eta.
// g rises between its poles tau_i and its zeros are the T_j; h falls and its zeros are the tau_i.

/// sum of terms a_i / (p_i - x), and its slope, at x = origin + offset: the differences of poles
/// are formed first, so that a root close to a pole keeps its digits.
template <class T>
struct Poles {
  std::vector<T> place;
  std::vector<T> weight;

  [[nodiscard]] T sum(const T& origin, const T& offset) const {
    T total(0.0);
    for (std::size_t i = 0; i < place.size(); ++i) {
      total += weight[i] / ((place[i] - origin) - offset);
    }
    return total;
  }
  [[nodiscard]] T slope(const T& origin, const T& offset) const {
    T total(0.0);
    for (std::size_t i = 0; i < place.size(); ++i) {
      const T d = (place[i] - origin) - offset;
      total += weight[i] / (d * d);
    }
    return total;
  }
};

/// a + b x + sum weight_i / (place_i - x): both g and h have this shape.
template <class T>
struct PoleFunction {
  T constant{0.0};
  T linear{0.0};
  Poles<T> poles;

  [[nodiscard]] T value(const T& origin, const T& offset) const {
    return constant + linear * (origin + offset) + poles.sum(origin, offset);
  }
  [[nodiscard]] T slope(const T& origin, const T& offset) const {
    return linear + poles.slope(origin, offset);
  }
};

struct Root {
  double origin;  ///< the pole it is measured from (0 for none)
  double offset;
};

/// The root between two neighbouring places where the function changes sign, found in ln|offset|
/// from the nearer end.
Root root_between(const PoleFunction<double>& f, double low, double high) {
  const double half = std::isfinite(high) ? 0.5 * (high - low) : std::max(low, 1.0);
  const bool rising = f.slope(low, half) > 0.0;
  bool from_low = true;
  double reach = half;
  if (std::isfinite(high)) {
    from_low = (f.value(low, half) > 0.0) == rising;
  } else {
    while ((f.value(low, reach) > 0.0) != rising) reach *= 4.0;
  }
  const double origin = from_low ? low : high;
  const double sign = from_low ? 1.0 : -1.0;
  const auto at = [&](double log_offset) {
    return (rising ? 1.0 : -1.0) * sign * f.value(origin, sign * std::exp(log_offset));
  };
  double inner = std::log(reach) - 1.0;
  while (at(inner) > 0.0 && inner > -700.0) inner -= 8.0;
  if (at(inner) >= 0.0) return {origin, 0.0};  // a branch without weight: the root is the pole
  // The root may be the very middle of the gap, where rounding decides the sign.
  if (at(std::log(reach)) <= 0.0) return {origin, sign * reach};
  std::uintmax_t iterations = 200;
  const auto bracket = boost::math::tools::toms748_solve(
      at, inner, std::log(reach), boost::math::tools::eps_tolerance<double>(53), iterations);
  return {origin, sign * std::exp(0.5 * (bracket.first + bracket.second))};
}

/// One Newton step in T: leaves the value and gives it exact derivatives.
template <class T>
T polished(const PoleFunction<T>& f, const T& origin, double offset) {
  const T start(offset);
  return start - f.value(origin, start) / f.slope(origin, start);
}

double scalar(double value) {
  return value;
}
template <int N>
double scalar(const ceres::Jet<double, N>& value) {
  return value.a;
}

template <class T>
PoleFunction<double> scalar_function(const PoleFunction<T>& f) {
  PoleFunction<double> plain;
  plain.constant = scalar(f.constant);
  plain.linear = scalar(f.linear);
  for (std::size_t i = 0; i < f.poles.place.size(); ++i) {
    plain.poles.place.push_back(scalar(f.poles.place[i]));
    plain.poles.weight.push_back(scalar(f.poles.weight[i]));
  }
  return plain;
}

template <class T>
struct Coefficients {
  T first{0.0};  ///< k_inf or k0
  std::vector<T> k;
  std::vector<T> time;
  T eta{0.0};
  bool fluid = false;
};

/// Roots of f in each gap between neighbouring poles and, if asked for, before the first pole or
/// beyond the last. Calls use(root as T, slope of f there).
template <class T, class Use>
void each_root(const PoleFunction<T>& f, bool before_first, bool beyond_last, const Use& use) {
  const PoleFunction<double> plain = scalar_function(f);
  const std::vector<double>& place = plain.poles.place;
  const auto found = [&](const Root& root, const T& origin) {
    const T offset = polished(f, origin, root.offset);
    use(origin + offset, f.slope(origin, offset));
  };
  if (before_first) {
    const Root root = root_between(plain, 0.0, place.front());
    found(root, root.origin == 0.0 ? T(0.0) : f.poles.place.front());
  }
  for (std::size_t i = 0; i + 1 < place.size(); ++i) {
    const Root root = root_between(plain, place[i], place[i + 1]);
    found(root, f.poles.place[root.origin == place[i] ? i : i + 1]);
  }
  if (beyond_last) {
    const Root root = root_between(plain, place.back(), std::numeric_limits<double>::infinity());
    found(root, f.poles.place.back());
  }
}

/// Parallel -> series; times sorted, all k > 0.
template <class T>
Coefficients<T> series_of(const Coefficients<T>& law) {
  PoleFunction<T> g;
  g.constant = law.first;
  Coefficients<T> chain;
  chain.first = law.first;
  chain.fluid = scalar(law.first) == 0.0;
  for (std::size_t i = 0; i < law.k.size(); ++i) {
    g.poles.place.push_back(law.time[i]);
    g.poles.weight.push_back(law.k[i] * law.time[i]);
    chain.first += law.k[i];
    if (chain.fluid) chain.eta += law.k[i] * law.time[i];
  }
  if (law.k.empty()) return chain;
  each_root(g, false, !chain.fluid, [&](const T& root, const T& slope) {
    chain.time.push_back(root);
    chain.k.push_back(root * slope);
  });
  return chain;
}

/// Series -> parallel; times sorted and distinct, all k > 0.
template <class T>
Coefficients<T> parallel_of(const Coefficients<T>& chain) {
  // x/(x - T) = 1 - T/(T - x)
  PoleFunction<T> h;
  h.constant = T(1.0) / chain.first;
  if (chain.fluid) h.linear = T(-1.0) / chain.eta;
  for (std::size_t i = 0; i < chain.k.size(); ++i) {
    h.constant += T(1.0) / chain.k[i];
    h.poles.place.push_back(chain.time[i]);
    h.poles.weight.push_back(-chain.time[i] / chain.k[i]);
  }
  Coefficients<T> law;
  law.first = chain.fluid ? T(0.0) : T(1.0) / h.constant;
  const auto use = [&](const T& root, const T& slope) {
    law.time.push_back(root);
    law.k.push_back(T(-1.0) / (root * slope));
  };
  if (!chain.k.empty()) {
    each_root(h, true, chain.fluid, use);
  } else if (chain.fluid) {
    law.time.push_back(chain.eta / chain.first);
    law.k.push_back(chain.first);
  }
  return law;
}

void require_coefficients(double first, std::span<const double> k, std::span<const double> times,
                          const char* what) {
  const auto bad = [](double v) { return !(v >= 0.0) || !std::isfinite(v); };
  if (bad(first) || std::any_of(k.begin(), k.end(), bad)) {
    throw bad_input(what, "a stiffness that is negative or not finite",
                    "stiffnesses of at least 0");
  }
  if (k.size() != times.size()) {
    throw bad_input(what, fmt::format("{} stiffnesses and {} times", k.size(), times.size()),
                    "one time for each");
  }
  if (std::any_of(times.begin(), times.end(),
                  [](double v) { return !(v > 0.0) || !std::isfinite(v); })) {
    throw bad_input(what, "a time that is not above 0", "positive times");
  }
}

std::vector<std::size_t> order_of_times(std::span<const double> times) {
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  return order;
}

/// Derivatives by the coefficients of at most `Units` units. Their number is fixed when compiled,
/// and every operation costs as much: small chains have Jets of their own.
template <int Units>
using SlopeJet = ceres::Jet<double, 2 * Units + 2>;
constexpr std::size_t kFewUnits = 4;
constexpr std::size_t kSomeUnits = 12;

/// Row of derivatives of a Jet, first n.
template <class Jet>
void put_row(Eigen::MatrixXd& slopes, Eigen::Index row, const Jet& value) {
  slopes.row(row) = value.v.head(slopes.cols()).transpose();
}

/// Sorted coefficients as Jets whose derivatives refer to the unsorted order
/// (first, k_1.., time_1..).
template <class Jet>
Coefficients<Jet> as_jets(double first, std::span<const double> k, std::span<const double> times) {
  constexpr double kNudge = 1e-9;
  Coefficients<Jet> jets;
  jets.first = Jet(first, 0);
  const auto n = static_cast<int>(k.size());
  double last = 0.0;
  for (const std::size_t i : order_of_times(times)) {
    const auto place = static_cast<int>(i);
    const double time = std::max(times[i], last * (1.0 + kNudge));
    last = time;
    jets.k.emplace_back(k[i], 1 + place);
    jets.time.emplace_back(time, 1 + n + place);
  }
  return jets;
}

}  // namespace

namespace {

/// The values of converted coefficients and, from row 1 on, the slopes of the k's, then the times'.
template <class Jet>
void take_units(const Coefficients<Jet>& c, std::vector<double>& k, std::vector<double>& time_s,
                Eigen::MatrixXd& slopes) {
  const auto n = static_cast<Eigen::Index>(c.k.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Jet& stiffness = c.k[static_cast<std::size_t>(i)];
    const Jet& time = c.time[static_cast<std::size_t>(i)];
    k.push_back(stiffness.a);
    time_s.push_back(time.a);
    put_row(slopes, 1 + i, stiffness);
    put_row(slopes, 1 + n + i, time);
  }
}

template <int Units>
ParallelWithSlopes parallel_with_slopes(const KelvinChain& chain) {
  const auto c = parallel_of(as_jets<SlopeJet<Units>>(chain.k0, chain.k, chain.T_s));
  const auto n = static_cast<Eigen::Index>(chain.k.size());
  ParallelWithSlopes result;
  result.slopes.resize(2 * n + 1, 2 * n + 1);
  result.law.k_inf = c.first.a;
  put_row(result.slopes, 0, c.first);
  take_units(c, result.law.k, result.law.tau_s, result.slopes);
  return result;
}

/// Calls f with a number of units, known when compiled, that is at least `units`.
template <class Function>
auto with_enough_units(std::size_t units, const Function& f) {
  if (units <= kFewUnits) return f(std::integral_constant<int, kFewUnits>());
  if (units <= kSomeUnits) return f(std::integral_constant<int, kSomeUnits>());
  return f(std::integral_constant<int, kMostBranches>());
}

void require_units(std::size_t units, const char* what) {
  if (units <= kMostBranches) return;
  throw bad_input(what, fmt::format("{} branches", units),
                  fmt::format("at most {}", kMostBranches));
}

}  // namespace

ParallelWithSlopes to_parallel_with_slopes(const KelvinChain& chain) {
  require_coefficients(chain.k0, chain.k, chain.T_s, "Kelvin chain");
  require_units(chain.k.size(), "Kelvin chain");
  return with_enough_units(chain.k.size(),
                           [&](auto units) { return parallel_with_slopes<units>(chain); });
}

}  // namespace tpm::law

namespace tpm {
using namespace law;

KelvinChain to_series(const Prony& law) {
  require_coefficients(law.k_inf, law.k, law.tau_s, "Prony law");
  Coefficients<double> merged;
  merged.first = law.k_inf;
  for (const std::size_t i : order_of_times(law.tau_s)) {
    if (law.k[i] == 0.0) continue;
    if (!merged.time.empty() && merged.time.back() == law.tau_s[i]) {
      merged.k.back() += law.k[i];
      continue;
    }
    merged.time.push_back(law.tau_s[i]);
    merged.k.push_back(law.k[i]);
  }
  if (merged.k.empty() && merged.first == 0.0) {
    throw bad_input("Prony law", "no stiffness at all", "at least one above 0");
  }
  const Coefficients<double> c = series_of(merged);
  return {c.first, c.k, c.time, c.eta};
}

Prony to_parallel(const KelvinChain& chain) {
  require_coefficients(chain.k0, chain.k, chain.T_s, "Kelvin chain");
  if (!(chain.k0 > 0.0) ||
      std::any_of(chain.k.begin(), chain.k.end(), [](double k) { return !(k > 0.0); }) ||
      !(chain.eta >= 0.0)) {
    throw bad_input("Kelvin chain", "a spring of stiffness 0 carries no load in series",
                    "springs above 0 and eta of at least 0");
  }
  Coefficients<double> merged;
  merged.first = chain.k0;
  merged.eta = chain.eta;
  merged.fluid = chain.eta > 0.0;
  for (const std::size_t i : order_of_times(chain.T_s)) {
    if (!merged.time.empty() && merged.time.back() == chain.T_s[i]) {
      // Two units of one retardation time are one unit with the sum of their compliances.
      merged.k.back() = 1.0 / (1.0 / merged.k.back() + 1.0 / chain.k[i]);
      continue;
    }
    merged.time.push_back(chain.T_s[i]);
    merged.k.push_back(chain.k[i]);
  }
  const Coefficients<double> c = parallel_of(merged);
  return {c.first, c.k, c.time};
}

}  // namespace tpm
