// Creep of spring-pots with elastic tension under a kept load: collocation against a closed form,
// the stepped way, the compliance without tension, and the force that the depth gives back.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "expected_values.hpp"
#include "step_response.hpp"
#include "tpm/law/relaxation/exponential_sum.hpp"
#include "tpm/law/tension_creep.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::law;

namespace {

constexpr const char* kAllLaws[] = {
    "linear-fspringpot-elastic", "linear-fmaxwell-elastic",  "linear-fkelvin_voigt-elastic",
    "linear-fzener-elastic",     "linear-fmaxwell2-elastic", "linear-fkelvin_voigt2-elastic",
    "linear-fzener2-elastic",    "power-fspringpot-elastic", "hertz-fzener-elastic"};

std::vector<double> values_of(const LawModel& law, double k_tension) {
  std::vector<double> values;
  for (const LawParameter& p : law.law_parameters()) {
    values.push_back(p.name == "exponent"    ? 1.6
                     : p.name == "k_tension" ? k_tension
                     : p.name == "spacing"   ? 0.012
                     : p.name == "alpha"     ? 0.55
                     : p.name == "beta"      ? 0.15
                     : p.name == "tau1"      ? 0.7
                     : p.name == "contact"   ? 1e-4
                     : p.name == "offset"    ? 2e-3
                     : p.name == "k_inf"     ? 15.0
                                             : 40.0);
  }
  return values;
}

std::vector<double> log_times(int count, double first_s, double last_s) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    times.push_back(first_s * std::pow(last_s / first_s, static_cast<double>(i) / (count - 1)));
  }
  return times;
}

}  // namespace

TEST_CASE("A dashpot beside cubic tension creeps as its differential equation says", "[law]") {
  // k1 du/dt + c u^3 = L; with x = u/(L/c)^(1/3) the time is an elementary integral of 1/(1 - x^3).
  const LawModel law(parse_law_name("linear-fspringpot-elastic", "test"));
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const double k1 = 50.0, k_tension = 30.0, load = 0.3;
  const double c = k_tension / std::pow(law.spec().reference, 2);
  const double deepest = std::cbrt(load / c);
  const auto exact_time = [&](double x) {
    const double root = std::sqrt(3.0);
    const double integral = std::log((1.0 + x + x * x) / ((1.0 - x) * (1.0 - x))) / 6.0 +
                            (std::atan((2.0 * x + 1.0) / root) - std::atan(1.0 / root)) / root;
    return integral * k1 * deepest / load;
  };
  const std::vector<double> times = log_times(60, 1e-3, 0.4);
  const std::vector<double> values{k1, 1.0, k_tension, kInfinite, 0.0, 0.0};
  const Eigen::VectorXd u =
      law.respond(creep(load, times.back()), times, values, Want::values).value;
  CHECK(u[u.size() - 1] > 0.7 * deepest);
  for (std::size_t i = 0; i < times.size(); ++i) {
    INFO(times[i]);
    const double t = exact_time(u[static_cast<Eigen::Index>(i)] / deepest);
    CHECK(std::abs(t / times[i] - 1.0) < 2e-6);
  }
}

TEST_CASE("Spring-pots with elastic tension creep as in the stepped way", "[law][heavy]") {
  const std::vector<double> times = log_times(12, 0.01, 100.0);
  const Protocol kept = creep(0.3, times.back());
  // What comes after the last asked time makes it a history that is stepped.
  const Protocol stepped(Drive::force,
                         {{0.0, 0.3}, {times.back(), 0.3}, {times.back() + 1.0, 0.4}});
  for (const char* name : kAllLaws) {
    INFO(name);
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = values_of(law, 35.0);
    const Response a = law.respond(kept, times, values, Want::values_and_sensitivity);
    const Response b = law.respond(stepped, times, values, Want::values_and_sensitivity);
    for (Eigen::Index i = 0; i < a.value.size(); ++i) {
      CHECK(std::abs(a.value[i] / b.value[i] - 1.0) < 1e-6);
    }
    for (Eigen::Index j = 0; j < b.sensitivity.cols(); ++j) {
      INFO(law.law_parameters()[static_cast<std::size_t>(j)].name);
      const double size = b.sensitivity.col(j).cwiseAbs().maxCoeff();
      CHECK((a.sensitivity.col(j) - b.sensitivity.col(j)).cwiseAbs().maxCoeff() <= 1e-5 * size);
    }
  }
}

