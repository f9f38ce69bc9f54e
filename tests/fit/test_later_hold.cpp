// Recordings that are conditioned by cycles before the ramp that is held.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpmkit/law_model.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;

namespace {

/// Two cycles to 4 mm, a rest, and a ramp that is held: linear-1 of 100 N/m, 40 N/m and 0.7 s. The
/// force never pulls.
Recording conditioned(bool held) {
  Recording r;
  const auto cycle = [](double t) { return std::max(0.0, 4e-3 * (1.0 - std::abs(t - 1.0))); };
  for (int i = 0; 0.05 * i < (held ? 30.0 : 9.0); ++i) {
    const double t = 0.05 * i;
    r.time_s.push_back(t);
    r.drive.push_back(cycle(t - 1.0) + cycle(t - 3.0) + std::clamp(4e-3 * (t - 10.0), 0.0, 4e-3));
  }
  const LawModel model(parse_law_name("linear-1", "test"));
  const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd f =
      model
          .respond(history, r.time_s, std::vector<double>{100.0, 40.0, 0.7, 0.0, 0.0}, Want::values)
          .value;
  Random random(7);
  for (const double force : f) r.response.push_back(std::max(0.0, force) + 3e-4 * random.normal());
  return r;
}

Selection fitted(const Recording& recording, std::optional<double> contact) {
  SelectionOptions options;
  options.laws = {parse_law_name("linear-1", "test")};
  options.only_listed = true;
  options.held_out = false;
  options.setup.contact = contact;
  const std::vector<PreparedRecording> one{prepare_recording("cycles.csv", recording)};
  return select_law(one, options);
}

}  // namespace

TEST_CASE("A hold after conditioning cycles is said to be left out, and how it is fitted") {
  const Recording recording = conditioned(true);
  const Selection whole = fitted(recording, std::nullopt);
  CHECK_FALSE(test::has_remark(whole.remarks, "no_hold"));
  const std::string said(test::remark_text(whole.remarks, "hold_not_fitted"));
  CHECK_THAT(said, Contains("cycles.csv: a hold of 19") && Contains("(11 to 29.95 s)") &&
                       Contains("2 ramps after the first unloading (from 2 s) are not fitted"));

  // What it says to type, at the times and depths that it names.
  const auto number_after = [&said](const std::string& option) {
    const std::size_t at = said.find(option + " \"");
    REQUIRE(at != std::string::npos);
    return std::stod(said.substr(at + option.size() + 2));
  };
  const double from_s = number_after("--from-time");
  const double contact = 1e-3 * number_after("--contact");
  CHECK((from_s > 5.0 && from_s < 10.0));  // in the rest
  CHECK(std::abs(contact) < 0.1e-3);
  Recording last = recording;
  const auto kept = std::ranges::lower_bound(recording.time_s, from_s) - recording.time_s.begin();
  for (std::vector<double>* values : {&last.time_s, &last.drive, &last.response}) {
    values->erase(values->begin(), values->begin() + kept);
  }
  const Selection ramp = fitted(last, contact);
  CHECK_FALSE(test::has_remark(ramp.remarks, "hold_not_fitted"));
  const auto& parameters = ramp.candidates.front().fit.parameters;
  const auto k_inf = std::ranges::find(parameters, "k_inf",
                                       [](const ParameterResult& p) { return p.parameter.name; });
  REQUIRE(k_inf != parameters.end());
  CHECK((*k_inf->lower < 100.0 && 100.0 < *k_inf->upper));
}

TEST_CASE("Cycles without a hold are told as such") {
  const Selection s = fitted(conditioned(false), std::nullopt);
  CHECK(test::has_remark(s.remarks, "no_hold"));
  CHECK_FALSE(test::has_remark(s.remarks, "hold_not_fitted"));
}
