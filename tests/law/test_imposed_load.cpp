// Laws under an imposed load: the closed form against the stepped path and the Kelvin chain.

#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpm/law/tension_creep.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

namespace {

/// Values of a law with n branches whose times are spread from `shortest_s` on.
std::vector<double> spread_values(const LawModel& law, Random& random, double shortest_s) {
  std::vector<double> values;
  double time = shortest_s;
  for (const LawParameter& p : law.law_parameters()) {
    if (p.name == "exponent") {
      values.push_back(1.0 + 1.5 * random.uniform());
    } else if (p.name == "tension_share") {
      values.push_back(0.1 + 0.5 * random.uniform());
    } else if (p.name == "k_tension") {
      values.push_back(0.0);
    } else if (p.preset) {
      values.push_back(p.name == "contact" ? 1e-4 : p.name == "offset" ? 2e-3 : *p.preset);
    } else if (p.dimension == Dimension::time) {
      values.push_back(time *= 1.0 + 9.0 * random.uniform());
    } else {
      values.push_back(20.0 + 100.0 * random.uniform());
    }
  }
  return values;
}

/// The same law with elastic tension of no stiffness, which is stepped.
struct Stepped {
  LawModel law;
  std::vector<double> values;

  Stepped(const LawModel& plain, const std::vector<double>& of)
      : law([&] {
          LawSpec spec = plain.spec();
          spec.tension = Tension::elastic;
          return spec;
        }()),
        values(of) {
    values.insert(values.end() - 2, {0.0, std::numeric_limits<double>::infinity()});
  }

  /// Where a parameter of the plain law stands here.
  [[nodiscard]] std::size_t place(std::size_t i) const {
    return i + 2 < values.size() - 2 ? i : i + 2;
  }
};

std::vector<Protocol> loads() {
  const Protocol step = creep(0.3, 20.0);
  const Protocol ramps(Drive::force,
                       {{0.0, 0.0}, {0.5, 0.1}, {2.0, 0.1}, {2.0, 0.25}, {6.0, 0.2}, {20.0, 0.4}});
  Protocol preloaded(Drive::force, {{0.0, 0.05}, {1.0, 0.05}, {3.0, 0.3}, {20.0, 0.3}});
  preloaded.set_equilibrium_at_start(true);
  return {step, ramps, preloaded};
}

const std::vector<double> kLoadTimes{0.0, 1e-3,  0.02, 0.3, 0.5,  1.7,
                                     2.0, 2.001, 5.0,  6.0, 13.3, 20.0};

}  // namespace

TEST_CASE("A law under a load in closed form agrees with the stepped path", "[law][heavy]") {
  Random random(3);
  for (const char* name : {"linear-1", "linear-2", "linear-3", "linear-1-fluid", "linear-3-fluid",
                           "power-1", "power-2", "power-2-fluid", "hertz-2", "linear", "power"}) {
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = spread_values(law, random, 0.02);
    const Stepped stepped(law, values);
    for (const Protocol& load : loads()) {
      if (load.equilibrium_at_start() && !law.spec().solid) continue;
      INFO(name << ", " << load.knots().size() << " knots");
      const Response r = law.respond(load, kLoadTimes, values, Want::values_and_sensitivity);
      const Response s =
          stepped.law.respond(load, kLoadTimes, stepped.values, Want::values_and_sensitivity);
      Eigen::Index predicted = 0;
      for (Eigen::Index i = 0; i < r.value.size(); ++i) {
        REQUIRE(std::isnan(r.value[i]) == std::isnan(s.value[i]));
        if (std::isnan(r.value[i])) break;
        ++predicted;
      }
      REQUIRE(predicted > 0);
      const double peak = s.value.head(predicted).cwiseAbs().maxCoeff();
      CHECK((r.value - s.value).head(predicted).cwiseAbs().maxCoeff() < 1e-8 * peak);
      for (std::size_t j = 0; j < values.size(); ++j) {
        INFO(law.law_parameters()[j].name);
        const Eigen::VectorXd a = r.sensitivity.col(static_cast<Eigen::Index>(j)).head(predicted);
        const Eigen::VectorXd b =
            s.sensitivity.col(static_cast<Eigen::Index>(stepped.place(j))).head(predicted);
        const bool offset = law.law_parameters()[j].name == "offset";
        // The stepped path finds the moment at which the surface is first loaded, and so the
        // derivative by the zero error, less exactly.
        CHECK((a - b).cwiseAbs().maxCoeff() <= (offset ? 1e-3 : 1e-6) * b.cwiseAbs().maxCoeff());
        if (!offset || predicted < r.value.size()) continue;
        constexpr double kStep_N = 1e-6;
        std::vector<double> more = values;
        std::vector<double> less = values;
        more[j] += kStep_N;
        less[j] -= kStep_N;
        const Eigen::VectorXd slope = (law.respond(load, kLoadTimes, more, Want::values).value -
                                       law.respond(load, kLoadTimes, less, Want::values).value) /
                                      (2.0 * kStep_N);
        CHECK((a - slope).cwiseAbs().maxCoeff() <= 1e-6 * slope.cwiseAbs().maxCoeff());
      }
    }
  }
}

