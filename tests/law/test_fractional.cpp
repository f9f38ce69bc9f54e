// Fractional laws: the Mittag-Leffler function against a table in 25 digits, the exponential sums
// against it, weights against high-precision arithmetic, histories against exact superposition.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "exact_weights.hpp"
#include "expected_values.hpp"
#include "fractional_reference.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/law/relaxation/cardinal_weight.hpp"
#include "tpm/law/relaxation/exponential_sum.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// (a - b)/h for every part.
FractionalWeights difference(const FractionalWeights& a, const FractionalWeights& b, double h) {
  FractionalWeights d;
  d.weight = (a.weight - b.weight) / h;
  d.constant = (a.constant - b.constant) / h;
  d.dashpot_s = (a.dashpot_s - b.dashpot_s) / h;
  return d;
}

/// (4 fine - coarse)/3: the error of central differences of h/2 and h without its leading term.
FractionalWeights richardson(const FractionalWeights& fine, const FractionalWeights& coarse) {
  FractionalWeights d;
  d.weight = (4.0 * fine.weight - coarse.weight) / 3.0;
  d.constant = (4.0 * fine.constant - coarse.constant) / 3.0;
  d.dashpot_s = (4.0 * fine.dashpot_s - coarse.dashpot_s) / 3.0;
  return d;
}

/// Largest difference in units of the tolerance: 1 for weights, `time` for dashpots.
double distance(const FractionalWeights& a, const FractionalWeights& b, double time) {
  return std::max({(a.weight - b.weight).cwiseAbs().maxCoeff(), std::abs(a.constant - b.constant),
                   std::abs(a.dashpot_s - b.dashpot_s) / time});
}

}  // namespace

TEST_CASE("the Mittag-Leffler function agrees with the table of 25 digits") {
  std::istringstream table(
      read_file(std::string(TPM_TEST_SOURCE_DIR) + "/tests/fixtures/mittag_leffler.csv"));
  std::string line;
  int rows = 0;
  while (std::getline(table, line)) {
    if (line.starts_with("#") || line.starts_with("alpha")) continue;
    std::istringstream cells(line);
    std::string alpha_text;
    std::string beta_text;
    std::string z_text;
    std::string value_text;
    std::getline(cells, alpha_text, ',');
    std::getline(cells, beta_text, ',');
    std::getline(cells, z_text, ',');
    std::getline(cells, value_text);
    const double alpha = std::strtod(alpha_text.c_str(), nullptr);
    const double z = std::strtod(z_text.c_str(), nullptr);
    const double value = std::strtod(value_text.c_str(), nullptr);
    const double beta = beta_text == "alpha"     ? alpha
                        : beta_text == "1+alpha" ? 1.0 + alpha
                                                 : std::strtod(beta_text.c_str(), nullptr);
    CAPTURE(line);
    const double got = mittag_leffler(alpha, beta, z);
    if (std::abs(value) < 1e-300) {
      CHECK_THAT(got, WithinAbs(value, 1e-300));
    } else {
      CHECK_THAT(got, WithinRel(value, 1e-13));
    }
    ++rows;
  }
  CHECK(rows == 11 * 33 * 4);
}

TEST_CASE(
    "the Mittag-Leffler function of free orders, and its slopes, agree with the table of 20 "
    "digits") {
  std::istringstream table(
      read_file(std::string(TPM_TEST_SOURCE_DIR) + "/tests/fixtures/mittag_leffler_slopes.csv"));
  int rows = 0;
  double worst = 0.0;
  double worst_slope = 0.0;
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with("#") || line.starts_with("a,")) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    std::array<std::string, 7> text;
    for (std::string& cell : text) cells >> cell;
    std::array<double, 7> x{};
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::strtod(text[i].c_str(), nullptr);
    const auto [a, b, z, value, d_a, d_b, d_z] = x;
    const MittagLeffler got = mittag_leffler_with_slopes(a, b, z);
    worst = std::max(worst, (1.0 + z) * std::abs(got.value - value));
    worst_slope = std::max({worst_slope, (1.0 + z) * std::abs(got.d_a - d_a),
                            (1.0 + z) * std::abs(got.d_b - d_b),
                            (1.0 + z) * (1.0 + z) * std::abs(got.d_z - d_z)});
    ++rows;
  }
  CHECK(rows == 10 * 7 * 11);
  CHECK(worst < 1e-12);
  CHECK(worst_slope < 1e-12);
}

