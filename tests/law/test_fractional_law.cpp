// Fractional laws through the law model: ramps, random histories, integer orders, creep, jumps.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "law_answers.hpp"
#include "tpm/base/random.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::law;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::largest;

namespace {

constexpr double kInf = 20.0;  // N/m
constexpr double kOne = 30.0;  // N/m
constexpr double kTau = 0.7;   // s

struct Element {
  const char* name;
  bool solid;
  bool relaxes;
};
constexpr std::array<Element, 4> kElements{{{"linear-fspringpot", false, false},
                                            {"linear-fmaxwell", false, true},
                                            {"linear-fkelvin_voigt", true, false},
                                            {"linear-fzener", true, true}}};

std::vector<double> element_values(const Element& element, double alpha) {
  std::vector<double> values;
  if (element.solid) values.push_back(kInf);
  values.push_back(kOne);
  if (element.relaxes) values.push_back(kTau);
  values.insert(values.end(), {alpha, 0.0, 0.0});
  return values;
}

/// The integral of G from 0 to t.
double stiffness_integral(const Element& element, double alpha, double t) {
  if (t <= 0.0) return 0.0;
  const double relaxing = element.relaxes
                              ? t * mittag_leffler(alpha, 2.0, std::pow(t / kTau, alpha))
                              : std::pow(t, 1.0 - alpha) / std::tgamma(2.0 - alpha);
  return (element.solid ? kInf * t : 0.0) + kOne * relaxing;
}

/// J(t), the depth under a unit load from t = 0 on.
double compliance(const Element& element, double alpha, double t) {
  const auto creeping = [&](double tau) {
    return 1.0 - mittag_leffler(alpha, 1.0, std::pow(t / tau, alpha));
  };
  const double power = std::pow(t, alpha) / std::tgamma(1.0 + alpha);
  if (element.solid && element.relaxes) {
    const double glassy = kInf + kOne;
    const double tau = kTau * std::pow(glassy / kInf, 1.0 / alpha);
    return 1.0 / glassy + (1.0 / kInf - 1.0 / glassy) * creeping(tau);
  }
  if (element.solid) return creeping(std::pow(kOne / kInf, 1.0 / alpha)) / kInf;
  if (element.relaxes) return 1.0 / kOne + power / (kOne * std::pow(kTau, alpha));
  return power / kOne;
}

}  // namespace

TEST_CASE("a ramp and hold is answered as by E_{alpha,2}", "[fractional]") {
  const double rate = 2e-3;
  const double ramp_s = 1.5;
  std::vector<double> times;
  for (int i = 1; i <= 300; ++i) times.push_back(0.1 * i);
  const Protocol ramp = ramp_and_hold(rate * ramp_s, rate, 30.0);
  for (const Element& element : kElements) {
    const LawModel law(parse_law_name(element.name, "test"));
    for (const double alpha : {0.05, 0.3, 0.6, 0.9, 0.99, 1.0}) {
      const auto force =
          law.respond(ramp, times, element_values(element, alpha), Want::values).value;
      double worst = 0.0;
      for (std::size_t i = 0; i < times.size(); ++i) {
        const double exact = rate * (stiffness_integral(element, alpha, times[i]) -
                                     stiffness_integral(element, alpha, times[i] - ramp_s));
        if (alpha == 1.0 && times[i] == 1.5) continue;  // a dashpot's force jumps here
        worst = std::max(worst, std::abs(force[static_cast<Eigen::Index>(i)] - exact));
      }
      INFO(element.name << ", alpha " << alpha);
      CHECK(worst < 1e-9 * largest(force));
    }
  }
}

