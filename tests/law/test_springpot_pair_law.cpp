// Laws of two spring-pots through the law model: names, closed forms, limits, and G, J, G' and G''
// against each other.
#include <algorithm>
#include <boost/math/quadrature/ooura_fourier_integrals.hpp>
#include <boost/math/quadrature/tanh_sinh.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "expected_values.hpp"
#include "law_answers.hpp"
#include "step_response.hpp"
#include "tpm/files/blocks/law_export.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/law/prony_table.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"
#include "tpmkit/frequency_response.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"
#include "tpmkit/protocol.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::largest;

namespace {

constexpr double kEnd = 20.0;    // N/m
constexpr double kFirst = 30.0;  // N/m
constexpr double kOther = 12.0;  // N/m
constexpr double kTime = 0.7;    // s

struct PairLaw {
  const char* name;
  const char* one_springpot;  ///< what it is for beta = 0
};
constexpr std::array<PairLaw, 3> kPairLaws{{{"linear-fmaxwell2", "linear-fmaxwell"},
                                            {"linear-fkelvin_voigt2", "linear-fkelvin_voigt"},
                                            {"linear-fzener2", "linear-fzener"}}};

LawSpec law_of(const char* name) {
  return parse_law_name(name, "test");
}

std::vector<double> pair_values(const LawSpec& spec, double alpha, double beta) {
  std::vector<double> values;
  for (const LawParameter& p : law_parameters(spec)) {
    values.push_back(p.name == "k_inf"   ? kEnd
                     : p.name == "k1"    ? kFirst
                     : p.name == "k2"    ? kOther
                     : p.name == "tau1"  ? kTime
                     : p.name == "alpha" ? alpha
                     : p.name == "beta"  ? beta
                                         : 0.0);
  }
  return values;
}

/// The integral of G from 0 to t, by the Mittag-Leffler function of free orders.
double integral_of(const LawSpec& spec, double alpha, double beta, double t) {
  if (t <= 0.0) return 0.0;
  const auto springpot = [&](double order) {
    return std::pow(t, 1.0 - order) / std::tgamma(2.0 - order);
  };
  if (spec.fractional == Fractional::kelvin_voigt_pair) {
    return kFirst * springpot(alpha) + kOther * springpot(beta);
  }
  const double x = t / kTime;
  const double relaxing =
      t * std::pow(x, -beta) *
      mittag_leffler_with_slopes(alpha - beta, 2.0 - beta, std::pow(x, alpha - beta)).value;
  return kFirst * relaxing + (spec.fractional == Fractional::zener_pair ? kEnd * t : 0.0);
}

constexpr std::array<std::array<double, 2>, 7> kPairs{
    {{0.3, 0.05}, {0.6, 0.3}, {0.9, 0.1}, {0.95, 0.9}, {1.0, 0.4}, {1.0, 0.01}, {0.5, 0.5}}};

/// Central differences of f by every parameter against its slopes, relative to the largest.
template <class Function>
void check_slopes(const std::vector<double>& values, const Eigen::VectorXd& slopes,
                  const Function& f, double tolerance) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double step = 1e-4 * std::max(std::abs(values[i]), 1e-2);
    const auto difference = [&](double h) {
      auto up = values;
      auto down = values;
      up[i] += h;
      down[i] -= h;
      return (f(up) - f(down)) / (2.0 * h);
    };
    const double exact = (4.0 * difference(0.5 * step) - difference(step)) / 3.0;
    CAPTURE(i);
    const double size =
        std::max(std::abs(f(values)) / std::max(std::abs(values[i]), 1e-2), std::abs(exact));
    CHECK_THAT(slopes[static_cast<Eigen::Index>(i)], WithinAbs(exact, tolerance * size));
  }
}

}  // namespace