TEST_CASE("the function of free orders has that of the usual ones as its special case") {
  for (const double a : {0.05, 0.4, 0.9, 1.0}) {
    for (const double z : {0.0, 1e-9, 0.3, 4.0, 1e5}) {
      for (const double b : {1.0, 2.0, a, 1.0 + a}) {
        CAPTURE(a, b, z);
        CHECK_THAT(mittag_leffler_with_slopes(a, b, z).value,
                   WithinAbs(mittag_leffler(a, b, z), 1e-12 / (1.0 + z)));
      }
    }
  }
  CHECK_THAT(mittag_leffler_with_slopes(0.0, 0.7, 3.0).value,  // a geometric series
             WithinRel(0.25 / std::tgamma(0.7), 1e-12));
  CHECK(mittag_leffler_with_slopes(0.5, 0.7, INFINITY).value == 0.0);
  CHECK_THROWS_WITH(mittag_leffler_with_slopes(1.1, 1.0, 1.0), Catch::Contains("a = 1.1"));
  CHECK_THROWS_WITH(mittag_leffler_with_slopes(0.5, -0.1, 1.0), Catch::Contains("b = -0.1"));
  CHECK_THROWS_WITH(mittag_leffler_with_slopes(0.5, 1.0, NAN), Catch::Contains("z = nan"));
}

TEST_CASE("the Mittag-Leffler function outside the usual times") {
  for (const double alpha : {1e-3, 0.05, 0.5, 0.9, 0.9999, 1.0}) {
    CAPTURE(alpha);
    CHECK(mittag_leffler(alpha, 1.0, 0.0) == 1.0);
    CHECK_THAT(mittag_leffler(alpha, 2.0, 0.0), WithinRel(1.0, 1e-15));
    CHECK_THAT(mittag_leffler(alpha, alpha, 0.0), WithinRel(1.0 / std::tgamma(alpha), 1e-15));
    CHECK(mittag_leffler(alpha, 1.0, INFINITY) == 0.0);
    CHECK_THAT(mittag_leffler(alpha, 2.0, 1e200),
               WithinRel(1e-200 / std::tgamma(2.0 - alpha), 1e-12));
    CHECK_THAT(mittag_leffler(alpha, 1.0 + alpha, 1e200), WithinRel(1e-200, 1e-12));
    if (alpha < 1.0) {
      CHECK_THAT(mittag_leffler(alpha, 1.0, 1e200),
                 WithinRel(1e-200 / std::tgamma(1.0 - alpha), 1e-11));
    }
    // the series and the integral meet at z = 0.1
    for (const double beta : {1.0, 2.0, alpha, 1.0 + alpha}) {
      CHECK_THAT(mittag_leffler(alpha, beta, std::nextafter(0.1, 1.0)),
                 WithinRel(mittag_leffler(alpha, beta, 0.1), 1e-14));
    }
  }
  CHECK_THROWS_WITH(mittag_leffler(0.0, 1.0, 1.0), Catch::Contains("alpha = 0"));
  CHECK_THROWS_WITH(mittag_leffler(1.1, 1.0, 1.0), Catch::Contains("0 < alpha <= 1"));
  CHECK_THROWS_WITH(mittag_leffler(NAN, 1.0, 1.0), Catch::Contains("alpha = nan"));
  CHECK_THROWS_WITH(mittag_leffler(0.5, 1.0, -1.0), Catch::Contains("z = -1"));
  CHECK_THROWS_WITH(mittag_leffler(0.5, 1.0, NAN), Catch::Contains("z = nan"));
  CHECK_THROWS_WITH(mittag_leffler(0.5, 1.2, 1.0), Catch::Contains("beta = 1.2"));
}

TEST_CASE("relaxation is completely monotone") {
  // Differences on an even grid alternate in sign, (-1)^n Delta^n > 0; so do those of the slope.
  for (const double alpha : {0.05, 0.3, 0.5, 0.8, 0.95, 0.99, 1.0}) {
    for (const double beta : {1.0, 2.0, alpha, 1.0 + alpha}) {
      std::vector<double> f;
      for (int i = 0; i <= 40; ++i) f.push_back(mittag_leffler(alpha, beta, 0.05 + 0.2 * i));
      for (int order = 0; order <= 5; ++order) {
        CAPTURE(alpha, beta, order);
        CHECK(*std::min_element(f.begin(), f.end()) > 0.0);
        for (std::size_t i = 0; i + 1 < f.size(); ++i) f[i] -= f[i + 1];
        f.pop_back();
      }
    }
  }
}

