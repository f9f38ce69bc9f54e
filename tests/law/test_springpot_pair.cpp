// Two spring-pots in series as a sum of exponentials: weights against their formula in 100 digits,
// sums against the Mittag-Leffler function of free orders, limits, derivatives.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "exact_weights.hpp"
#include "fractional_reference.hpp"
#include "tpm/law/relaxation/cardinal_weight.hpp"
#include "tpm/law/relaxation/springpot_pair.hpp"

using namespace tpm;
using namespace tpm::law;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Orders {
  double alpha;
  double beta;
};
constexpr Orders kOrders[] = {{0.3, 0.0},   {0.9, 0.0},       {1.0, 0.0},       {1.0, 1e-9},
                              {0.5, 0.1},   {0.5, 0.4999},    {0.6, 0.6},       {0.9, 0.3},
                              {1.0, 0.3},   {1.0, 0.02},      {0.98, 0.01},     {0.999, 1e-4},
                              {0.95, 0.9},  {1.0, 0.98},      {0.04, 0.01},     {0.2, 0.7},
                              {0.01, 0.99}, {1 - 1e-12, 0.0}, {0.999999, 1e-7}, {1.0, 1.0}};

/// G(t) of a pair and its mean over [0, t], tau = 1, by the Mittag-Leffler function.
double pair_modulus(const Orders& o, double t) {
  const double low = std::min(o.alpha, o.beta);
  const double d = std::abs(o.alpha - o.beta);
  return std::pow(t, -low) * mittag_leffler_with_slopes(d, 1.0 - low, std::pow(t, d)).value;
}
double pair_mean(const Orders& o, double t) {
  const double low = std::min(o.alpha, o.beta);
  const double d = std::abs(o.alpha - o.beta);
  return std::pow(t, -low) * mittag_leffler_with_slopes(d, 2.0 - low, std::pow(t, d)).value;
}

FractionalWeights by_beta(const FractionalWeights& w) {
  return weights_of(w.d_weight_d_beta, w.d_constant_d_beta, w.d_dashpot_d_beta_s);
}

FractionalWeights series_weights(const ExponentialSum& exponentials, const Orders& o, double tau) {
  FractionalWeights w;
  exponentials.springpots_in_series(o.alpha, o.beta, tau, w);
  return w;
}

}  // namespace

TEST_CASE("weights of two spring-pots agree with their formula in 100 digits", "[pair]") {
  const double h = 0.23;
  double worst = 0.0;
  double worst_slope = 0.0;
  for (const Orders& o : kOrders) {
    if (!(o.alpha > o.beta + 1e-3)) continue;  // the formula divides by their difference
    for (const double phase : {-0.5, -1e-3, 0.0, 1e-9, 0.02, 0.25}) {
      const PairWeight weight(o.alpha, o.beta, phase, h);
      for (const long m : {-60L, -7L, -1L, 0L, 1L, 2L, 9L, 60L}) {
        if (o.alpha == 1.0 && o.beta == 0.0 && m == 0 && phase == 0.0) continue;  // 0/0 as written
        const PairValue w = weight.at(m);
        const test::ExactWeight exact = test::exact_pair_weight(o.alpha, o.beta, m, phase, h);
        const double x = h * (static_cast<double>(m) + phase);
        const double scale = 1.0 + std::exp(x * (x > 0.0 ? o.beta : o.alpha));
        const auto off = [scale](double got, double slope) {
          return std::abs(got - slope) / std::max(scale, std::abs(slope));
        };
        worst = std::max(worst, std::abs(w.value - exact.value) / scale);
        worst_slope = std::max({worst_slope, off(w.d_alpha, exact.d_alpha),
                                off(w.d_beta, exact.d_beta), off(w.d_x, exact.d_x)});
      }
    }
  }
  CHECK(worst < 1e-14);
  CHECK(worst_slope < 1e-12);
}

TEST_CASE("without the second order the weights are those of one spring-pot", "[pair]") {
  for (const double alpha : kAlphas) {
    const CardinalWeight one(alpha, 0.13, 0.2);
    const PairWeight two(alpha, 0.0, 0.13, 0.2);
    const PairWeight exchanged(0.0, alpha, 0.13, 0.2);
    for (long m = -200; m <= 200; m += 7) {
      CAPTURE(alpha, m);
      const SpectralValue w = one.at(m);
      const PairValue p = two.at(m);
      CHECK_THAT(p.value, WithinAbs(w.value, 1e-15));
      CHECK_THAT(p.d_alpha, WithinAbs(w.d_alpha, 1e-12 * (1.0 + std::abs(w.d_alpha))));
      CHECK_THAT(p.d_x, WithinAbs(w.d_x, 1e-13));
      CHECK(exchanged.at(m).value == p.value);
      CHECK(exchanged.at(m).d_beta == p.d_alpha);
    }
  }
}