TEST_CASE("Creep over nine decades is the compliance of the Kelvin chain to rounding", "[law]") {
  const LawModel law(parse_law_name("linear-4", "test"));
  const Prony prony{30.0, {50.0, 20.0, 80.0, 5.0}, {1e-4, 0.03, 7.0, 2e4}};
  const std::vector<double> values{30.0, 50.0, 20.0, 80.0, 5.0, 1e-4, 0.03, 7.0, 2e4, 0.0, 0.0};
  const KelvinChain chain = to_series(prony);
  std::vector<double> times;
  for (int i = -5; i <= 5; ++i) times.push_back(std::pow(10.0, i));
  const Eigen::VectorXd depth =
      law.respond(creep(0.2, times.back()), times, values, Want::values).value;
  for (std::size_t i = 0; i < times.size(); ++i) {
    double compliance = 1.0 / chain.k0;
    for (std::size_t u = 0; u < chain.k.size(); ++u) {
      compliance -= std::expm1(-times[i] / chain.T_s[u]) / chain.k[u];
    }
    INFO(times[i]);
    CHECK_THAT(depth[static_cast<Eigen::Index>(i)], WithinRel(0.2 * compliance, 1e-12));
  }
}

TEST_CASE("Creep of a Maxwell element is a straight line", "[law]") {
  const LawModel law(parse_law_name("linear-1-fluid", "test"));
  const std::vector<double> values{100.0, 2.0, 0.0, 0.0};
  std::vector<double> times;
  for (int i = 0; i <= 162; ++i) times.push_back(0.05 * i);
  const Response r =
      law.respond(creep(0.5, times.back()), times, values, Want::values_and_sensitivity);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double t = times[i];
    CHECK_THAT(r.value[row], WithinRel(0.5 / 100.0 * (1.0 + t / 2.0), 1e-13));
    CHECK_THAT(r.sensitivity(row, 0), WithinRel(-0.5 / 1e4 * (1.0 + t / 2.0), 1e-12));
    CHECK(std::abs(r.sensitivity(row, 1) + 0.5 / 100.0 * t / 4.0) < 1e-12 * (0.005 * t + 1e-3));
  }
}

