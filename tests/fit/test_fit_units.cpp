// The unit in which a recording is written changes neither its law nor what is said of it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "one_law.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

/// Powers of ten by which the times, depths and forces of a recording are multiplied.
struct Powers {
  int time = 0, depth = 0, force = 0;
};

double ten_to(int power) {
  return std::pow(10.0, power);
}

/// Ramp and hold of a law with noise of 0.2 % of the peak, in contact from the first sample on:
/// where it begins and where the force's zero lies trade off.
Recording in_contact(const std::string& law, const std::vector<double>& values,
                     const Powers& powers) {
  Recording r;
  for (int i = 0; i < 120; ++i) {
    const double t = 0.1 * i;
    r.time_s.push_back(t);
    r.drive.push_back(std::min(4e-3, 2e-3 * t));
  }
  const LawModel model(parse_law_name(law, "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f = model.respond(history, r.time_s, values, Want::values).value;
  Random random(11);
  for (const double force : f) r.response.push_back(force + 0.002 * f.maxCoeff() * random.normal());
  for (double& t : r.time_s) t *= ten_to(powers.time);
  for (double& u : r.drive) u *= ten_to(powers.depth);
  for (double& force : r.response) force *= ten_to(powers.force);
  return r;
}

FitResult fit_in_units(const std::string& law, const std::vector<double>& values,
                       const Powers& powers) {
  return test::select_one(law, prepare_recording("one.csv", in_contact(law, values, powers)))
      .candidates.front()
      .fit;
}

double factor_of(const FitParameter& p, const Powers& powers) {
  switch (p.unit.dimension) {
    case Dimension::time:
      return ten_to(powers.time);
    case Dimension::length:
      return ten_to(powers.depth);
    case Dimension::force:
      return ten_to(powers.force);
    case Dimension::stiffness:
      return ten_to(powers.force - powers.depth);
    default:
      return 1.0;
  }
}

void check_limit(const std::optional<double>& found, const std::optional<double>& expected,
                 double factor, double width) {
  REQUIRE(found.has_value() == expected.has_value());
  if (found) CHECK(std::abs(*found / factor - *expected) <= 1e-4 * width);
}

/// What is said of the weakest direction, without its numbers.
std::string told_of_weakest(const FitResult& fit) {
  return fit.weakest_words.substr(0, fit.weakest_words.find(" (singular values"));
}

/// Digits agree to a ten-thousandth of the standard error: bounds and starts are rounded to four
/// digits, from which the search comes to the minimum another way.
void check_same(const FitResult& found, const FitResult& expected, const Powers& powers) {
  REQUIRE(found.parameters.size() == expected.parameters.size());
  for (std::size_t i = 0; i < found.parameters.size(); ++i) {
    const ParameterResult& p = found.parameters[i];
    const ParameterResult& q = expected.parameters[i];
    CAPTURE(powers.time, powers.depth, powers.force, p.summary, q.summary);
    const double factor = factor_of(p.parameter, powers);
    CHECK(p.parameter.name == q.parameter.name);
    CHECK(p.verdict == q.verdict);
    CHECK(p.conditional_on.size() == q.conditional_on.size());
    REQUIRE(p.standard_error.has_value() == q.standard_error.has_value());
    REQUIRE(q.standard_error.has_value());
    const double width = *q.standard_error;
    CHECK(std::abs(p.estimate / factor - q.estimate) <= 1e-4 * width);
    CHECK(std::abs(*p.standard_error / factor - width) <= 1e-4 * width);
    check_limit(p.lower, q.lower, factor, width);
    check_limit(p.upper, q.upper, factor, width);
  }
  CHECK(found.remarks.size() == expected.remarks.size());
  CHECK(told_of_weakest(found) == told_of_weakest(expected));
}

}  // namespace

TEST_CASE("units change neither the parameters of a recording nor what is said of them",
          "[select][units]") {
  const auto [law, values] = GENERATE(table<std::string, std::vector<double>>(
      {{"linear-1", {60.0, 45.0, 2.0, 0.0, 0.0}}, {"power-1", {60.0, 45.0, 2.0, 1.6, 0.0, 0.0}}}));
  CAPTURE(law);
  const FitResult expected = fit_in_units(law, values, {});
  for (const Powers& powers :
       {Powers{0, 0, -9}, Powers{0, -3, -6}, Powers{0, 0, -12}, Powers{0, 0, 12}, Powers{0, -12, 0},
        Powers{0, 12, 0}, Powers{-12, 0, 0}, Powers{12, 0, 0}, Powers{12, -12, 12},
        Powers{-12, 12, -12}, Powers{3, 12, -12}, Powers{-3, -12, 12}}) {
    check_same(fit_in_units(law, values, powers), expected, powers);
  }
}