TEST_CASE("the contour sum of a pair is the Mittag-Leffler function", "[pair]") {
  for (const Orders& o : kOrders) {
    for (const double t : decades(1e-6, 1e6, 13)) {
      CAPTURE(o.alpha, o.beta, t);
      const double size = 1.0 / (std::pow(t, o.alpha) + std::pow(t, o.beta));
      CHECK_THAT(pair_relaxation(o.alpha, o.beta, t).value,
                 WithinAbs(pair_modulus(o, t), 1e-12 * size));
      CHECK_THAT(pair_relaxation_mean(o.alpha, o.beta, t).value,
                 WithinAbs(pair_mean(o, t), 1e-12 * size));
    }
  }
}

TEST_CASE("the sum for two spring-pots keeps its stated error over the window", "[pair]") {
  const double t_min = 0.02;
  for (const double span : {1e3, 1e7}) {
    const ExponentialSum exponentials(t_min, span * t_min, 1e-10);
    double worst = 0.0;
    double worst_slope = 0.0;
    for (const Orders& o : kOrders) {
      for (const double tau : decades(1e-4 * t_min, 1e4 * span * t_min, 12)) {
        const FractionalWeights w = series_weights(exponentials, o, tau);
        const double scale = pair_mean(o, t_min / tau);
        for (const double t : decades(t_min, span * t_min, 14)) {
          CAPTURE(o.alpha, o.beta, tau, t);
          const PairValue exact = pair_relaxation(o.alpha, o.beta, t / tau);
          const double off = std::abs(sum_at(exponentials, w, t) - pair_modulus(o, t / tau));
          const double mean = sum_integral_s(exponentials, w, t) / t - pair_mean(o, t / tau);
          if (std::max(off, std::abs(mean)) > 1e-10 * scale) {
            FAIL_CHECK(off / scale << " " << mean / scale);
          }
          worst = std::max({worst, off / scale, std::abs(mean) / scale});
          // derivatives are of the size of G and of G ln(t/tau)
          const double steep = scale * (1.0 + std::abs(std::log(t_min / tau)));
          worst_slope = std::max(
              {worst_slope, std::abs(sum_at(exponentials, by_alpha(w), t) - exact.d_alpha) / steep,
               std::abs(sum_at(exponentials, by_beta(w), t) - exact.d_beta) / steep,
               std::abs(sum_at(exponentials, by_log_tau(w), t) - exact.d_x) / steep});
        }
      }
    }
    CAPTURE(span, worst, worst_slope);
    CHECK(worst < 1e-10);
    CHECK(worst_slope < 2e-9);
  }
}

TEST_CASE("derivatives of the weights of a pair equal differences", "[pair]") {
  const ExponentialSum exponentials(0.05, 2e3);
  const double h = 1e-4;
  for (const Orders& o : {Orders{0.3, 0.1}, Orders{0.6, 0.55}, Orders{0.9, 0.3}, Orders{0.97, 0.02},
                          Orders{0.999, 0.002}, Orders{0.2, 0.7}}) {
    for (const double log_tau : {-9.0, 0.0, 0.115, 3.0, 12.0}) {
      const auto ask = [&](double da, double db, double dt) {
        return series_weights(exponentials, {o.alpha + da, o.beta + db}, std::exp(log_tau + dt));
      };
      /// central differences of h and h/2 without their leading error
      const auto slope = [&](double a, double b, double t) {
        const auto d = [&](double e, const auto& part) {
          return ((part(ask(a * e, b * e, t * e)) - part(ask(-a * e, -b * e, -t * e))) / (2 * e))
              .eval();
        };
        const auto parts = [](const FractionalWeights& w) {
          Eigen::VectorXd all(w.weight.size() + 2);
          all << w.weight, w.constant, w.dashpot_s;
          return all;
        };
        return ((4.0 * d(h / 2, parts) - d(h, parts)) / 3.0).eval();
      };
      const auto off = [&](const FractionalWeights& got, const Eigen::VectorXd& exact) {
        Eigen::VectorXd all(got.weight.size() + 2);
        all << got.weight, got.constant, got.dashpot_s;
        return (all - exact).cwiseAbs().maxCoeff() / (1.0 + exact.cwiseAbs().maxCoeff());
      };
      const FractionalWeights w = ask(0, 0, 0);
      CAPTURE(o.alpha, o.beta, log_tau);
      CHECK(off(by_alpha(w), slope(1, 0, 0)) < 1e-8);
      CHECK(off(by_beta(w), slope(0, 1, 0)) < 1e-8);
      CHECK(off(by_log_tau(w), slope(0, 0, 1)) < 1e-8);
    }
  }
}

TEST_CASE("the sum of a pair does not know which spring-pot is named first", "[pair]") {
  const ExponentialSum exponentials(0.01, 1e3);
  const FractionalWeights one = series_weights(exponentials, {0.8, 0.25}, 0.4);
  const FractionalWeights other = series_weights(exponentials, {0.25, 0.8}, 0.4);
  CHECK((one.weight - other.weight).cwiseAbs().maxCoeff() <=
        1e-14 * one.weight.cwiseAbs().maxCoeff());
  CHECK((one.d_weight_d_alpha - other.d_weight_d_beta).cwiseAbs().maxCoeff() <=
        1e-14 * one.d_weight_d_alpha.cwiseAbs().maxCoeff());
  CHECK_THAT(one.dashpot_s, WithinRel(other.dashpot_s, 1e-10));
}