TEST_CASE("laws of two spring-pots have names, words and parameters", "[pair]") {
  for (const PairLaw& pair : kPairLaws) {
    const LawSpec spec = law_of(pair.name);
    CHECK(law_name(spec) == pair.name);
    CHECK(has_two_springpots(spec.fractional));
    CHECK_THAT(law_words(spec), Catch::EndsWith("of two spring-pots, no tension"));
  }
  const auto names = [](const char* name) {
    std::string all;
    for (const LawParameter& p : law_parameters(law_of(name))) all += p.name + " ";
    return all;
  };
  CHECK(names("linear-fmaxwell2") == "k1 tau1 alpha beta contact offset ");
  CHECK(names("hertz-fkelvin_voigt2") == "k1 k2 alpha beta contact offset ");
  CHECK(names("power-fzener2-elastic") ==
        "k_inf k1 tau1 alpha beta exponent k_tension spacing contact offset ");
  CHECK_THROWS_WITH(law_of("linear-fzener2-fluid"), Catch::Contains("fractional law"));
  CHECK_THROWS_WITH(law_of("linear-fspringpot2"), Catch::Contains("unknown law"));
  CHECK_THROWS_WITH(law_of("power-0"), Catch::Contains("did you mean 'power'?"));
  CHECK_THROWS_WITH(law_of("linear-1-2"), !Catch::Contains("did you mean"));
  const LawSpec zener = law_of("linear-fzener2");
  CHECK_THROWS_WITH(LawModel(zener).require_in_range(pair_values(zener, 0.5, 1.01)),
                    Catch::Contains("beta = 1.01; expected a value from 0 to 1"));
}

TEST_CASE("a ramp and hold of two spring-pots is answered in closed form", "[pair]") {
  const double rate = 2e-3;
  const double ramp_s = 1.5;
  std::vector<double> times;
  for (int i = 1; i <= 300; ++i) times.push_back(0.1 * i);
  const Protocol ramp = ramp_and_hold(rate * ramp_s, rate, 30.0);
  for (const PairLaw& pair : kPairLaws) {
    const LawSpec spec = law_of(pair.name);
    for (const auto& [alpha, beta] : kPairs) {
      const auto force =
          LawModel(spec).respond(ramp, times, pair_values(spec, alpha, beta), Want::values).value;
      double worst = 0.0;
      for (std::size_t i = 0; i < times.size(); ++i) {
        if (alpha == 1.0 && times[i] == ramp_s) continue;  // a dashpot's force jumps here
        const double exact = rate * (integral_of(spec, alpha, beta, times[i]) -
                                     integral_of(spec, alpha, beta, times[i] - ramp_s));
        worst = std::max(worst, std::abs(force[static_cast<Eigen::Index>(i)] - exact));
      }
      INFO(pair.name << ", alpha " << alpha << ", beta " << beta);
      CHECK(worst < 1e-9 * largest(force));
    }
  }
}

TEST_CASE("a kept step is answered by G and J, with slopes by every parameter", "[pair]") {
  const std::vector<double> times{0.003, 0.2, 1.0, 40.0};
  for (const char* name :
       {"linear-fspringpot", "linear-fmaxwell", "linear-fkelvin_voigt", "linear-fzener",
        "linear-fmaxwell2", "linear-fkelvin_voigt2", "linear-fzener2"}) {
    const LawSpec spec = law_of(name);
    const LawModel model(spec);
    auto values = pair_values(spec, 0.6, 0.25);
    values[values.size() - 2] = 2e-4;  // contact
    values.back() = 1e-3;              // offset
    const Protocol depth = step_and_hold(2e-3, 100.0);
    const Protocol load = creep(0.05, 100.0);
    for (const Protocol* step : {&depth, &load}) {
      const Response response = model.respond(*step, times, values, Want::values_and_sensitivity);
      for (std::size_t i = 0; i < times.size(); ++i) {
        const auto row = static_cast<Eigen::Index>(i);
        INFO(name << (step == &depth ? ", depth" : ", load") << ", t " << times[i]);
        const double exact = step == &depth
                                 ? 1e-3 + 1.8e-3 * law_relaxation(spec, values, times[i]).value
                                 : 2e-4 + 0.049 * law_creep(spec, values, times[i]).value;
        CHECK_THAT(response.value[row], WithinRel(exact, 1e-12));
        check_slopes(
            values, response.sensitivity.row(row).transpose(),
            [&](const std::vector<double>& at) {
              return model.respond(*step, std::span(&times[i], 1), at, Want::values).value[0];
            },
            1e-6);
      }
    }
  }
  CHECK_THROWS_WITH(LawModel(law_of("linear-fspringpot"))
                        .respond(step_and_hold(2e-3, 100.0), std::vector<double>{0.0, 1.0},
                                 std::vector<double>{kFirst, 0.5, 0.0, 0.0}, Want::values),
                    Catch::Contains("a spring-pot answers with an infinite force"));
}

