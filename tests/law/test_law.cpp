// The family of laws against closed forms, quadrature, finite differences and the paper's element.
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/quadrature/tanh_sinh.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "law_answers.hpp"
#include "random_laws.hpp"
#include "tpm/base/random.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/law/kelvin_chain.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::law;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::evenly;

namespace {

Eigen::VectorXd coefficients(const Prony& law) {
  const auto n = static_cast<Eigen::Index>(law.k.size());
  Eigen::VectorXd all(2 * n + 1);
  all << law.k_inf, Eigen::Map<const Eigen::VectorXd>(law.k.data(), n),
      Eigen::Map<const Eigen::VectorXd>(law.tau_s.data(), n);
  return all;
}

}  // namespace

TEST_CASE("names of laws go there and back", "[law]") {
  for (const std::string& name : test::kLaws) {
    CHECK(law_name(parse_law_name(name, "test")) == name);
  }
  for (const char* name : {"power-fkelvin_voigt", "linear-9", "hertz-12", "linear-40-fluid"}) {
    CHECK(law_name(parse_law_name(name, "test")) == name);
  }
  CHECK(law_words(parse_law_name("linear-12", "test")) ==
        "linear kernel, twelve relaxing branches, no tension");
  CHECK(law_words(parse_law_name("linear-40", "test")) ==
        "linear kernel, 40 relaxing branches, no tension");
  CHECK_THROWS_WITH(parse_law_name("linear-41", "test"),
                    "test: 41 branches; expected 0 to 40 branches");
  for (const char* bad :
       {"", "cubic", "linear-41", "linear-1-elastic-elastic", "linear-elastic-1", "linear-relaxing",
        "linear-fluid", "linear-2-fluid-series", "linear-", "linear-1-fzener", "linear--1"}) {
    INFO(bad);
    CHECK_THROWS_AS(parse_law_name(bad, "test"), Error);
  }
}

TEST_CASE("the law linear-1-elastic is the paper's element", "[law]") {
  Random random(3);
  LawSpec spec = parse_law_name("linear-1-elastic", "test");
  spec.reference = 4e-3;
  const LawModel law(spec);
  const ClosedForm element({TensionRule::exact()});
  for (int trial = 0; trial < 20; ++trial) {
    TpmParameters p;
    p.E1_Pa = 1e3 * std::pow(10.0, random.uniform());
    p.E2_Pa = 1e3 * std::pow(10.0, random.uniform());
    p.Eprime_Pa = 1e4 * random.uniform();
    p.eta1_Pa_s = std::pow(10.0, 2.0 + 3.0 * random.uniform());
    p.spacing_m = 0.005 + 0.03 * random.uniform();
    const double scale = p.modulus_to_stiffness_m();
    const double k_tension = scale * lambda1_Pa(p.Eprime_Pa, spec.reference, p.spacing_m);
    const std::vector<double> values{scale * p.equilibrium_modulus_Pa(),
                                     scale * p.relaxing_modulus_Pa(),
                                     p.relaxation_time_s(),
                                     k_tension,
                                     p.spacing_m,
                                     0.0,
                                     0.0};
    const TpmVector vector = to_vector(p);
    const Protocol ramp = ramp_and_hold(6e-3, 2e-3, 30.0);
    const auto times = evenly(0.0, 33.0, 50);
    const auto expected = element.respond(ramp, times, vector, Want::values).value;
    const auto answer = law.respond(ramp, times, values, Want::values).value;
    CHECK(test::largest_difference(answer, expected) < 1e-12 * expected.maxCoeff());

    const Protocol load = creep(0.5, 100.0);
    const std::vector<double> creep_times{0.0, 0.01, 0.1, 1.0, 10.0, 100.0};
    const auto depth = element.respond(load, creep_times, vector, Want::values).value;
    const auto crept = law.respond(load, creep_times, values, Want::values).value;
    CHECK(test::largest_difference(crept, depth) < 2e-9 * depth.maxCoeff());
  }
}

