#include "tpm/law/relaxation/creep_exact.hpp"

#include <ceres/jet.h>

#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <limits>

#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// The moduli and the load of the problem, as numbers or as numbers with derivatives.
template <class T>
struct Problem {
  T E1, E2, Eprime, eta1, spacing;
  T stress_length;  // load l0 / A0

  [[nodiscard]] T equilibrium() const { return E1 * E2 / (E1 + E2); }
  [[nodiscard]] T tau() const { return eta1 / (E1 + E2); }

  /// T'(u) = 2 E' (1 - cos^3)
  [[nodiscard]] T tension_slope(const T& u) const {
    const T m = one_minus_cosine(u, spacing);
    const T c = 1.0 - m;
    return 2.0 * Eprime * m * (1.0 + c + c * c);
  }
  [[nodiscard]] T tension(const T& u) const {
    return 2.0 * Eprime * one_minus_cosine(u, spacing) * u;
  }
  /// (T(a) - T(b)) / (a - b) without cancellation, a and b >= 0, not both 0:
  /// 2 E' (1 - x (a + b) / (a rb + b ra) x / (ra rb)) with ra = sqrt(x^2 + a^2).
  [[nodiscard]] T tension_secant(const T& a, const T& b) const {
    using std::sqrt;
    const T ra = sqrt(spacing * spacing + a * a);
    const T rb = sqrt(spacing * spacing + b * b);
    return 2.0 * Eprime *
           (1.0 - spacing * spacing * spacing * (a + b) / (ra * rb * (a * rb + b * ra)));
  }
};

/// t/tau from the start to the depth `final - remaining`; see the class comment. `start_remaining`
/// and `remaining` are distances from the final depth, so that nothing cancels close to it.
template <class T>
T reduced_time(const Problem<T>& p, const T& final_depth, const T& start_remaining,
               const T& remaining) {
  using std::log;
  using Rule = boost::math::quadrature::gauss<double, 40>;
  const T final_slope = p.tension_slope(final_depth);
  const T residue = (p.E2 + final_slope) / (p.equilibrium() + final_slope);
  const auto smooth = [&](const T& v) {
    const T u = final_depth - v;
    const T secant = p.tension_secant(u, final_depth);
    const T numerator = (p.tension_slope(u) - final_slope) - residue * (secant - final_slope);
    return numerator / ((p.equilibrium() + secant) * v);
  };
  const T half = 0.5 * (start_remaining - remaining);
  const T middle = 0.5 * (start_remaining + remaining);
  T sum(0.0);
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i) {
    const double x = Rule::abscissa()[i];
    sum += Rule::weights()[i] * (smooth(middle - x * half) + smooth(middle + x * half));
  }
  return residue * log(start_remaining / remaining) + half * sum;
}

Problem<double> plain(const TpmParameters& p, double stress_length) {
  return {p.E1_Pa, p.E2_Pa, p.Eprime_Pa, p.eta1_Pa_s, p.spacing_m, stress_length};
}

/// The remaining depth has fallen below rounding of the depth itself.
constexpr double kSettled = 40.0;

}  // namespace

CreepUnderConstantLoad::CreepUnderConstantLoad(const TpmParameters& p, double load_N)
    : p_(p),
      sign_(load_N < 0.0 ? -1.0 : 1.0),
      stress_length_(std::abs(load_N) / p.modulus_to_stiffness_m()),
      tau_(p.relaxation_time_s()) {
  require_valid(p, "creep");
  if (!std::isfinite(load_N)) throw bad_input("creep", "the load is not finite");
  if (stress_length_ == 0.0) return;
  if (p.Eprime_Pa == 0.0 && !(p.equilibrium_modulus_Pa() > 0.0)) {
    throw bad_input("creep", "no spring carries the load in the end: E1 or E2 is 0 and so is E'",
                    "E' above 0, or E1 and E2 above 0");
  }
  start_ = equilibrium_depth_m(p, p.E2_Pa, std::abs(load_N));
  final_ = equilibrium_depth_m(p, p.equilibrium_modulus_Pa(), std::abs(load_N));
}