TEST_CASE("with beta = 0 a law of two spring-pots is that of one", "[pair]") {
  const Protocol push(Drive::displacement,
                      {{0.0, 0.0}, {0.7, 2e-3}, {1.5, 1.8e-3}, {2.0, 3e-3}, {6.0, 3e-3}});
  std::vector<double> times;
  for (int i = 1; i < 200; ++i) times.push_back(0.03 * i);
  const std::vector<double> frequency{1e-3, 0.1, 3.0, 1e3};
  for (const PairLaw& pair : kPairLaws) {
    for (const double alpha : {0.05, 0.5, 0.95, 1.0}) {
      const LawSpec two = law_of(pair.name);
      const LawSpec one = law_of(pair.one_springpot);
      auto few = pair_values(one, alpha, 0.0);
      if (two.fractional == Fractional::kelvin_voigt_pair) few[0] = kOther;
      const auto many = pair_values(two, alpha, 0.0);
      INFO(pair.name << ", alpha " << alpha);
      const auto force = [&](const LawSpec& spec, const std::vector<double>& values) {
        return LawModel(spec).respond(push, times, values, Want::values).value;
      };
      const Eigen::VectorXd exact = force(one, few);
      CHECK(largest(force(two, many) - exact) < 1e-9 * largest(exact));
      // and continuously: a small beta changes little
      const Eigen::VectorXd near = force(two, pair_values(two, alpha, 1e-7));
      CHECK(largest(near - exact) < 1e-5 * largest(exact));
      const auto r = respond_spectrum(two, many, frequency, std::nullopt, Want::values);
      const auto s = respond_spectrum(one, few, frequency, std::nullopt, Want::values);
      for (Eigen::Index i = 0; i < r.storage.size(); ++i) {
        const double size = std::hypot(s.storage[i], s.loss[i]);
        CHECK_THAT(r.storage[i], WithinAbs(s.storage[i], 1e-13 * size));
        CHECK_THAT(r.loss[i], WithinAbs(s.loss[i], 1e-13 * size));
      }
    }
  }
}

TEST_CASE("with alpha = 1 one of two spring-pots is a dashpot", "[pair]") {
  std::vector<double> times;
  for (int i = 1; i < 100; ++i) times.push_back(0.05 * i);
  const Protocol ramp = ramp_and_hold(4e-3, 1e-3, 6.0);
  const auto ask = [&](const char* name, const std::vector<double>& values) {
    return LawModel(law_of(name)).respond(ramp, times, values, Want::values).value;
  };
  // side by side: the spring-pot alone, and the dashpot's force while the probe moves
  const Eigen::VectorXd both = ask("linear-fkelvin_voigt2", {kFirst, kOther, 1.0, 0.3, 0.0, 0.0});
  const Eigen::VectorXd alone = ask("linear-fspringpot", {kOther, 0.3, 0.0, 0.0});
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (std::abs(times[i] - 4.0) < 1e-9) continue;  // the end of the ramp
    const double dashpot = times[i] < 4.0 ? kFirst * 1e-3 : 0.0;
    const auto row = static_cast<Eigen::Index>(i);
    CHECK_THAT(both[row] - alone[row], WithinAbs(dashpot, 1e-12));
  }
  // in series with a spring: a Maxwell branch
  const Eigen::VectorXd maxwell = ask("linear-1-fluid", {kFirst, kTime, 0.0, 0.0});
  const Eigen::VectorXd pair = ask("linear-fmaxwell2", {kFirst, kTime, 1.0, 0.0, 0.0, 0.0});
  CHECK(largest(pair - maxwell) < 1e-9 * largest(maxwell));
}

TEST_CASE("the spring-pots may be named in either order", "[pair]") {
  const Protocol ramp = ramp_and_hold(4e-3, 1e-3, 6.0);
  const std::vector<double> times{0.5, 1.0, 4.0, 5.0, 9.0};
  const auto ask = [&](const char* name, const std::vector<double>& values) {
    return LawModel(law_of(name)).respond(ramp, times, values, Want::values).value;
  };
  const Eigen::VectorXd series = ask("linear-fzener2", {5.0, kFirst, kTime, 0.7, 0.2, 0.0, 0.0});
  CHECK(largest(series - ask("linear-fzener2", {5.0, kFirst, kTime, 0.2, 0.7, 0.0, 0.0})) <
        1e-12 * largest(series));
  const Eigen::VectorXd beside = ask("linear-fkelvin_voigt2", {kFirst, kOther, 0.7, 0.2, 0.0, 0.0});
  CHECK(largest(beside - ask("linear-fkelvin_voigt2", {kOther, kFirst, 0.2, 0.7, 0.0, 0.0})) <
        1e-12 * largest(beside));
}