TEST_CASE("cardinal weights agree with their formula in 100 digits, near and far from the pole") {
  const double h = 0.23;
  double worst = 0.0;
  double worst_slope = 0.0;
  for (const double alpha : kAlphas) {
    for (const double phase : {-0.5, -0.3, -1e-3, 0.0, 1e-9, 1e-6, 0.02, 0.25, 0.4999}) {
      const CardinalWeight weight(alpha, phase, h);
      for (const long m : {-60L, -7L, -1L, 0L, 1L, 2L, 9L, 100L}) {
        if (alpha == 1.0 && m == 0 && phase == 0.0) continue;  // 0/0 as written
        const SpectralValue w = weight.at(m);
        const test::ExactWeight exact = test::exact_cardinal_weight(alpha, m, phase, h);
        const auto off = [](double got, double slope) {
          return std::abs(got - slope) / std::max(1.0, std::abs(slope));
        };
        worst = std::max(worst, std::abs(w.value - exact.value));
        worst_slope = std::max({worst_slope, off(w.d_x, exact.d_x), off(w.d_alpha, exact.d_alpha)});
      }
    }
  }
  CHECK(worst < 1e-14);
  CHECK(worst_slope < 1e-12);
  CHECK_THAT(CardinalWeight(1.0, 0.0, h).at(0).value, WithinRel(1.0, 1e-15));
}

TEST_CASE("the spectrum beyond an edge in closed form equals its sum term by term") {
  for (const double alpha : {0.3, 0.7, 0.9, 0.99}) {
    const RelaxationSpectrum spectrum(alpha);
    const auto check = [&](double x, double h, double relative) {
      SpectralValue sum;
      for (int k = 600; k >= 0; --k) sum += spectrum.density(x + k * h).times(h);
      const SpectralValue closed = spectrum.sum_from(x, h);
      CAPTURE(alpha, x, h);
      CHECK_THAT(closed.value, WithinRel(sum.value, relative));
      CHECK_THAT(closed.d_x, WithinRel(sum.d_x, 2.0 * relative));
      CHECK_THAT(closed.d_alpha, WithinRel(sum.d_alpha, 2.0 * relative));
    };
    check(6.0, 0.25, 6e-11);
    check(12.0, 0.25, 1.5e-11);
    check(12.0, 0.5, 1.5e-8);  // notices the last difference
  }
}

TEST_CASE("sums of exponentials keep their stated error over the window") {
  double worst = 0.0;
  double worst_slope = 0.0;
  for (const double span : {1e4, 1e8}) {
    const double t_min = 0.02;
    const double t_max = span * t_min;
    const ExponentialSum exponentials(t_min, t_max);
    CHECK(static_cast<double>(exponentials.rates_per_s().size()) <=
          (span < 1e5 ? test::allowed_cost("exponential_sum.rates_over_4_decades")
                      : test::allowed_cost("exponential_sum.rates_over_8_decades")));
    CHECK(exponentials.stated_error() <= 1e-9);
    FractionalWeights w;
    for (const double alpha : kAlphas) {
      for (const double tau : decades(1e-3 * t_min, 1e3 * t_max, 12)) {
        exponentials.mittag_leffler(alpha, tau, w);
        for (const double t : decades(t_min, t_max, 14)) {
          const double exact = relaxation(alpha, tau, t);
          const double integral = relaxation_integral(alpha, tau, t);
          worst = std::max({worst, std::abs(sum_at(exponentials, w, t) - exact),
                            std::abs(sum_integral_s(exponentials, w, t) - integral) / t});
          const double slope = relaxation_by_log_tau(alpha, tau, t);
          worst_slope =
              std::max(worst_slope, std::abs(sum_at(exponentials, by_log_tau(w), t) - slope));
        }
      }
    }
  }
  CAPTURE(worst, worst_slope);
  CHECK(worst < 1e-9);
  CHECK(worst_slope < 1e-8);
}