TEST_CASE("Spring-pots with elastic tension of no stiffness creep by their compliance", "[law]") {
  const std::vector<double> times = log_times(41, 0.01, 100.0);
  for (const char* name : kAllLaws) {
    INFO(name);
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = values_of(law, 0.0);
    LawSpec plain_spec = law.spec();
    plain_spec.tension = Tension::none;
    const LawModel plain(plain_spec);
    std::vector<double> plain_values = values;
    plain_values.erase(plain_values.end() - 4, plain_values.end() - 2);
    const Protocol load = creep(0.3, times.back());
    const Eigen::VectorXd a = law.respond(load, times, values, Want::values).value;
    const Eigen::VectorXd exact = plain.respond(load, times, plain_values, Want::values).value;
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      CHECK(std::abs((a[i] - 1e-4) / (exact[i] - 1e-4) - 1.0) < 1e-5);
    }
  }
}

TEST_CASE("The depth under a kept load, imposed on the same law, gives the load back", "[law]") {
  std::vector<double> times = log_times(1000, 1e-4, 10.0);
  times.insert(times.begin(), 0.0);
  const double load = 0.3;
  for (const char* name : kAllLaws) {
    INFO(name);
    const LawModel law(parse_law_name(name, "test"));
    const std::vector<double> values = values_of(law, 35.0);
    const Eigen::VectorXd u =
        law.respond(creep(load, times.back()), times, values, Want::values).value;
    std::vector<Knot> knots;
    for (std::size_t i = 0; i < times.size(); ++i) {
      knots.push_back({times[i], u[static_cast<Eigen::Index>(i)]});
    }
    const std::vector<double> late = log_times(20, 0.02, 10.0);
    const Eigen::VectorXd force =
        law.respond(Protocol(Drive::displacement, knots), late, values, Want::values).value;
    // Straight lines between depths 1 % of the time apart.
    for (Eigen::Index i = 0; i < force.size(); ++i)
      CHECK(std::abs(force[i] / load - 1.0) < test::allowed_error("creep.inverse"));
  }
}

TEST_CASE("A spring-pot with elastic tension takes as many steps however densely it is read",
          "[law]") {
  const LawModel law(parse_law_name("linear-fspringpot-elastic", "test"));
  const std::vector<double> values = values_of(law, 35.0);
  const ExponentialSum rates(1e-6, 100.0, kFractionalTolerance);
  const LawAtParameters at = law.at(values, &rates);
  int for_dense = 0, for_last = 0;
  REQUIRE(creep_with_tension(at, 0.3, log_times(162, 0.01, 100.0), Want::values, &for_dense));
  REQUIRE(creep_with_tension(at, 0.3, std::vector<double>{100.0}, Want::values, &for_last));
  CHECK(for_dense == for_last);
  CHECK(for_dense <= test::allowed_cost("creep.springpot_with_tension"));
  // A time of 0 alone leaves nothing to step.
  CHECK_FALSE(creep_with_tension(at, 0.3, std::vector<double>{0.0}, Want::values));
}

TEST_CASE("J(t) at many times is that of one time each", "[law]") {
  for (const char* name : {"linear-fzener2", "linear-fkelvin_voigt2", "linear-fspringpot",
                           "linear-2", "linear-2-series"}) {
    INFO(name);
    const LawSpec spec = parse_law_name(name, "test");
    std::vector<double> values = values_of(LawModel(spec), 0.0);
    for (std::size_t i = 0; i + 2 < values.size(); ++i) {
      if (LawModel(spec).law_parameters()[i].dimension == Dimension::time) {
        values[i] = 0.1 * (1.0 + static_cast<double>(i));
      }
    }
    const StepResponse response(spec, values);
    for (const double t : {1e-8, 1e-3, 1.0, 40.0, 1e7}) {
      const SlopedNumber many = response.creep(t);
      const SlopedNumber one = law_creep(spec, values, t);
      CHECK(many.value == one.value);
      CHECK(many.by == one.by);
    }
  }
}
