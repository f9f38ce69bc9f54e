// The only source of the tests with arithmetic in 100 digits: it takes long to compile, and to run
// where it is not optimised.
#include "exact_weights.hpp"

#include <boost/math/constants/constants.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>

namespace tpm::test {
namespace {

/// Without expression templates, which are slow to compile.
using Digits100 = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>,
                                                boost::multiprecision::et_off>;

const Digits100& pi() {
  return boost::math::constants::pi<Digits100>();
}

/// Step of the differences: their error is far below the digits of a double.
const Digits100& step() {
  static const Digits100 kStep("1e-25");
  return kStep;
}

double slope(const Digits100& up, const Digits100& down) {
  return static_cast<double>((up - down) / (2 * step()));
}

Digits100 place_of(long m, double phase, double h) {
  return Digits100(h) * (m + Digits100(phase));
}

Digits100 cardinal_weight(const Digits100& alpha, const Digits100& x, const Digits100& h) {
  const Digits100 b = pi() * (1 - alpha);
  const Digits100 residue = exp(-pi() * b / (alpha * h));
  const Digits100 S = sinh(alpha * x);
  const Digits100 C = cosh(alpha * x);
  const Digits100 D = S * S + sin(b) * sin(b);
  const Digits100 turn = pi() * x / h;
  return h / (2 * pi()) *
         (sin(b) / (C - cos(b)) +
          2 * residue * (sin(turn) * S * cos(b) - cos(turn) * C * sin(b)) / D);
}

Digits100 pair_weight(const Digits100& alpha, const Digits100& beta, const Digits100& x,
                      const Digits100& h) {
  const Digits100 d = alpha - beta;
  const Digits100 density =
      (exp(beta * x) * sin(pi() * alpha) + exp(alpha * x) * sin(pi() * beta)) /
      (2 * pi() * (cosh(d * x) + cos(pi() * d)));
  // Re of exp(i p)/sinh(v), v = -d x + i b
  const Digits100 b = pi() * (1 - d);
  const Digits100 p = pi() * ((alpha + beta) / (2 * d) - x / h);
  const Digits100 re = -sinh(d * x) * cos(b);
  const Digits100 im = cosh(d * x) * sin(b);
  const Digits100 residue =
      exp(-pi() * b / (d * h)) * (cos(p) * re + sin(p) * im) / (re * re + im * im);
  return h * density - h / pi() * residue;
}

}  // namespace

ExactWeight exact_cardinal_weight(double alpha, long m, double phase, double h) {
  const Digits100 a(alpha), x = place_of(m, phase, h), step_h(h);
  const Digits100& e = step();
  return {static_cast<double>(cardinal_weight(a, x, step_h)),
          slope(cardinal_weight(a + e, x, step_h), cardinal_weight(a - e, x, step_h)), 0.0,
          slope(cardinal_weight(a, x + e, step_h), cardinal_weight(a, x - e, step_h))};
}

ExactWeight exact_pair_weight(double alpha, double beta, long m, double phase, double h) {
  const Digits100 a(alpha), b(beta), x = place_of(m, phase, h), step_h(h);
  const Digits100& e = step();
  return {static_cast<double>(pair_weight(a, b, x, step_h)),
          slope(pair_weight(a + e, b, x, step_h), pair_weight(a - e, b, x, step_h)),
          slope(pair_weight(a, b + e, x, step_h), pair_weight(a, b - e, x, step_h)),
          slope(pair_weight(a, b, x + e, step_h), pair_weight(a, b, x - e, step_h))};
}

}  // namespace tpm::test