TEST_CASE("the sum for the spring-pot keeps its stated error over the window") {
  for (const double t_min : {1e-3, 1.0, 50.0}) {
    const double t_max = 1e6 * t_min;
    const ExponentialSum exponentials(t_min, t_max);
    FractionalWeights w;
    for (const double alpha : kAlphas) {
      exponentials.springpot(alpha, w);
      CHECK(w.weight.minCoeff() >= 0.0);
      CHECK(w.constant >= 0.0);
      const double scale = springpot(alpha, t_min);
      for (const double t : decades(t_min, t_max, 40)) {
        CAPTURE(t_min, alpha, t);
        CHECK_THAT(sum_at(exponentials, w, t), WithinAbs(springpot(alpha, t), 1e-9 * scale));
        CHECK_THAT(sum_integral_s(exponentials, w, t),
                   WithinRel(springpot_integral(alpha, t), 1e-9));
      }
    }
    CHECK(w.weight.maxCoeff() == 0.0);  // alpha = 1 is a dashpot of 1 s and nothing else
    CHECK(w.constant == 0.0);
    CHECK_THAT(w.dashpot_s, WithinRel(1.0, 1e-15));
  }
}

TEST_CASE("a wider tolerance needs fewer rates and is kept, a tighter one too") {
  std::size_t before = 0;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    const ExponentialSum exponentials(0.1, 1e3, tolerance);
    CHECK(exponentials.rates_per_s().size() > before);
    before = exponentials.rates_per_s().size();
    FractionalWeights w;
    double worst = 0.0;
    for (const double alpha : {0.02, 0.3, 0.8, 0.98, 1.0}) {
      for (const double tau : decades(1e-3, 1e5, 17)) {
        exponentials.mittag_leffler(alpha, tau, w);
        for (const double t : decades(0.1, 1e3, 13)) {
          worst = std::max(worst, std::abs(sum_at(exponentials, w, t) - relaxation(alpha, tau, t)));
        }
      }
    }
    CAPTURE(tolerance, worst);
    CHECK(worst < exponentials.stated_error() + 2e-14);
    CHECK(worst > 1e-3 * tolerance);  // nor is it bought with needless rates
  }
}

TEST_CASE("alpha = 1 is exp, reached continuously, also with 1/tau on a rate of the grid") {
  const ExponentialSum exponentials(0.1, 1e4);
  const std::span<const double> rates = exponentials.rates_per_s();
  FractionalWeights w;
  for (const double tau : {1e-4, 0.5, 7.0, 1.0 / rates[40], 1.0 / rates[60], 3e6}) {
    exponentials.mittag_leffler(1.0, tau, w);
    for (const double t : decades(0.1, 1e4, 30)) {
      CAPTURE(tau, t);
      CHECK_THAT(sum_at(exponentials, w, t), WithinAbs(std::exp(-t / tau), 1e-9));
      CHECK_THAT(sum_integral_s(exponentials, w, t) / t,
                 WithinAbs(-std::expm1(-t / tau) * tau / t, 1e-9));
    }
    const FractionalWeights classical = w;
    for (const double gap : {1e-5, 1e-6, 1e-8, 1e-10, 1e-13, 1e-15}) {
      CAPTURE(tau, gap);
      exponentials.mittag_leffler(1.0 - gap, tau, w);
      CHECK(distance(w, classical, 0.1) < 30.0 * gap + 1e-12);
      for (const double t : decades(0.1, 1e4, 9)) {
        CHECK_THAT(sum_at(exponentials, w, t), WithinAbs(relaxation(1.0 - gap, tau, t), 1e-9));
      }
    }
  }
}