double CreepUnderConstantLoad::remaining_log(double time_s) const {
  if (std::isinf(time_s)) return time_s;
  // Solve reduced_time(start e^-y) = t / tau for y; the left side rises strictly with y.
  const Problem<double> p = plain(p_, stress_length_);
  const double gap = final_ - start_;
  const double target = time_s / tau_;
  const double final_slope = p.tension_slope(final_);
  const double residue = (p.E2 + final_slope) / (p.equilibrium() + final_slope);
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  double y = target / residue;
  for (int iteration = 0; iteration < 100; ++iteration) {
    if (y > 2.0 * kSettled && low > kSettled) return y;
    const double v = gap * std::exp(-std::min(y, 700.0));
    const double error = reduced_time(p, final_, gap, v) - target;
    (error > 0.0 ? high : low) = y;
    const double u = final_ - v;
    const double slope =
        (p.E2 + p.tension_slope(u)) / (p.equilibrium() + p.tension_secant(u, final_));
    double next = y - error / slope;
    if (!(next > low && next < high)) next = std::isfinite(high) ? 0.5 * (low + high) : 2.0 * y;
    if (std::abs(next - y) <= 1e-15 * (1.0 + y)) return next;
    y = next;
  }
  return y;  // the bracket has shrunk to rounding
}

double CreepUnderConstantLoad::depth_m(double time_s) const {
  const double gap = final_ - start_;
  if (!(gap > 0.0)) return sign_ * final_;
  if (time_s <= 0.0) return sign_ * start_;
  return sign_ * (final_ - gap * std::exp(-remaining_log(time_s)));
}

TpmVector CreepUnderConstantLoad::depth_sensitivity(double time_s) const {
  using Jet = ceres::Jet<double, 6>;
  TpmVector s{};
  if (stress_length_ == 0.0) return s;
  const Problem<Jet> p{Jet(p_.E1_Pa, 0),     Jet(p_.E2_Pa, 1),     Jet(p_.Eprime_Pa, 2),
                       Jet(p_.eta1_Pa_s, 3), Jet(p_.spacing_m, 4), Jet(stress_length_, 5)};
  // One Newton step in Jets turns a root into a root with its derivatives.
  const auto with_derivatives = [&](double root, const Jet& modulus) {
    const Jet e(root);
    const double slope = modulus.a + p.tension_slope(e).a;
    return e - (modulus * e + p.tension(e) - p.stress_length) / slope;
  };
  const Jet final_depth = with_derivatives(final_, p.equilibrium());
  const Jet start = with_derivatives(start_, p.E2);
  const double gap = final_ - start_;
  Eigen::Matrix<double, 6, 1> d = final_depth.v;
  if (gap > 0.0) {
    const double y = time_s > 0.0 ? remaining_log(time_s) : 0.0;
    if (y <= 0.0) {
      d = start.v;
    } else if (y < kSettled) {
      // At constant t:  de = -(dt/dp) / (dt/de), both taken at the depth reached.
      Jet start_remaining = final_depth - start;
      start_remaining.a = gap;
      Jet remaining = final_depth;
      remaining.a = gap * std::exp(-y);
      const Jet time = p.tau() * reduced_time(p, final_depth, start_remaining, remaining);
      const Jet u(final_ - remaining.a);
      const double time_slope =
          tau_ * (p.E2.a + p.tension_slope(u).a) /
          ((p.equilibrium() + p.tension_secant(u, final_depth)).a * remaining.a);
      d = -time.v / time_slope;
    }
  }
  s[kE1] = sign_ * d[0];
  s[kE2] = sign_ * d[1];
  s[kEprime] = sign_ * d[2];
  s[kEta1] = sign_ * d[3];
  s[kSpacing] = sign_ * d[4];
  s[kA0] = -sign_ * d[5] * stress_length_ / p_.A0_m2;
  s[kL0] = sign_ * d[5] * stress_length_ / p_.l0_m;
  return s;
}

}  // namespace tpm::law
