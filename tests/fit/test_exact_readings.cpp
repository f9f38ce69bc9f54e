// Material functions without noise: what is met to rounding is still known within limits.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/select/fixed_times.hpp"
#include "tpm/fit/select/material_function.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

/// Readings at equal ratios of time, each with normal noise of a share of it.
struct ExactReadings {
  std::string title = "G(t) [Pa]";
  std::function<double(double)> law;
  double from_s = 1e-4, to_s = 100.0;
  int count = 200;
  double noise = 0.0;
  double unit = 1.0, second = 1.0;  ///< of the values and of the times
};

struct TrueValue {
  std::string name;
  double value;
};

Selection selection_of(const ExactReadings& readings, const std::vector<double>& times_s = {}) {
  const test::TempFolder folder;
  std::string text = "time [s]," + readings.title + "\n";
  base::Random random(7);
  for (int i = 0; i < readings.count; ++i) {
    const double share = static_cast<double>(i) / (readings.count - 1);
    const double t = readings.from_s * std::pow(readings.to_s / readings.from_s, share);
    const double value = readings.law(t) * (1.0 + readings.noise * random.normal());
    text += fmt::format("{:.17g},{:.17g}\n", t * readings.second, value * readings.unit);
  }
  write_file(folder / "exact.csv", text);
  const auto function = find_material_function(folder / "exact.csv", {});
  REQUIRE(function);
  SelectionOptions options;
  if (!times_s.empty()) {
    options.setup.times_s = times_s;
    options.laws = {law_of_times(std::nullopt, times_s, "--times")};
    options.only_listed = true;
  }
  return select_law(*function, options);
}

/// Every true value lies in an interval that is no wider than such noise makes it.
void check_identified(const Selection& s, const std::string& law,
                      const std::vector<TrueValue>& truth) {
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == law);
  CHECK_FALSE(s.preferred);
  REQUIRE(fit.parameters.size() == truth.size());
  for (const ParameterResult& p : fit.parameters) {
    const auto known = std::ranges::find(truth, p.parameter.name, &TrueValue::name);
    REQUIRE(known != truth.end());
    INFO(p.summary);
    CHECK(p.verdict == Verdict::identified);
    CHECK(p.not_separable.empty());
    REQUIRE(p.lower);
    REQUIRE(p.upper);
    CHECK(*p.lower <= known->value);
    CHECK(*p.upper >= known->value);
    CHECK(*p.upper - *p.lower > 0.0);
    CHECK(*p.upper - *p.lower < 1e-5 * known->value);
  }
  CHECK(test::has_remark(fit.remarks, "noise_at_computed_share"));
}

TEST_CASE("exp(-t) over six decades of time is identified, however many and whatever its units",
          "[exact]") {
  ExactReadings readings;
  readings.law = [](double t) { return std::exp(-t); };
  SECTION("few readings and many") {
    readings.count = GENERATE(10, 3000);
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
  SECTION("two exponentials") {
    readings.law = [](double t) {
      return 1000.0 * std::exp(-t / 0.1) + 500.0 * std::exp(-t / 10.0);
    };
    check_identified(selection_of(readings), "linear-2-fluid",
                     {{"k1", 1000.0}, {"k2", 500.0}, {"tau1", 0.1}, {"tau2", 10.0}});
  }
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
  SECTION("creep of a solid, few readings and many") {
    readings.title = "J(t) [1/Pa]";
    readings.count = GENERATE(10, 600);
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
