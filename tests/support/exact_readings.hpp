#pragma once
// Material functions in closed form at equal ratios of time, and the answer that a choice of the
// law owes them.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "support/remarks.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/select/fixed_times.hpp"
#include "tpm/fit/select/material_function.hpp"

namespace tpm::test {

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

inline fit::Selection selection_of(const ExactReadings& readings,
                                   const std::vector<double>& times_s = {}) {
  const TempFolder folder;
  std::string text = "time [s]," + readings.title + "\n";
  base::Random random(7);
  for (int i = 0; i < readings.count; ++i) {
    const double share = static_cast<double>(i) / (readings.count - 1);
    const double t = readings.from_s * std::pow(readings.to_s / readings.from_s, share);
    const double value = readings.law(t) * (1.0 + readings.noise * random.normal());
    text += fmt::format("{:.17g},{:.17g}\n", t * readings.second, value * readings.unit);
  }
  files::write_file(folder / "exact.csv", text);
  const auto function = fit::find_material_function(folder / "exact.csv", {});
  REQUIRE(function);
  fit::SelectionOptions options;
  if (!times_s.empty()) {
    options.setup.times_s = times_s;
    options.laws = {fit::law_of_times(std::nullopt, times_s, "--times")};
    options.only_listed = true;
  }
  return fit::select_law(*function, options);
}

/// Every true value lies in an interval that is no wider than such noise makes it.
inline void check_identified(const fit::Selection& s, const std::string& law,
                             const std::vector<TrueValue>& truth) {
  const fit::FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == law);
  CHECK_FALSE(s.preferred);
  REQUIRE(fit.parameters.size() == truth.size());
  for (const fit::ParameterResult& p : fit.parameters) {
    const auto known = std::ranges::find(truth, p.parameter.name, &TrueValue::name);
    REQUIRE(known != truth.end());
    INFO(p.summary);
    CHECK(p.verdict == fit::Verdict::identified);
    CHECK_FALSE(p.not_separable);
    REQUIRE(p.lower);
    REQUIRE(p.upper);
    CHECK(*p.lower <= known->value);
    CHECK(*p.upper >= known->value);
    CHECK(*p.upper - *p.lower > 0.0);
    CHECK(*p.upper - *p.lower < 1e-5 * known->value);
  }
  CHECK(has_remark(fit.remarks, "noise_at_computed_share"));
}

}  // namespace tpm::test