TEST_CASE("in time the derivatives by all parameters of two spring-pots are exact", "[pair]") {
  const Protocol push(Drive::displacement, {{0.0, 0.0}, {0.7, 2e-3}, {2.0, 3e-3}, {6.0, 2.5e-3}});
  const std::vector<double> times{0.1, 0.5, 0.7, 1.3, 2.0, 2.5, 6.0};
  for (const char* name :
       {"linear-fmaxwell2", "linear-fkelvin_voigt2", "linear-fzener2", "power-fzener2"}) {
    const LawSpec spec = law_of(name);
    const LawModel law(spec);
    auto values = pair_values(spec, 0.7, 0.15);
    if (spec.kernel == Kernel::power) values[law.index("exponent")] = 1.6;
    // At 0 the differences to both sides would not agree: one of them begins in contact.
    values[law.index("contact")] = 1e-4;
    const auto r = law.respond(push, times, values, Want::values_and_sensitivity);
    for (std::size_t i = 0; i < times.size(); ++i) {
      INFO(name << " at " << times[i] << " s");
      const auto row = static_cast<Eigen::Index>(i);
      check_slopes(
          values, r.sensitivity.row(row).transpose(),
          [&](const std::vector<double>& v) {
            return law.respond(push, times, v, Want::values).value[row];
          },
          1e-5);
    }
  }
}

TEST_CASE("G(t) by the contour is the closed form, with exact derivatives", "[pair]") {
  for (const char* name :
       {"linear-fmaxwell2", "linear-fkelvin_voigt2", "linear-fzener2", "linear-fzener",
        "linear-fmaxwell", "linear-fspringpot", "linear-fkelvin_voigt", "linear-2",
        "linear-2-series", "linear-2-fluid"}) {
    const LawSpec spec = law_of(name);
    auto values = pair_values(spec, 0.7, 0.15);
    if (spec.branches == 2) values = {20.0, 30.0, 12.0, 0.4, 3.0, 0.0, 0.0};
    if (!spec.solid) values = {30.0, 12.0, 0.4, 3.0, 0.0, 0.0};
    for (const double t : {1e-4, 0.03, 1.0, 20.0}) {
      INFO(name << " at " << t << " s");
      const SlopedNumber g = law_relaxation(spec, values, t);
      CHECK_THAT(g.value,
                 WithinAbs(relaxation_stiffness(spec, values, t), 1e-11 * g.value + 1e-11));
      check_slopes(
          values, g.by, [&](const auto& v) { return law_relaxation(spec, v, t).value; }, 1e-7);
      const SlopedNumber j = law_creep(spec, values, t);
      CHECK(j.value > 0.0);
      check_slopes(
          values, j.by, [&](const auto& v) { return law_creep(spec, v, t).value; }, 1e-7);
    }
  }
  const LawSpec spec = law_of("linear-fzener2");
  CHECK_THROWS_WITH(law_creep(spec, pair_values(spec, 0.7, 0.15), 0.0),
                    "law linear-fzener2: time 0 s; expected a finite time above 0 s");
  CHECK_THROWS_WITH(
      law_creep(spec, std::vector<double>{0, 0, 1, 0.5, 0.1, 0, 0}, 1.0),
      "law linear-fzener2: no stiffness, so no compliance; expected a stiffness above 0");
}

TEST_CASE("the creep of two spring-pots in closed form", "[pair]") {
  const LawSpec series = law_of("linear-fmaxwell2");
  const LawSpec beside = law_of("linear-fkelvin_voigt2");
  for (const auto& [alpha, beta] : kPairs) {
    for (const double t : {1e-5, 0.02, 0.7, 5.0, 1e4}) {
      CAPTURE(alpha, beta, t);
      const double x = t / kTime;
      const double springpots = (std::pow(x, alpha) / std::tgamma(1.0 + alpha) +
                                 std::pow(x, beta) / std::tgamma(1.0 + beta)) /
                                kFirst;
      CHECK_THAT(law_creep(series, pair_values(series, alpha, beta), t).value,
                 WithinRel(springpots, 1e-11));
      const double z = kOther / kFirst * std::pow(t, alpha - beta);
      const double retarded = std::pow(t, alpha) / kFirst *
                              mittag_leffler_with_slopes(alpha - beta, 1.0 + alpha, z).value;
      CHECK_THAT(law_creep(beside, pair_values(beside, alpha, beta), t).value,
                 WithinRel(retarded, 1e-11));
    }
  }
}