TEST_CASE("sensitivities of every law agree with differences", "[law][heavy]") {
  Random random(11);
  const Protocol push(Drive::displacement,
                      {{0.0, 0.0}, {0.7, 2e-3}, {1.5, 1.8e-3}, {2.0, 3e-3}, {6.0, 3e-3}});
  Protocol load(Drive::force, {{0.0, 0.0}, {0.5, 0.08}, {2.0, 0.08}, {3.0, 0.2}, {5.0, 0.15}});
  // A Hertz contact predicts nothing once it has shrunk and grows again
  // (tests/law/test_retreat.cpp).
  const Protocol growing(Drive::displacement,
                         {{0.0, 0.0}, {0.7, 2e-3}, {1.5, 2e-3}, {2.0, 3e-3}, {6.0, 3e-3}});
  const Protocol more_load(Drive::force, {{0.0, 0.0}, {0.5, 0.08}, {2.0, 0.08}, {5.0, 0.2}});
  for (const std::string& name : test::kLaws) {
    const bool hertz = parse_law_name(name, "test").kernel == Kernel::hertz;
    const LawModel law(parse_law_name(name, "test"));
    const auto values = test::random_parameters(law, random);
    for (const Protocol* protocol :
         {hertz ? &growing : &push, hertz ? &more_load : &std::as_const(load)}) {
      const auto times = evenly(0.35, 4.9, 14);
      const Response r = law.respond(*protocol, times, values, Want::values_and_sensitivity);
      CHECK(test::largest_difference(
                r.value, law.respond(*protocol, times, values, Want::values).value) == 0.0);
      for (std::size_t j = 0; j < values.size(); ++j) {
        const double width = law.law_parameters()[j].name == "offset" ? 0.01 : std::abs(values[j]);
        const double step = 1e-4 * width;
        const auto at = [&](double factor) {
          auto moved = values;
          moved[j] += factor * step;
          return law.respond(*protocol, times, moved, Want::values).value;
        };
        const Eigen::VectorXd difference =
            (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step);
        const double scale = r.value.cwiseAbs().maxCoeff() / width;
        INFO(name << ", " << law.law_parameters()[j].name
                  << (protocol->drive() == Drive::force ? ", force" : ", displacement"));
        CHECK(test::largest_difference(r.sensitivity.col(static_cast<Eigen::Index>(j)),
                                       difference) < 2e-5 * scale);
      }
    }
  }
}

TEST_CASE("a nonlinear kernel under a ramp agrees with quadrature", "[law]") {
  const double rate = 2e-3;
  const double ramp_s = 1.3;
  const Protocol ramp = ramp_and_hold(rate * ramp_s, rate, 20.0);
  for (const char* name : {"hertz-2", "power-2", "linear-2-relaxing"}) {
    const LawSpec spec = parse_law_name(name, "test");
    const LawModel law(spec);
    std::vector<double> values(law.law_parameters().size(), 0.0);
    const auto set = [&](const char* key, double value) { values[law.index(key)] = value; };
    set("k_inf", 20.0);
    set("k1", 30.0);
    set("k2", 12.0);
    set("tau1", 0.08);
    set("tau2", 4.0);
    double power = 1.5;
    if (spec.kernel == Kernel::power) set("exponent", power = 2.3);
    if (spec.tension == Tension::relaxing) {
      set("tension_share", 0.7);
      set("spacing", std::numeric_limits<double>::infinity());
    }
    const auto kernel_slope = [&](double u) {
      if (spec.tension == Tension::relaxing) return 0.3 + 0.7 * 3.0 * u * u / 1e-6;
      return power * std::pow(u / 1e-3, power - 1.0);
    };
    const std::vector<double> times{0.1, 0.6, 1.3, 1.35, 2.0, 9.0, 20.0};
    const Response r = law.respond(ramp, times, values, Want::values);
    for (std::size_t i = 0; i < times.size(); ++i) {
      const auto integrand = [&](double s) {
        const double g =
            20.0 + 30.0 * std::exp(-(times[i] - s) / 0.08) + 12.0 * std::exp(-(times[i] - s) / 4.0);
        return g * kernel_slope(rate * s) * rate;
      };
      boost::math::quadrature::tanh_sinh<double> integrator;
      double expected = 0.0;
      const double end = std::min(times[i], ramp_s);
      for (int part = 0; part < 20; ++part) {
        expected += integrator.integrate(integrand, end * part / 20.0, end * (part + 1) / 20.0);
      }
      INFO(name << " at " << times[i]);
      CHECK_THAT(r.value[static_cast<Eigen::Index>(i)], WithinRel(expected, 1e-8));
    }
  }
}

