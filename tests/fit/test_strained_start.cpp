// A strain that does not start at 0: what it counts from is said.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string>

#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;

namespace {

/// A rest, a ramp of 5 % in 1 s and a hold; the stress follows an elastic specimen of 2 kPa.
PreparedRecording strained_recording(double offset, double stress_Pa) {
  Recording r;
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  Random random(3);
  for (int i = 0; i < 400; ++i) {
    const double t = 0.05 * i;
    const double strain = std::clamp(0.05 * (t - 5.0), 0.0, 0.05);
    r.time_s.push_back(t);
    r.drive.push_back(offset + strain);
    r.response.push_back(stress_Pa + 2000.0 * strain + 0.5 * random.normal());
  }
  return prepare_recording("strained.csv", std::move(r));
}

std::string start_remark(const PreparedRecording& recording) {
  return std::string(test::remark_text(recording.remarks, "strain_from_start"));
}

}  // namespace

TEST_CASE("a strain that starts away from 0 is said to count from there", "[placement]") {
  CHECK_FALSE(test::has_remark(strained_recording(0.0, 0.0).remarks, "strain_from_start"));
  CHECK_FALSE(test::has_remark(strained_recording(1e-5, 0.0).remarks, "strain_from_start"));

  const PreparedRecording unloaded = strained_recording(0.02, 0.0);
  CHECK_THAT(start_remark(unloaded),
             Contains("strained.csv: the strain starts at 0.02 and counts from") &&
                 Contains("--contact \"0\"") && !Contains("where it reads"));
  CHECK_THAT(start_remark(strained_recording(0.02, 40.0)), Contains("where it reads"));

  // The fit counts as it is said, unless a contact is stated.
  const LawSpec law = parse_law_name("linear", "test");
  FitConfig config = recording_config(law, {&unloaded, 1}, {});
  const std::size_t contact = config.fixed.size() - 2;
  CHECK(config.fixed[contact] == 0.02);
  SetupOptions stated;
  stated.contact = 0.0;
  config = recording_config(law, {&unloaded, 1}, stated);
  CHECK(config.fixed[contact] == 0.0);
  // It is said with the choice among laws, too.
  SelectionOptions options;
  options.laws = {law};
  options.only_listed = true;
  options.held_out = false;
  CHECK(test::has_remark(select_law({&unloaded, 1}, options).remarks, "strain_from_start"));
}