TEST_CASE("the convolution of G and J is t", "[pair]") {
  boost::math::quadrature::tanh_sinh<double> quadrature;
  for (const PairLaw& pair : kPairLaws) {
    const LawSpec spec = law_of(pair.name);
    for (const auto& [alpha, beta] : kPairs) {
      const auto values = pair_values(spec, alpha, beta);
      for (const double t : {0.05, 1.0, 30.0}) {
        INFO(pair.name << ", alpha " << alpha << ", beta " << beta << ", t " << t);
        // G from its closed form; both ends may be singular, so each half starts from its end
        const auto left = [&](double s) {
          return relaxation_stiffness(spec, values, s) * law_creep(spec, values, t - s).value;
        };
        const auto right = [&](double s) {
          return relaxation_stiffness(spec, values, t - s) * law_creep(spec, values, s).value;
        };
        // a dashpot's relaxation is a pulse at 0, which the closed form leaves out
        const double pulse = spec.fractional == Fractional::kelvin_voigt_pair && alpha == 1.0
                                 ? kFirst * law_creep(spec, values, t).value
                                 : 0.0;
        const double whole = quadrature.integrate(left, 0.0, 0.5 * t) +
                             quadrature.integrate(right, 0.0, 0.5 * t) + pulse;
        CHECK_THAT(whole, WithinRel(t, 1e-6));
      }
    }
  }
}

TEST_CASE("storage and loss are the Fourier integrals of G(t)", "[pair]") {
  boost::math::quadrature::ooura_fourier_sin<double> sine(1e-9, 8);
  boost::math::quadrature::ooura_fourier_cos<double> cosine(1e-9, 8);
  for (const PairLaw& pair : kPairLaws) {
    const LawSpec spec = law_of(pair.name);
    for (const auto& [alpha, beta] :
         {std::array{0.6, 0.3}, std::array{0.9, 0.1}, std::array{0.4, 0.2}}) {
      const auto values = pair_values(spec, alpha, beta);
      const double end = spec.fractional == Fractional::zener_pair ? kEnd : 0.0;
      const auto relaxing = [&](double t) { return relaxation_stiffness(spec, values, t) - end; };
      for (const double frequency : {0.02, 0.3, 5.0}) {
        const double omega = 2.0 * std::numbers::pi * frequency;
        const std::vector<double> at{frequency};
        const auto r = respond_spectrum(spec, values, at, std::nullopt, Want::values);
        INFO(pair.name << ", alpha " << alpha << ", beta " << beta << ", " << frequency << " Hz");
        // G* = i omega integral G(t) exp(-i omega t) dt
        CHECK_THAT(r.storage[0],
                   WithinRel(end + omega * sine.integrate(relaxing, omega).first, 1e-6));
        CHECK_THAT(r.loss[0], WithinRel(omega * cosine.integrate(relaxing, omega).first, 1e-6));
      }
    }
  }
}

TEST_CASE("a jump is refused by two spring-pots, and a load makes them creep", "[pair][heavy]") {
  const Protocol second_step(Drive::displacement,
                             {{0.0, 0.0}, {1.0, 1e-3}, {2.0, 1e-3}, {2.0, 2e-3}, {5.0, 2e-3}});
  for (const PairLaw& pair : kPairLaws) {
    LawSpec spec = law_of(pair.name);
    spec.reference = 0.01;
    const LawModel law(spec);
    CHECK_THROWS_WITH(law.respond(second_step, std::vector<double>{3.0},
                                  pair_values(spec, 0.6, 0.1), Want::values),
                      Catch::Contains("jumps at 2 s") && Catch::Contains("expected a ramp"));
    const std::vector<double> times{0.0, 0.05, 0.2, 1.0, 5.0, 40.0};
    for (const auto& [alpha, beta] : kPairs) {
      const auto values = pair_values(spec, alpha, beta);
      const auto depth = law.respond(creep(0.2, 40.0), times, values, Want::values).value;
      INFO(pair.name << ", alpha " << alpha << ", beta " << beta);
      CHECK(depth[0] == 0.0);
      for (std::size_t i = 1; i < times.size(); ++i) {
        CHECK_THAT(depth[static_cast<Eigen::Index>(i)],
                   WithinRel(0.2 * law_creep(spec, values, times[i]).value, 5e-6));
      }
    }
  }
}