TEST_CASE("Under a load branches may have equal times or no stiffness", "[law]") {
  const LawModel two(parse_law_name("power-2", "test"));
  const LawModel one(parse_law_name("power-1", "test"));
  const Protocol load = loads()[1];
  const auto at = [&](const LawModel& law, const std::vector<double>& values) {
    return law.respond(load, kLoadTimes, values, Want::values_and_sensitivity);
  };
  const Eigen::VectorXd alone = at(one, {40.0, 60.0, 2.0, 1.7, 0.0, 0.0}).value;
  const std::vector<double> equal{40.0, 25.0, 35.0, 2.0, 2.0, 1.7, 0.0, 0.0};
  const std::vector<double> empty{40.0, 60.0, 0.0, 2.0, 0.3, 1.7, 0.0, 0.0};
  CHECK((at(two, equal).value - alone).cwiseAbs().maxCoeff() < 1e-12 * alone.maxCoeff());
  CHECK((at(two, empty).value - alone).cwiseAbs().maxCoeff() < 1e-10 * alone.maxCoeff());
  for (const std::vector<double>& values : {equal, empty}) {
    const Response r = at(two, values);
    for (std::size_t j = 0; j < 5; ++j) {
      // One-sided where a stiffness is 0.
      const double step = values[j] > 0.0 ? 1e-4 * values[j] : 1e-3;
      const auto moved = [&](double by) {
        std::vector<double> v = values;
        v[j] += by * step;
        return at(two, v).value;
      };
      const Eigen::VectorXd slope =
          values[j] > 0.0
              ? ((moved(1.0) - moved(-1.0)) / (2.0 * step)).eval()
              : ((-3.0 * moved(0.0) + 4.0 * moved(1.0) - moved(2.0)) / (2.0 * step)).eval();
      const auto column = r.sensitivity.col(static_cast<Eigen::Index>(j));
      INFO("parameter " << j);
      const double size = std::max(slope.cwiseAbs().maxCoeff(), 1e-6);
      CHECK((column - slope).cwiseAbs().maxCoeff() < 2e-6 * size);
    }
  }
}

TEST_CASE("Relaxing tension under a load: the kernel of the depth is that of the linear law",
          "[law]") {
  Random random(9);
  const LawModel linear(parse_law_name("linear-2", "test"));
  const LawModel relaxing(parse_law_name("linear-2-relaxing", "test"));
  const std::vector<double> values{40.0, 60.0, 25.0, 0.3, 5.0, 0.0, 0.0};
  constexpr double kShare = 0.4;
  const std::vector<double> with{
      40.0, 60.0, 25.0, 0.3, 5.0, kShare, std::numeric_limits<double>::infinity(), 0.0, 0.0};
  for (const Protocol& load : loads()) {
    const Eigen::VectorXd v = linear.respond(load, kLoadTimes, values, Want::values).value;
    const Eigen::VectorXd u = relaxing.respond(load, kLoadTimes, with, Want::values).value;
    const double reference = relaxing.spec().reference;
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      const double kernel = (1.0 - kShare) * u[i] + kShare * u[i] * std::pow(u[i] / reference, 2);
      CHECK_THAT(kernel, WithinRel(v[i], 1e-10));
    }
  }
}

/// 162 times over four decades, as a creep test is read.
std::vector<double> creep_times() {
  std::vector<double> times;
  for (int i = 0; i < 162; ++i) times.push_back(0.01 * std::pow(10.0, 4.0 * i / 161.0));
  return times;
}

/// k_inf, k_i, tau_i over four decades, [exponent], k_tension, spacing, contact, offset.
std::vector<double> values_with_tension(const LawModel& law) {
  std::vector<double> values;
  double stiffness = 15.0, time_s = 0.004;
  for (const LawParameter& p : law.law_parameters()) {
    if (p.name == "exponent") {
      values.push_back(1.7);
    } else if (p.name == "k_tension") {
      values.push_back(35.0);
    } else if (p.name == "spacing") {
      values.push_back(0.012);
    } else if (p.name == "contact") {
      values.push_back(1e-4);
    } else if (p.name == "offset") {
      values.push_back(2e-3);
    } else if (p.dimension == Dimension::time) {
      values.push_back(time_s *= 25.0);
    } else {
      values.push_back(stiffness += 12.0);
    }
  }
  return values;
}