TEST_CASE("a random history is the sum of its ramps", "[fractional]") {
  Random random(4);
  std::vector<Knot> knots{{0.0, 5e-3}};
  for (int i = 1; i <= 120; ++i) {
    knots.push_back({knots.back().time_s + 0.01 * std::pow(100.0, random.uniform()),
                     5e-3 + 1e-3 * random.normal()});
  }
  Protocol history(Drive::displacement, knots);
  history.set_equilibrium_at_start(true);
  std::vector<double> times;
  for (const Knot& k : knots) times.push_back(k.time_s);
  for (const Element& element : kElements) {
    const LawModel law(parse_law_name(element.name, "test"));
    for (const double alpha : {0.2, 0.7, 0.97}) {
      auto values = element_values(element, alpha);
      values.back() = 10.0;  // far from detachment: then the forces would be cut off
      if (!element.solid) values[values.size() - 2] = 0.0;
      const auto force = law.respond(history, times, values, Want::values).value;
      std::vector<double> exact;
      bool touching = true;
      for (std::size_t i = 0; i < knots.size(); ++i) {
        double sum = element.solid ? kInf * knots.front().value : 0.0;
        for (std::size_t k = 1; k <= i; ++k) {
          const double slope = (knots[k].value - knots[k - 1].value) / (times[k] - times[k - 1]);
          sum += slope * (stiffness_integral(element, alpha, times[i] - times[k - 1]) -
                          stiffness_integral(element, alpha, times[i] - times[k]));
        }
        touching = touching && sum > 0.0;
        if (!touching) break;  // the law lets go of the surface, the plain sum does not
        exact.push_back(sum);
      }
      INFO(element.name << ", alpha " << alpha << ", " << exact.size() << " samples");
      if (element.solid && alpha < 0.5) CHECK(exact.size() > 10);
      for (std::size_t i = 0; i < exact.size(); ++i) {
        CHECK_THAT(force[static_cast<Eigen::Index>(i)] - 10.0, WithinAbs(exact[i], 1e-8));
      }
    }
  }
}

TEST_CASE("order 1 is the classical law", "[fractional]") {
  const Protocol push(Drive::displacement,
                      {{0.0, 0.0}, {0.7, 2e-3}, {1.5, 1.8e-3}, {2.0, 3e-3}, {6.0, 3e-3}});
  std::vector<double> times;
  for (int i = 1; i < 200; ++i) times.push_back(0.03 * i);
  const auto ask = [&](const char* name, const std::vector<double>& values) {
    return LawModel(parse_law_name(name, "test")).respond(push, times, values, Want::values).value;
  };
  const Eigen::VectorXd zener = ask("power-1", {kInf, kOne, kTau, 1.4, 0.0, 0.0});
  CHECK(largest(ask("power-fzener", {kInf, kOne, kTau, 1.0, 1.4, 0.0, 0.0}) - zener) <
        1e-9 * largest(zener));
  const Eigen::VectorXd maxwell = ask("linear-1-fluid", {kOne, kTau, 0.0, 0.0});
  CHECK(largest(ask("linear-fmaxwell", {kOne, kTau, 1.0, 0.0, 0.0}) - maxwell) <
        1e-9 * largest(maxwell));
}

TEST_CASE("a jump of the depth: exact stiffness at once, or refused", "[fractional]") {
  const Protocol step = step_and_hold(2e-3, std::numeric_limits<double>::infinity());
  const std::vector<double> times{0.0, 0.01, 0.5, 20.0, std::numeric_limits<double>::infinity()};
  for (const Element& element : kElements) {
    const LawModel law(parse_law_name(element.name, "test"));
    const auto values = element_values(element, 0.6);
    if (!element.relaxes) {
      CHECK_THROWS_WITH(law.respond(step, times, values, Want::values),
                        Catch::Contains("jumps at 0 s") && Catch::Contains("expected a ramp"));
      continue;
    }
    const auto force = law.respond(step, times, values, Want::values).value;
    const double end = element.solid ? kInf : 0.0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double relaxing =
          std::isinf(times[i]) ? 0.0 : mittag_leffler(0.6, 1.0, std::pow(times[i] / kTau, 0.6));
      CHECK_THAT(force[static_cast<Eigen::Index>(i)],
                 WithinAbs(2e-3 * (end + kOne * relaxing), 1e-11));
    }
  }
}

TEST_CASE("creep under a step of load is the exact compliance", "[fractional][heavy]") {
  const std::vector<double> times{0.0, 0.05, 0.2, 1.0, 5.0, 40.0};
  for (const Element& element : kElements) {
    LawSpec spec = parse_law_name(element.name, "test");
    spec.reference = 0.01;
    const LawModel law(spec);
    for (const double alpha : {0.2, 0.5, 0.8, 0.95, 1.0}) {
      const auto depth =
          law.respond(creep(0.2, 40.0), times, element_values(element, alpha), Want::values).value;
      double worst = 0.0;
      for (std::size_t i = 0; i < times.size(); ++i) {
        const double exact = 0.2 * compliance(element, alpha, times[i]);
        const double off = std::abs(depth[static_cast<Eigen::Index>(i)] - exact);
        worst = std::max(worst, exact > 0.0 ? off / exact : off);
      }
      INFO(element.name << ", alpha " << alpha << ": " << worst);
      CHECK(worst < (element.relaxes ? 1e-9 : 5e-6));
    }
  }
}
