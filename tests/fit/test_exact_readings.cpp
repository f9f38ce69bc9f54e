// Material functions without noise: what is met to rounding is still known within limits.
#include "support/exact_readings.hpp"

namespace tpm::fit {
namespace {

using test::check_identified;
using test::ExactReadings;
using test::selection_of;
using test::TrueValue;

TEST_CASE("exp(-t) over six decades of time is identified, whatever its units", "[exact]") {
  ExactReadings readings;
  readings.law = [](double t) { return std::exp(-t); };
  SECTION("few readings") {
    readings.count = 10;
  }
  SECTION("other units") {
    readings.unit = 1e12;
    readings.second = 1e-6;
  }
  SECTION("noise below what is computed") {
    readings.noise = 1e-12;
  }
  INFO(readings.count);
  check_identified(selection_of(readings), "linear-1-fluid",
                   {{"k1", readings.unit}, {"tau1", readings.second}});
}

TEST_CASE("Exact moduli and compliances of other laws are identified", "[exact]") {
  ExactReadings readings;
  SECTION("two exponentials and a plateau") {
    readings.law = [](double t) {
      return 300.0 + 1000.0 * std::exp(-t) + 200.0 * std::exp(-t / 20.0);
    };
    check_identified(
        selection_of(readings), "linear-2",
        {{"k_inf", 300.0}, {"k1", 1000.0}, {"k2", 200.0}, {"tau1", 1.0}, {"tau2", 20.0}});
  }
  SECTION("a power of time") {
    readings.law = [](double t) { return 1000.0 * std::pow(t, -0.3); };
    check_identified(selection_of(readings), "linear-fspringpot",
                     {{"k1", 1000.0 * std::tgamma(0.7)}, {"alpha", 0.3}});
  }
  SECTION("creep of a solid") {
    readings.title = "J(t) [1/Pa]";
    readings.count = 10;
    readings.law = [](double t) { return 1.0 / 2000.0 + (1.0 - std::exp(-t / 5.0)) / 3000.0; };
    check_identified(selection_of(readings), "linear-1",
                     {{"k_inf", 1200.0}, {"k1", 800.0}, {"tau1", 3.0}});
  }
  SECTION("creep of a fluid") {
    readings.title = "J(t) [1/Pa]";
    readings.law = [](double t) { return 1.0 / 2000.0 + t / 3e4; };
    check_identified(selection_of(readings), "linear-1-fluid", {{"k1", 2000.0}, {"tau1", 15.0}});
  }
}

TEST_CASE("An exact Prony series on 31 stated times is identified", "[exact]") {
  ExactReadings readings;
  std::vector<double> times_s;
  std::vector<TrueValue> truth{{"k_inf", 50.0}};
  for (int i = 0; i < 31; ++i) {
    times_s.push_back(std::pow(10.0, i - 15));
    truth.push_back({fmt::format("k{}", i + 1), 100.0 + 10.0 * i});
  }
  readings.law = [&](double t) {
    double sum = 50.0;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      sum += truth[i + 1].value * std::exp(-t / times_s[i]);
    }
    return sum;
  };
  readings.from_s = 1e-15;
  readings.to_s = 1e15;
  readings.count = 250;
  check_identified(selection_of(readings, times_s), "linear-31", truth);
}

TEST_CASE("Noise that is seen is estimated as before", "[exact]") {
  ExactReadings readings;
  readings.law = [](double t) { return std::exp(-t); };
  readings.noise = 1e-6;
  const Selection s = selection_of(readings);
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(fit.variance_factor > 100.0 * fit.least_variance);
  CHECK_FALSE(test::has_remark(fit.remarks, "noise_at_computed_share"));
}

}  // namespace
}  // namespace tpm::fit