TEST_CASE("parallel and series form are one law", "[law]") {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 1 + static_cast<int>(random.below(5));
    Prony law;
    law.k_inf = trial % 7 == 0 ? 0.0 : std::pow(10.0, -2.0 + 4.0 * random.uniform());
    for (int i = 0; i < n; ++i) {
      law.k.push_back(std::pow(10.0, -3.0 + 5.0 * random.uniform()));
      law.tau_s.push_back(std::pow(10.0, -3.0 + 6.0 * random.uniform()));
    }
    const KelvinChain chain = to_series(law);
    const Prony back = to_parallel(chain);
    REQUIRE(back.k.size() == law.k.size());
    // The operational stiffness s G(s) times the operational compliance is 1 at every s > 0.
    for (int decade = -4; decade < 5; ++decade) {
      const double s = std::pow(10.0, decade);
      const auto stiffness = [s](const Prony& p) {
        double g = p.k_inf;
        for (std::size_t i = 0; i < p.k.size(); ++i) {
          g += p.k[i] * s * p.tau_s[i] / (1.0 + s * p.tau_s[i]);
        }
        return g;
      };
      double compliance = 1.0 / chain.k0 + (chain.eta > 0.0 ? 1.0 / (s * chain.eta) : 0.0);
      for (std::size_t i = 0; i < chain.k.size(); ++i) {
        compliance += 1.0 / chain.k[i] / (1.0 + s * chain.T_s[i]);
      }
      CHECK_THAT(stiffness(law) * compliance, WithinRel(1.0, 1e-11));
      CHECK_THAT(stiffness(back), WithinRel(stiffness(law), 1e-11));
    }
    CHECK(std::is_sorted(chain.T_s.begin(), chain.T_s.end()));
  }
}

TEST_CASE("forty branches answer a ramp in closed form, with exact derivatives", "[law]") {
  const LawModel law(parse_law_name("linear-40", "test"));
  REQUIRE(law.law_parameters().size() == 83);
  std::vector<double> values{15.0};
  for (int i = 0; i < 40; ++i) values.push_back(1.0 + 0.1 * i);
  for (int i = 0; i < 40; ++i) values.push_back(std::pow(10.0, -2.0 + 0.1 * i));
  values.insert(values.end(), {0.0, 0.0});
  const double rate = 2e-3;
  const Protocol ramp = ramp_and_hold(rate * 10.0, rate, 1.0);
  const auto times = evenly(0.1, 10.0, 37);
  const Response r = law.respond(ramp, times, values, Want::values_and_sensitivity);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double t = times[i];
    const auto row = static_cast<Eigen::Index>(i);
    double force = values[0] * t;
    for (Eigen::Index j = 0; j < 40; ++j) {
      const double k = values[static_cast<std::size_t>(1 + j)];
      const double tau = values[static_cast<std::size_t>(41 + j)];
      const double relaxed = -std::expm1(-t / tau);
      force += k * tau * relaxed;
      CHECK_THAT(r.sensitivity(row, 1 + j), WithinRel(rate * tau * relaxed, 1e-11));
      CHECK_THAT(r.sensitivity(row, 41 + j),
                 WithinRel(rate * k * (relaxed - t / tau * std::exp(-t / tau)), 1e-9));
    }
    CHECK_THAT(r.value[row], WithinRel(rate * force, 1e-12));
  }
  // The general way, after a jump of the depth, carries as many parameters.
  const Protocol step = step_and_hold(2e-3, 5.0);
  const Response jumped =
      law.respond(step, evenly(0.0, 5.0, 9), values, Want::values_and_sensitivity);
  double instant = values[0];
  for (std::size_t j = 1; j <= 40; ++j) instant += values[j];
  CHECK_THAT(jumped.value[0], WithinRel(2e-3 * instant, 1e-13));
  CHECK_THAT(jumped.sensitivity(8, 41), WithinAbs(2e-3 * values[1] * std::exp(-5.0 / values[41]) *
                                                      5.0 / (values[41] * values[41]),
                                                  1e-13));
}