TEST_CASE("infinite time relaxes two spring-pots fully, but not a spring", "[pair]") {
  const std::vector<double> ends{INFINITY};
  const Protocol ramp(Drive::displacement, {{0.0, 0.0}, {2.0, 2e-3}}, "ramp", true);
  const auto end_of = [&](const char* name, const std::vector<double>& values) {
    return LawModel(law_of(name)).respond(ramp, ends, values, Want::values).value[0];
  };
  CHECK_THAT(end_of("linear-fmaxwell2", {kFirst, kTime, 0.6, 0.1, 0.0, 0.0}),
             WithinAbs(0.0, 1e-12));
  CHECK_THAT(end_of("linear-fzener2", {kEnd, kFirst, kTime, 0.6, 0.1, 0.0, 0.0}),
             WithinAbs(2e-3 * kEnd, 1e-12));
  CHECK_THAT(end_of("linear-fkelvin_voigt2", {kFirst, kOther, 0.6, 0.1, 0.0, 0.0}),
             WithinAbs(0.0, 1e-12));
  CHECK_THAT(end_of("linear-fkelvin_voigt2", {kFirst, kOther, 0.6, 0.0, 0.0, 0.0}),
             WithinAbs(2e-3 * kOther, 1e-12));
}

TEST_CASE("laws of two spring-pots go through files and exports", "[pair]") {
  for (const PairLaw& pair : kPairLaws) {
    LawFile law;
    law.spec = law_of(pair.name);
    law.values = pair_values(law.spec, 0.6, 0.1);
    const LawFile back = law_from_json(to_json(law), "test");
    CHECK(back.spec == law.spec);
    CHECK(back.values == law.values);
    const PronyTable table = prony_table(law.spec, law.values, {});
    CHECK(table.worst_relative_error < test::allowed_error("prony.two_springpots"));
    for (const double t : {0.01, 0.3, 5.0, 100.0}) {
      CHECK_THAT(table.at(t), WithinRel(law_relaxation(law.spec, law.values, t).value,
                                        1.001 * table.worst_relative_error));
    }
    ExportOptions options;
    CHECK_THAT(export_law(law, options), Catch::Contains("two spring-pots"));
  }
}

TEST_CASE("a curved kernel creeps by J as the straight one does", "[pair]") {
  // V(u(t)) = J(t) F for every kernel, and the slopes by every parameter follow.
  const std::vector<double> times_s{0.01, 0.3, 4.0, 70.0};
  constexpr double kLoad = 0.05;
  for (const char* name :
       {"power-fzener", "hertz-fspringpot", "power-fzener2", "linear-fmaxwell-relaxing"}) {
    const LawSpec spec = law_of(name);
    std::vector<double> values;
    for (const LawParameter& q : law_parameters(spec)) {
      values.push_back(q.dimension == Dimension::stiffness ? 25.0
                       : q.name == "tau1"                  ? 2.0
                       : q.name == "alpha"                 ? 0.6
                       : q.name == "beta"                  ? 0.2
                       : q.name == "exponent"              ? 1.8
                       : q.name == "tension_share"         ? 0.3
                       : q.name == "spacing"               ? 0.03
                       : q.name == "contact"               ? 2e-4
                                                           : 1e-3);
    }
    const LawModel model(spec);
    const Protocol load = creep(kLoad, 100.0);
    const Response r = model.respond(load, times_s, values, Want::values_and_sensitivity);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      INFO(name << " at " << times_s[i] << " s");
      const double v = law_creep(spec, values, times_s[i]).value * (kLoad - 1e-3);
      const double u = r.value[static_cast<Eigen::Index>(i)] - 2e-4;
      const double u_ref = spec.reference;
      if (spec.kernel != Kernel::linear) {
        const double m = spec.kernel == Kernel::hertz ? 1.5 : 1.8;
        CHECK_THAT(u_ref * std::pow(u / u_ref, m), WithinRel(v, 1e-12));
      }
      check_slopes(
          values, r.sensitivity.row(static_cast<Eigen::Index>(i)).transpose(),
          [&](const std::vector<double>& at) {
            return model.respond(load, times_s, at, Want::values)
                .value[static_cast<Eigen::Index>(i)];
          },
          1e-6);
    }
  }
}
