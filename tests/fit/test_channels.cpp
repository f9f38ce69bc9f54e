// Recordings whose channels do not belong together, whose contact lies in a jump, and cycles.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "one_law.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/recording/repeated_readings.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/channel_cause.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Contains;
using Catch::StartsWith;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double kSampling_s = 0.05;

/// Depth in m over the time in s, at rest until 2 s; force of k_inf 60 N/m with branches, exactly.
Recording pressed_at_steps(const std::function<double(double)>& depth, double end_s, double noise_N,
                           const std::vector<std::pair<double, double>>& branches = {{45.0, 2.0}}) {
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  Random random(7);
  std::vector<double> memory(branches.size(), 0.0);
  for (double t = 0.0; t <= end_s + 1e-9; t += kSampling_s) {
    const double before = r.drive.empty() ? 0.0 : r.drive.back();
    const double now = depth(t);
    double force = 60.0 * now;
    for (std::size_t i = 0; i < branches.size(); ++i) {
      const auto [k, tau] = branches[i];
      const double left = std::exp(-kSampling_s / tau);
      memory[i] = memory[i] * left + k * (now - before) * tau / kSampling_s * (1.0 - left);
      force += memory[i];
    }
    r.time_s.push_back(t);
    r.drive.push_back(now);
    r.response.push_back(force + noise_N * random.normal());
  }
  return r;
}

double ramp_of_two_seconds(double t) {
  return 2e-3 * std::clamp(t - 2.0, 0.0, 2.0);
}

Selection selected_of_channels(const PreparedRecording& recording) {
  return test::select_one("linear-1", recording, test::setup_of(8, false));
}

LawAdequacy adequacy_with(ChannelFault fault, double time_s) {
  // What one channel suffered is what the other one is given.
  Recording r = pressed_at_steps(ramp_of_two_seconds, 30.0, 0.0);
  const ChannelFault given = fault == ChannelFault::response_delayed ? ChannelFault::drive_delayed
                             : fault == ChannelFault::drive_delayed ? ChannelFault::response_delayed
                             : fault == ChannelFault::response_filtered
                                 ? ChannelFault::drive_filtered
                                 : ChannelFault::response_filtered;
  if (time_s > 0.0) r = with_same_fault(std::move(r), given, time_s);
  Random random(3);
  for (double& force : r.response) force += 2e-4 * random.normal();
  const Selection s = selected_of_channels(prepare_recording("made.csv", std::move(r)));
  return s.candidates[s.recommended].fit.adequacy.value();
}

}  // namespace

TEST_CASE("a channel that is late is named, with its time", "[channels]") {
  CHECK_THAT(adequacy_with(ChannelFault::response_delayed, 0.2).summary,
             Contains("likely cause: the force is recorded 0.2 s later than the depth"));
  CHECK_THAT(adequacy_with(ChannelFault::drive_delayed, 0.3).summary,
             Contains("likely cause: the depth is recorded 0.3 s later than the force"));
  const LawAdequacy filtered = adequacy_with(ChannelFault::response_filtered, 0.3);
  CHECK(filtered.is_rejected());
  REQUIRE(filtered.causes.size() == 1);
  CHECK(filtered.causes.front().code == "late_channel");
  CHECK_THAT(filtered.causes.front().text,
             Contains("the force follows late, as behind a filter with a time constant of 0.3 s"));
}

TEST_CASE("no channel is called late where the tissue has another branch", "[channels]") {
  CHECK(adequacy_with(ChannelFault::response_delayed, 0.0).is_adequate());
  const Selection s = selected_of_channels(prepare_recording(
      "made.csv",
      pressed_at_steps(ramp_of_two_seconds, 30.0, 1e-4, {{45.0, 2.0}, {40.0, 0.2}, {20.0, 9.0}})));
  const LawAdequacy adequacy = s.candidates[s.recommended].fit.adequacy.value();
  CHECK(adequacy.is_rejected());
  CHECK_THAT(adequacy.summary, !Contains("late"));
}

TEST_CASE("delays and filters keep levels, and a ramp late by their time", "[channels]") {
  const Recording r = pressed_at_steps(ramp_of_two_seconds, 30.0, 0.0);
  for (const ChannelFault fault :
       {ChannelFault::response_delayed, ChannelFault::response_filtered}) {
    const Recording late = with_same_fault(r, fault, 0.2);
    CHECK(late.response == r.response);
    CHECK_THAT(late.drive.back(), WithinAbs(4e-3, 1e-12));
    const auto at = static_cast<std::size_t>(std::lround(3.5 / kSampling_s));  // within the ramp
    CHECK_THAT(late.drive[at], WithinAbs(2e-3 * 1.3, 1e-3 * 2.0 * std::exp(-1.5 / 0.2)));
  }
}