TEST_CASE("Creep with elastic tension is that of the stepped path", "[law][heavy]") {
  std::vector<double> times = creep_times();
  times.insert(times.begin(), 0.0);
  const Protocol kept = creep(0.3, times.back());
  // What comes after the last asked time makes it a history that is stepped.
  const Protocol stepped(Drive::force,
                         {{0.0, 0.3}, {times.back(), 0.3}, {times.back() + 1.0, 0.4}});
  for (const char* name : {"linear-elastic", "linear-1-elastic", "linear-3-elastic",
                           "linear-2-elastic-fluid", "power-2-elastic", "hertz-2-elastic"}) {
    INFO(name);
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = values_with_tension(law);
    const Response a = law.respond(kept, times, values, Want::values_and_sensitivity);
    const Response b = law.respond(stepped, times, values, Want::values_and_sensitivity);
    CHECK((a.value - b.value).cwiseAbs().maxCoeff() < 1e-8 * b.value.maxCoeff());
    CHECK((law.respond(kept, times, values, Want::values).value - a.value).cwiseAbs().maxCoeff() <
          1e-15);
    for (Eigen::Index j = 0; j < b.sensitivity.cols(); ++j) {
      INFO(law.law_parameters()[static_cast<std::size_t>(j)].name);
      const double size = b.sensitivity.col(j).cwiseAbs().maxCoeff();
      CHECK(size > 0.0);
      CHECK((a.sensitivity.col(j) - b.sensitivity.col(j)).cwiseAbs().maxCoeff() <= 1e-6 * size);
    }
  }
}