TEST_CASE("forty units in series are forty branches, with exact derivatives", "[law]") {
  for (const int units : {4, 5, 12, 13, 40}) {
    const auto n = static_cast<std::size_t>(units);
    KelvinChain chain;
    chain.k0 = 200.0;
    for (int i = 0; i < units; ++i) {
      chain.k.push_back(30.0 + 7.0 * i);
      chain.T_s.push_back(std::pow(10.0, -3.0 + 6.0 * i / units));
    }
    const ParallelWithSlopes parallel = to_parallel_with_slopes(chain);
    REQUIRE(parallel.law.k.size() == n);
    const KelvinChain back = to_series(parallel.law);
    REQUIRE(back.k.size() == n);
    for (std::size_t i = 0; i < n; ++i) {
      CHECK_THAT(back.k[i], WithinRel(chain.k[i], 1e-9));
      CHECK_THAT(back.T_s[i], WithinRel(chain.T_s[i], 1e-11));
    }
    // Along every coefficient of the chain, the slopes are those of the coefficients' own change.
    const Eigen::Index size = 2 * units + 1;
    REQUIRE(parallel.slopes.rows() == size);
    Eigen::VectorXd scale(size);  // relative changes in, relative changes out
    scale << chain.k0, Eigen::Map<const Eigen::VectorXd>(chain.k.data(), units),
        Eigen::Map<const Eigen::VectorXd>(chain.T_s.data(), units);
    constexpr double kStep = 1e-5;
    const auto changed = [&](Eigen::Index at, double by) {
      KelvinChain near = chain;
      const auto unit = static_cast<std::size_t>((at - 1) % units);
      (at == 0 ? near.k0 : at <= units ? near.k[unit] : near.T_s[unit]) *= 1.0 + by;
      return coefficients(to_parallel(near));
    };
    const Eigen::VectorXd law = coefficients(parallel.law);
    Eigen::MatrixXd differences(size, size);
    for (Eigen::Index j = 0; j < size; ++j) {
      differences.col(j) =
          (changed(j, kStep) - changed(j, -kStep)).cwiseQuotient(2.0 * kStep * law);
    }
    const Eigen::MatrixXd slopes =
        law.cwiseInverse().asDiagonal() * parallel.slopes * scale.asDiagonal();
    INFO(units << " units");
    CHECK((slopes - differences).cwiseAbs().maxCoeff() < 1e-6);
  }
  KelvinChain long_chain{1.0, std::vector<double>(41, 1.0), {}, 0.0};
  for (int i = 1; i <= 41; ++i) long_chain.T_s.push_back(i);
  CHECK_THROWS_WITH(to_parallel_with_slopes(long_chain),
                    "Kelvin chain: 41 branches; expected at most 40");
}

TEST_CASE("degenerate chains: equal times, branches without stiffness, one dashpot", "[law]") {
  const KelvinChain merged = to_series({5.0, {2.0, 3.0, 0.0}, {1.0, 1.0, 7.0}});
  REQUIRE(merged.k.size() == 1);
  CHECK_THAT(merged.k0, WithinRel(10.0, 1e-15));
  CHECK_THAT(merged.T_s[0], WithinRel(2.0, 1e-14));          // tau k0/k_inf
  CHECK_THAT(merged.k[0], WithinRel(10.0, 1e-14));           // 1/k_inf - 1/k0 = 1/10
  const Prony equal = to_parallel({100.0, {100.0}, {0.7}});  // the root is the middle of its gap
  CHECK_THAT(equal.k_inf, WithinRel(50.0, 1e-14));
  CHECK_THAT(equal.tau_s.at(0), WithinRel(0.35, 1e-14));
  const Prony maxwell = to_parallel({4.0, {}, {}, 8.0});
  REQUIRE(maxwell.k.size() == 1);
  CHECK(maxwell.k_inf == 0.0);
  CHECK_THAT(maxwell.tau_s[0], WithinRel(2.0, 1e-15));
  CHECK_THROWS_AS(to_series({0.0, {}, {}}), Error);
  CHECK_THROWS_AS(to_series({-1.0, {1.0}, {1.0}}), Error);
  CHECK_THROWS_AS(to_parallel({1.0, {0.0}, {1.0}}), Error);
  CHECK_THROWS_AS(to_parallel({1.0, {1.0}, {0.0}}), Error);
}

TEST_CASE("creep under a step of load is the compliance of the chain", "[law]") {
  const LawModel law(parse_law_name("linear-2-series", "test"));
  const std::vector<double> values{40.0, 30.0, 15.0, 0.3, 6.0, 0.0, 0.0};
  const std::vector<double> times{0.0, 0.1,  1.0,
                                  5.0, 40.0, std::numeric_limits<double>::infinity()};
  const auto depth = law.respond(creep(0.2, 1e9), {times.data(), 5}, values, Want::values).value;
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    const double t = times[static_cast<std::size_t>(i)];
    const double expected =
        0.2 * (1.0 / 40.0 + (1.0 - std::exp(-t / 0.3)) / 30.0 + (1.0 - std::exp(-t / 6.0)) / 15.0);
    CHECK_THAT(depth[i], WithinRel(expected, 1e-9));
  }
  const auto forever =
      law.respond(creep(0.2, times.back()), {times.data() + 5, 1}, values, Want::values).value;
  CHECK_THAT(forever[0], WithinRel(0.2 * (1.0 / 40.0 + 1.0 / 30.0 + 1.0 / 15.0), 1e-12));
}