TEST_CASE("contact within a jump is said with the option that states it", "[channels]") {
  const auto jump = [](double t) { return t < 2.0 - 1e-9 ? 0.0 : 4e-3; };
  const PreparedRecording jumped =
      prepare_recording("jump.csv", pressed_at_steps(jump, 30.0, 2e-4));
  const Selection s = selected_of_channels(jumped);
  const bool said = std::ranges::any_of(s.summary, [](const std::string& sentence) {
    return sentence.find(
               "contact lies within a jump of the drive, from 0 mm at 1.95 s to 4 mm "
               "at 2 s") != std::string::npos &&
           sentence.find("--contact \"0 mm\"") != std::string::npos;
  });
  CHECK(said);
  // Whether contact is fitted follows from what a parameter sets, not from its name.
  FitConfig config = s.candidates[s.recommended].fit.config;
  const std::vector<LawParameter> table = law_parameters(config.law.value());
  const auto setting = [&](const char* name, const char* target) {
    EstimatedParameter p;
    p.fit.name = name;
    p.sets = {{static_cast<std::size_t>(std::ranges::find(table, target, &LawParameter::name) -
                                        table.begin()),
               {}}};
    return p;
  };
  config.parameters = {setting("contact_stiffness", "k_inf")};
  CHECK_THAT(contact_in_jump_words(jumped, config), Contains("every coefficient supposes 0 mm"));
  config.parameters.push_back(setting("touch", "contact"));
  CHECK_THAT(contact_in_jump_words(jumped, config), Contains("contact is fitted"));
  const PreparedRecording ramped =
      prepare_recording("ramp.csv", pressed_at_steps(ramp_of_two_seconds, 30.0, 2e-4));
  config = selected_of_channels(ramped).candidates.front().fit.config;
  CHECK(contact_in_jump_words(ramped, config).empty());
  // A ramp of few samples is no jump, though each of them is more than a tenth of the travel.
  const auto coarse = [](double t) {
    return 4e-3 * std::clamp((t - 2.0) / (8.0 * kSampling_s), 0.0, 1.0);
  };
  const PreparedRecording few = prepare_recording("few.csv", pressed_at_steps(coarse, 30.0, 2e-4));
  CHECK(contact_in_jump_words(few, config).empty());
}

TEST_CASE("where cycles turn is no rest", "[channels]") {
  const auto triangle = [](double t) {
    return t < 2.0 ? 0.0 : 4e-3 * (1.0 - std::abs(std::fmod((t - 2.0) / 4.0, 2.0) - 1.0));
  };
  const PreparedRecording cycles =
      prepare_recording("cycles.csv", pressed_at_steps(triangle, 42.0, 2e-4));
  const RestReadings rests = read_rests(cycles);
  CHECK(rests.before >= 40);
  CHECK(rests.after == 0);
  REQUIRE(rests.zero);
  CHECK_THAT(rests.zero->value, WithinAbs(0.0, 4.0 * rests.zero->sd));
  CHECK(rests.zero->sd < 1e-4);
  // The answer says which part was fitted and how to fit more.
  const Selection s = selected_of_channels(cycles);
  const std::vector<Remark> remarks = outside_remarks(s.candidates.front().fit);
  REQUIRE_FALSE(remarks.empty());
  CHECK(remarks.back().code == "fitted_part");
  CHECK_THAT(remarks.back().text, Contains("fitted from 2 to 6 s") &&
                                      Contains("\"to\" in config.json") && Contains("--until"));
}

namespace {

/// As a logger writes readings that come once in so many rows.
std::vector<double> held(std::vector<double> readings, std::size_t rows) {
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i] = readings[i - i % rows];
  return readings;
}

/// Readings of a converter with steps in N, written with five digits behind the point.
std::vector<double> converted(std::vector<double> readings, double step_N) {
  for (double& f : readings) f = std::round(std::round(f / step_N) * step_N * 1e5) * 1e-5;
  return readings;
}

}  // namespace

TEST_CASE("readings that a logger repeats are named", "[channels][repeated]") {
  Recording r = pressed_at_steps(ramp_of_two_seconds, 30.0, 3e-4);
  const std::vector<double> force = r.response;
  for (const std::size_t rows : {2, 5, 10}) {
    CAPTURE(rows);
    r.response = converted(held(force, rows), 1e-5);
    CHECK_THAT(repeated_readings(r), StartsWith("the force repeats its last reading in "));
    CHECK_THAT(repeated_readings(r), Contains(" rows while the depth moves: a logger that holds"));
  }
  const Selection s = selected_of_channels(prepare_recording("made.csv", r));
  const LawAdequacy adequacy = s.candidates[s.recommended].fit.adequacy.value();
  CHECK(adequacy.is_rejected());
  REQUIRE_FALSE(adequacy.causes.empty());
  CHECK(adequacy.causes.front().code == "readings_repeated");
  CHECK_THAT(adequacy.summary, Contains("likely cause: the force repeats its last reading in "));
  r.response = force;
  Random random(5);
  for (double& depth : r.drive) depth += 2e-6 * random.normal();
  r.drive = held(r.drive, 5);
  CHECK_THAT(repeated_readings(r), StartsWith("the depth repeats its last reading in "));
}

TEST_CASE("readings that repeat without a logger's doing are not named", "[channels][repeated]") {
  const auto cycles = [](double t) { return 1e-3 * std::abs(std::remainder(t, 4.0)); };
  const auto stairs = [](double t) { return 2e-4 * std::floor(std::clamp(2.0 * t, 0.0, 20.0)); };
  const std::vector<std::function<double(double)>> paths{ramp_of_two_seconds, cycles, stairs};
  for (std::size_t path = 0; path < paths.size(); ++path) {
    for (const double noise_N : {0.0, 1e-5, 3e-4, 3e-3, 0.03}) {
      Recording r = pressed_at_steps(paths[path], 30.0, noise_N, {});
      const std::vector<double> force = r.response;
      const double peak = *std::ranges::max_element(force);
      for (const double step : {1e-5, 1e-4, 1.23e-3, 3.7e-3, 0.0123, 0.047}) {
        r.response = converted(force, step);
        CAPTURE(path, noise_N, step);
        CHECK(repeated_readings(r) == "");
        for (double& f : r.response) f = std::min(f, 0.7 * peak);
        CHECK(repeated_readings(r) == "");
      }
    }
  }
}