TEST_CASE("derivatives of the weights equal differences of the weights") {
  const double t_min = 0.05;
  const ExponentialSum exponentials(t_min, 2e3);
  const auto ask = [&](double alpha, double log_tau) {
    FractionalWeights w;
    exponentials.mittag_leffler(alpha, std::exp(log_tau), w);
    return w;
  };
  const auto ask_springpot = [&](double alpha) {
    FractionalWeights w;
    exponentials.springpot(alpha, w);
    return w;
  };
  const double h = 1e-4;
  for (const double alpha : {0.02, 0.2, 0.5, 0.66, 0.8, 0.95, 0.967, 0.99, 0.999}) {
    for (const double log_tau : {-9.0, -2.0, 0.0, 0.115, 3.0, 12.0}) {
      const FractionalWeights w = ask(alpha, log_tau);
      const auto slope_alpha = [&](double e) {
        return difference(ask(alpha + e, log_tau), ask(alpha - e, log_tau), 2.0 * e);
      };
      const auto slope_tau = [&](double e) {
        return difference(ask(alpha, log_tau + e), ask(alpha, log_tau - e), 2.0 * e);
      };
      CAPTURE(alpha, log_tau);
      const double scale = 1.0 + by_alpha(w).weight.cwiseAbs().maxCoeff();
      CHECK(distance(by_alpha(w), richardson(slope_alpha(h / 2), slope_alpha(h)), t_min) <
            1e-9 * scale);
      CHECK(distance(by_log_tau(w), richardson(slope_tau(h / 2), slope_tau(h)), t_min) < 1e-9);
    }
    const FractionalWeights p = ask_springpot(alpha);
    const auto slope = [&](double e) {
      return difference(ask_springpot(alpha + e), ask_springpot(alpha - e), 2.0 * e);
    };
    CAPTURE(alpha);
    const double scale = 1.0 + by_alpha(p).weight.cwiseAbs().maxCoeff();
    CHECK(distance(by_alpha(p), richardson(slope(h / 2), slope(h)), 1.0) < 1e-9 * scale);
    CHECK(by_log_tau(p).weight.isZero(0.0));
  }
}

TEST_CASE("at alpha = 1 the derivative by alpha is the limit from below") {
  const ExponentialSum exponentials(0.05, 2e3);
  const double h = 1e-4;
  for (const double tau : {1e-4, 1.0, 1.1, 1.0 / exponentials.rates_per_s()[50], 1e5}) {
    FractionalWeights at;
    FractionalWeights one;
    FractionalWeights two;
    FractionalWeights four;
    exponentials.mittag_leffler(1.0, tau, at);
    exponentials.mittag_leffler(1.0 - h, tau, one);
    exponentials.mittag_leffler(1.0 - 2 * h, tau, two);
    exponentials.mittag_leffler(1.0 - 4 * h, tau, four);
    // one-sided differences without their first two error terms
    const FractionalWeights d1 = difference(at, one, h);
    const FractionalWeights d2 = difference(at, two, 2 * h);
    const FractionalWeights d4 = difference(at, four, 4 * h);
    FractionalWeights limit;
    limit.weight = (8.0 * d1.weight - 6.0 * d2.weight + d4.weight) / 3.0;
    limit.constant = (8.0 * d1.constant - 6.0 * d2.constant + d4.constant) / 3.0;
    limit.dashpot_s = (8.0 * d1.dashpot_s - 6.0 * d2.dashpot_s + d4.dashpot_s) / 3.0;
    CAPTURE(tau);
    CHECK(distance(by_alpha(at), limit, 0.05) < 1e-6);
  }
  // E_alpha itself: its derivative by alpha against the accurate function
  FractionalWeights w;
  for (const double alpha : {0.1, 0.4, 0.7, 0.9, 0.98}) {
    exponentials.mittag_leffler(alpha, 3.0, w);
    for (const double t : {0.05, 1.0, 3.0, 20.0, 2e3}) {
      const auto slope = [&](double e) {
        return (relaxation(alpha + e, 3.0, t) - relaxation(alpha - e, 3.0, t)) / (2.0 * e);
      };
      CAPTURE(alpha, t);
      CHECK_THAT(sum_at(exponentials, by_alpha(w), t),
                 WithinAbs((4.0 * slope(h / 2) - slope(h)) / 3.0, 1e-8));
    }
  }
}