TEST_CASE("a probe that retracts leaves the tissue, which recovers and is met again", "[law]") {
  for (const char* name : {"linear-1", "power-2", "linear-1-elastic"}) {
    const LawModel law(parse_law_name(name, "test"));
    Random random(8);
    auto values = test::random_parameters(law, random);
    values[law.index("contact")] = 0.0;
    values[law.index("offset")] = 0.003;
    const auto protocol = [](int pieces) {
      // Down in 0.5 s, held, up in 0.2 s, waiting, down again; in `pieces` equal parts each.
      const std::vector<Knot> corners{{0, 0},      {0.5, 3e-3}, {2.0, 3e-3},
                                      {2.2, 1e-4}, {2.6, 1e-4}, {3.1, 3e-3}};
      std::vector<Knot> knots{corners.front()};
      for (std::size_t i = 1; i < corners.size(); ++i) {
        for (int k = 1; k <= pieces; ++k) {
          const double share = static_cast<double>(k) / pieces;
          knots.push_back(
              {corners[i - 1].time_s + share * (corners[i].time_s - corners[i - 1].time_s),
               corners[i - 1].value + share * (corners[i].value - corners[i - 1].value)});
        }
      }
      return Protocol(Drive::displacement, knots);
    };
    const std::vector<double> times{1.0, 2.3, 2.55, 2.9, 3.1};
    const auto coarse = law.respond(protocol(200), times, values, Want::values_and_sensitivity);
    const auto fine = law.respond(protocol(3200), times, values, Want::values);
    INFO(name);
    CHECK(coarse.value[1] == values[law.index("offset")]);  // away: nothing but the zero error
    CHECK(coarse.value[4] > 0.5 * coarse.value[0]);
    CHECK(test::largest_difference(coarse.value, fine.value) < 1e-4 * coarse.value.maxCoeff());
    // Never tensile.
    const auto all = law.respond(protocol(200), evenly(0.0, 3.1, 700), values, Want::values).value;
    CHECK(all.minCoeff() >= values[law.index("offset")] - 1e-15);
    for (const char* key : {"k_inf", "k1", "tau1"}) {
      const std::size_t j = law.index(key);
      const double step = 1e-5 * values[j];
      auto up = values;
      auto down = values;
      up[j] += step;
      down[j] -= step;
      const Eigen::VectorXd slope = (law.respond(protocol(200), times, up, Want::values).value -
                                     law.respond(protocol(200), times, down, Want::values).value) /
                                    (2.0 * step);
      const Eigen::VectorXd analytic = coarse.sensitivity.col(static_cast<Eigen::Index>(j));
      CHECK(test::largest_difference(slope, analytic) < 1e-3 * coarse.value.maxCoeff() / values[j]);
    }
  }
}

TEST_CASE("a preloaded recording starts relaxed", "[law]") {
  const LawModel law(parse_law_name("linear-1", "test"));
  const std::vector<double> values{20.0, 30.0, 1.0, -1e-3, 0.0};
  Protocol hold(Drive::displacement, {{0.0, 0.0}, {5.0, 0.0}});
  hold.set_equilibrium_at_start(true);
  const auto relaxed = law.respond(hold, evenly(0.0, 5.0, 6), values, Want::values).value;
  for (const double f : relaxed) CHECK_THAT(f, WithinRel(0.02, 1e-12));
  hold.set_equilibrium_at_start(false);
  const auto jumped = law.respond(hold, evenly(0.0, 5.0, 6), values, Want::values).value;
  CHECK_THAT(jumped[0], WithinRel(0.05, 1e-12));
  Protocol load(Drive::force, {{0.0, 0.1}, {5.0, 0.1}});
  load.set_equilibrium_at_start(true);
  const auto depth = law.respond(load, evenly(0.0, 5.0, 6), values, Want::values).value;
  for (const double d : depth) CHECK_THAT(d, WithinRel(0.1 / 20.0 - 1e-3, 1e-9));
}

TEST_CASE("parameters out of range are refused by name", "[law]") {
  const LawModel law(parse_law_name("power-1", "test"));
  const Protocol ramp = ramp_and_hold(1e-3, 1e-3, 1.0);
  const std::vector<double> times{0.5};
  const std::vector<double> good{1.0, 1.0, 1.0, 1.5, 0.0, 0.0};
  CHECK_NOTHROW(law.respond(ramp, times, good, Want::values));
  const std::vector<std::pair<std::size_t, double>> wrong{
      {0, -1.0}, {1, -1e-9}, {2, 0.0}, {3, 0.5}, {0, std::nan("")}, {4, std::nan("")}};
  for (const auto& [place, value] : wrong) {
    auto bad = good;
    bad[place] = value;
    CHECK_THROWS_WITH(law.respond(ramp, times, bad, Want::values),
                      Catch::Contains(law.law_parameters()[place].name));
  }
  CHECK_THROWS_AS(law.respond(ramp, times, {good.data(), 3}, Want::values), Error);
}
