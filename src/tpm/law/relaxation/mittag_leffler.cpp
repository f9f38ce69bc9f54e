#include "tpm/law/relaxation/mittag_leffler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/laplace_contour.hpp"
#include "tpm/law/relaxation/relaxation_spectrum.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {

namespace {

using std::numbers::pi;

/// Up to here the power series loses nothing to cancellation and needs at most 17 terms.
constexpr double kSeriesUpTo = 0.1;
/// Step of the trapezoidal rule in ln(rate): its error is exp(-pi^2/h) = 7e-18.
constexpr double kStep = 0.25;
/// ln(rate t) from where on exp(-rate t) is 1, and where it is 0, to rounding.
constexpr double kSlowest = -38.0;
constexpr double kFastest = 6.7;

[[noreturn]] void refuse_argument(const char* what, double value, const char* expected) {
  throw bad_input("Mittag-Leffler function", fmt::format("{} = {}", what, shortest(value)),
                  expected);
}

void check(double alpha, double beta, double z) {
  if (!(alpha > 0.0 && alpha <= 1.0)) refuse_argument("alpha", alpha, "0 < alpha <= 1");
  if (!(z >= 0.0)) refuse_argument("z", z, "z >= 0, for the argument -z");
  if (beta != 1.0 && beta != 2.0 && beta != alpha && beta != 1.0 + alpha) {
    refuse_argument("beta", beta, "1, 2, alpha or 1 + alpha");
  }
}

double power_series(double alpha, double beta, double z) {
  double sum = 0.0;
  double power = 1.0;
  for (int n = 0; n <= 18; ++n) {
    sum += power / std::tgamma(alpha * n + beta);
    power *= -z;
  }
  return sum;
}

/// Contribution of an exponential of the rate r as a function of s = ln(r t).
enum class Response { step, ramp, slope };

/// exp(-r t);  (1 - exp(-r t))/(r t);  r t exp(-r t).
double contribution(Response response, double s) {
  const double rt = std::exp(s);
  if (response == Response::step) return std::exp(-rt);
  return response == Response::ramp ? -std::expm1(-rt) / rt : rt * std::exp(-rt);
}

/// The same at a complex s with 0 <= Im s < pi/2.
std::complex<double> contribution(Response response, std::complex<double> s) {
  constexpr double kGone = 745.0;  // exp(-rt) is 0
  const double decay = std::exp(s.real()) * std::cos(s.imag());
  if (decay > kGone) return response == Response::ramp ? std::exp(-s) : 0.0;
  const std::complex<double> rt = std::exp(s);
  if (response == Response::step) return std::exp(-rt);
  return response == Response::ramp ? (1.0 - std::exp(-rt)) / rt : rt * std::exp(-rt);
}

/// Error of the trapezoidal rule due to the two poles of the spectrum, which lie halfway between
/// nodes at s = log_t +- i height. As alpha -> 1 it becomes the whole answer.
double pole_term(Response response, const RelaxationSpectrum& spectrum, double log_t) {
  const double height = spectrum.pole_height();
  if (height >= 0.5 * pi) return 0.0;  // below exp(-pi^2/h)
  const double g = std::exp(-2.0 * pi * height / kStep);
  const std::complex<double> at_pole = contribution(response, std::complex(log_t, height));
  return 2.0 / spectrum.alpha() * g / (1.0 + g) * at_pole.real();
}

/// Where the fast rates no longer count in the response to a ramp: above s = 0 spectrum times
/// contribution falls as exp(-(1 - alpha) s), beyond the peak of the spectrum as exp(-(1 + alpha)
/// s).
double end_of_ramp(double alpha, double log_t) {
  constexpr double kFalls = 40.0;
  return std::min(kFalls / (1.0 - alpha), std::max(log_t, 0.0) + kFalls / (1.0 + alpha));
}

/// The integral of spectrum times contribution, as a sum over s = ln(rate t).
double spectral_sum(Response response, double alpha, double z) {
  const RelaxationSpectrum spectrum(alpha);
  const double log_t = std::log(z) / alpha;
  // The nodes are placed so that the poles lie halfway between two of them.
  const double shift = std::remainder(log_t + 0.5 * kStep, kStep);
  const int first = static_cast<int>(kSlowest / kStep);
  const double end = response == Response::ramp ? end_of_ramp(alpha, log_t) : kFastest;
  const int last = static_cast<int>(end / kStep);
  double sum = pole_term(response, spectrum, log_t);
  if (response != Response::slope) {  // slower rates contribute 1 each
    sum += spectrum.sum_from(log_t - (shift + (first - 1) * kStep), kStep).value;
  }
  for (int j = first; j <= last; ++j) {
    const double s = shift + j * kStep;
    sum += kStep * spectrum.density(s - log_t).value * contribution(response, s);
  }
  return sum;
}

/// alpha = 1: beta is 1 (or alpha) or 2 (or 1 + alpha).
double exponential(double beta, double z) {
  if (z == 0.0) return 1.0;
  return beta == 1.0 ? std::exp(-z) : -std::expm1(-z) / z;
}

}  // namespace

double mittag_leffler(double alpha, double beta, double z) {
  check(alpha, beta, z);
  if (std::isinf(z)) return 0.0;
  if (alpha == 1.0) return exponential(beta, z);
  if (z <= kSeriesUpTo) return power_series(alpha, beta, z);
  if (beta == 1.0) return spectral_sum(Response::step, alpha, z);
  if (beta == 2.0) return spectral_sum(Response::ramp, alpha, z);
  if (beta == alpha) return spectral_sum(Response::slope, alpha, z) / z;
  return (1.0 - spectral_sum(Response::step, alpha, z)) / z;
}

MittagLeffler mittag_leffler_with_slopes(double a, double b, double z) {
  if (!(a >= 0.0 && a <= 1.0)) refuse_argument("a", a, "0 to 1");
  if (!(b >= 0.0 && b <= 3.0)) refuse_argument("b", b, "0 to 3");
  if (!(z >= 0.0)) refuse_argument("z", z, "z >= 0, for the argument -z");
  MittagLeffler sum;
  if (std::isinf(z)) return sum;
  for (const ContourNode& node : contour_nodes()) {
    const std::complex<double> inverse = 1.0 / (std::exp(a * node.log_s) + z);
    const std::complex<double> term = node.weight * std::exp((a - b) * node.log_s) * inverse;
    sum.value += term.real();
    sum.d_a += (term * node.log_s * z * inverse).real();
    sum.d_b -= (term * node.log_s).real();
    sum.d_z -= (term * inverse).real();
  }
  return sum;
}

}  // namespace tpm::law