TEST_CASE("a random piecewise linear history agrees with exact superposition") {
  Random random(1729);
  std::vector<double> time{0.0};
  std::vector<double> u{0.0};
  const double t_min = 0.01;
  for (int i = 0; i < 90; ++i) {
    time.push_back(time.back() + t_min * std::pow(300.0, random.uniform()));
    u.push_back(random.normal());
  }
  const ExponentialSum exponentials(t_min, time.back());
  const std::span<const double> rates = exponentials.rates_per_s();
  // the states do not depend on the element: one run for all
  std::vector<std::vector<double>> state(time.size(), std::vector<double>(rates.size(), 0.0));
  double variation = 0.0;
  for (std::size_t i = 1; i < time.size(); ++i) {
    variation += std::abs(u[i] - u[i - 1]);
    for (std::size_t j = 0; j < rates.size(); ++j) {
      const double z = rates[j] * (time[i] - time[i - 1]);
      state[i][j] = std::exp(-z) * state[i - 1][j] - std::expm1(-z) / z * (u[i] - u[i - 1]);
    }
  }
  const auto check = [&](const FractionalWeights& w, auto integral, double tolerance) {
    for (std::size_t i = 1; i < time.size(); ++i) {
      double exact = 0.0;
      for (std::size_t k = 1; k <= i; ++k) {
        exact += (u[k] - u[k - 1]) / (time[k] - time[k - 1]) *
                 (integral(time[i] - time[k - 1]) - integral(time[i] - time[k]));
      }
      double sum = w.constant * u[i] + w.dashpot_s * (u[i] - u[i - 1]) / (time[i] - time[i - 1]);
      for (std::size_t j = 0; j < rates.size(); ++j) {
        sum += w.weight[static_cast<Eigen::Index>(j)] * state[i][j];
      }
      CHECK_THAT(sum, WithinAbs(exact, tolerance));
    }
  };
  FractionalWeights w;
  for (const double alpha : {0.05, 0.5, 0.95, 1.0}) {
    const double tau = alpha == 0.5 ? 1e-3 : 0.7;
    CAPTURE(alpha);
    exponentials.mittag_leffler(alpha, tau, w);
    check(
        w, [&](double t) { return relaxation_integral(alpha, tau, t); },
        exponentials.stated_error() * variation);
    exponentials.springpot(alpha, w);
    check(
        w, [&](double t) { return springpot_integral(alpha, t); },
        exponentials.stated_error() * variation * std::pow(t_min, -alpha) + 1e-12);
  }
}

TEST_CASE("weights of the Mittag-Leffler relaxation are positive where they can be") {
  const ExponentialSum exponentials(0.1, 1e4);
  FractionalWeights w;
  for (const double tau : {1e-4, 0.3, 40.0, 1e6}) {
    for (const double alpha : {0.01, 0.3, 0.7, 0.9}) {
      exponentials.mittag_leffler(alpha, tau, w);
      CAPTURE(alpha, tau);
      CHECK(w.weight.minCoeff() > 0.0);
      CHECK(w.constant > 0.0);
      CHECK(w.dashpot_s > 0.0);
    }
    exponentials.mittag_leffler(1.0, tau, w);
    CHECK(w.weight.minCoeff() > -0.25);
    CHECK(w.weight.cwiseAbs().sum() < 4.0);
  }
}

TEST_CASE("bad windows and elements are named") {
  CHECK_THROWS_WITH(ExponentialSum(0.0, 1.0), "exponential sum: t_min = 0; expected a time > 0 s");
  CHECK_THROWS_WITH(ExponentialSum(1.0, 0.5), Catch::Contains("t_max = 0.5"));
  CHECK_THROWS_WITH(ExponentialSum(1.0, INFINITY), Catch::Contains("t_max = inf"));
  CHECK_THROWS_WITH(ExponentialSum(1.0, 2.0, 0.1), Catch::Contains("tolerance = 0.1"));
  const ExponentialSum exponentials(1.0, 2.0);
  FractionalWeights w;
  CHECK_THROWS_WITH(exponentials.mittag_leffler(0.0, 1.0, w), Catch::Contains("alpha = 0"));
  CHECK_THROWS_WITH(exponentials.mittag_leffler(0.5, 0.0, w), Catch::Contains("tau = 0"));
  CHECK_THROWS_WITH(exponentials.mittag_leffler(0.5, INFINITY, w), Catch::Contains("tau = inf"));
  CHECK_THROWS_WITH(exponentials.springpot(1.5, w), Catch::Contains("alpha = 1.5"));
  CHECK_THROWS_WITH(exponentials.springpots_in_series(1.5, 0.1, 1.0, w),
                    Catch::Contains("alpha = 1.5"));
  CHECK_THROWS_WITH(exponentials.springpots_in_series(0.5, -0.1, 1.0, w),
                    Catch::Contains("beta = -0.1"));
  CHECK_THROWS_WITH(exponentials.springpots_in_series(0.5, 0.1, 0.0, w),
                    Catch::Contains("tau = 0"));
}