TEST_CASE("Creep with elastic tension of no stiffness is the closed form", "[law]") {
  const std::vector<double> times = creep_times();
  for (const char* name : {"linear-1", "linear-3", "linear-2-fluid", "power-2"}) {
    INFO(name);
    const LawModel plain(parse_law_name(name, "test"));
    const Stepped with(plain, values_with_tension(plain));
    std::vector<double> values = with.values;
    values.end()[-3] = 0.05;  // spacing
    const Protocol load = creep(0.3, times.back());
    const Response a =
        plain.respond(load, times, values_with_tension(plain), Want::values_and_sensitivity);
    const Response b = with.law.respond(load, times, values, Want::values_and_sensitivity);
    CHECK((a.value - b.value).cwiseAbs().maxCoeff() < 1e-8 * a.value.maxCoeff());
    for (std::size_t j = 0; j < plain.law_parameters().size(); ++j) {
      INFO(plain.law_parameters()[j].name);
      const Eigen::VectorXd x = a.sensitivity.col(static_cast<Eigen::Index>(j));
      const Eigen::VectorXd y = b.sensitivity.col(static_cast<Eigen::Index>(with.place(j)));
      CHECK((x - y).cwiseAbs().maxCoeff() <= 1e-6 * x.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("Creep with elastic tension takes as many steps as it bends, however densely it is read",
          "[law]") {
  const LawModel law(parse_law_name("linear-3-elastic", "test"));
  const std::vector<double> values = values_with_tension(law);
  const LawAtParameters at = law.at(values, nullptr);
  const std::vector<double> dense = creep_times();
  const std::vector<double> last{dense.back()};
  int for_dense = 0, for_last = 0;
  REQUIRE(creep_with_tension(at, 0.3, dense, Want::values, &for_dense));
  REQUIRE(creep_with_tension(at, 0.3, last, Want::values, &for_last));
  INFO(for_dense << " and " << for_last << " steps");
  CHECK(for_dense == for_last);
  CHECK(for_dense <= test::allowed_cost("creep.three_branches_with_tension"));
  // Nothing where the balance cannot be followed: no load, an infinite time, no tension.
  CHECK_FALSE(creep_with_tension(at, 0.001, dense, Want::values));
  CHECK_FALSE(creep_with_tension(
      at, 0.3, std::vector<double>{std::numeric_limits<double>::infinity()}, Want::values));
  const LawModel plain(parse_law_name("linear-3", "test"));
  CHECK_FALSE(
      creep_with_tension(plain.at(values_with_tension(plain), nullptr), 0.3, dense, Want::values));
}

TEST_CASE("A probe that leaves the surface under a load is stepped", "[law][heavy]") {
  // The zero error takes the whole load away: what has crept must recover first.
  const LawModel law(parse_law_name("linear-2", "test"));
  const std::vector<double> values{40.0, 60.0, 25.0, 0.3, 5.0, 0.0, 0.02};
  const Stepped stepped(law, values);
  const Protocol load(Drive::force,
                      {{0.0, 0.0}, {0.5, 0.2}, {4.0, 0.2}, {4.2, 0.0}, {12.0, 0.0}, {14.0, 0.3}});
  std::vector<double> times;
  for (int i = 0; i <= 140; ++i) times.push_back(0.1 * i);
  const Eigen::VectorXd a = law.respond(load, times, values, Want::values).value;
  const Eigen::VectorXd b = stepped.law.respond(load, times, stepped.values, Want::values).value;
  CHECK(a.minCoeff() == 0.0);
  CHECK((a - b).cwiseAbs().maxCoeff() <= 1e-8 * b.maxCoeff());
}

TEST_CASE("Under a load that a soft law hardly carries a step ends at rounding", "[law]") {
  // V is 1e10 times that of the reference, so its rounding exceeds a tolerance of the reference.
  LawSpec spec = parse_law_name("linear-1-elastic", "test");
  spec.reference = 4e-3;
  const LawModel law(spec);
  std::vector<double> values;
  for (const LawParameter& p : law.law_parameters()) {
    values.push_back(p.name == "tau1" ? 1.0 : p.name == "spacing" ? 1e-2 : 0.0);
    if (p.name == "k_inf" || p.name == "k1") values.back() = 1e-8;
  }
  const Protocol ramp(Drive::force, {{0.0, 0.0}, {1.0, 0.0}, {1.1, 2.0}, {2.0, 2.0}});
  const std::vector<double> times_s{1.05, 1.1, 1.5, 2.0};
  const Eigen::VectorXd depth = law.respond(ramp, times_s, values, Want::values).value;
  // The Kelvin chain under a ramp and a hold: J(t) = (1 - exp(-t/T)/2)/1e-8 with T = 2 s.
  const auto ramped = [](double t) {
    return t <= 0.0 ? 0.0 : (t - 1.0 * (1.0 - std::exp(-0.5 * t))) / 1e-8;
  };
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const double since = times_s[i] - 1.0;
    CHECK_THAT(depth[static_cast<Eigen::Index>(i)],
               WithinRel(20.0 * (ramped(since) - ramped(since - 0.1)), 1e-9));
  }
}

TEST_CASE("What answers a load is not linear in a stiffness", "[law]") {
  PointSet points;
  points.header.id = "creep";
  points.observable = Observable::indentation_depth;
  points.time_origin = TimeOrigin::load_applied;
  for (int i = 0; i < 12; ++i) {
    Datum d;
    d.load_N = 0.5;
    d.time_s = 0.2 * (i + 1);
    d.value = 1e-3 * (i + 1);
    points.data.push_back(d);
  }
  const FitConfig config = parse_fit_config(parse_json(R"({
    "title": "t", "law": {"name": "linear-1", "drive": "indentation_depth", "reference": "5 mm"},
    "parameters": {"k_inf": {"start": "10 N/m", "lower": "0 N/m", "upper": "1000 N/m",
                             "scale": "linear", "sets": ["k_inf"]}},
    "fixed": {"k1": "50 N/m", "tau1": "1 s"},
    "data": [{"dataset": "creep", "protocol": {"kind": "creep"},
              "noise": {"kind": "absolute", "absolute": "0.1 mm", "scale": "estimated"}}]})",
                                                       "test"),
                                            "test");
  CHECK_FALSE(ExperimentResiduals(config, {points}).linear_in(0));
}
