// What the samples before the load tell: spikes, an approach through the air, a force cell that
// settles, a load in the air. And what follows the load, where it turns its sign.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "one_law.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/recording/motion_before_load.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/spikes_at_rest.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::data;
using namespace tpm::fit;
using Catch::Contains;

namespace {

constexpr double kTick_s = 0.05, kAirNoise_N = 2e-4;

/// Depth in m over the time in s (below 0: in the air); force of 60 N/m and 45 N/m, 2 s, which
/// ends with the contact unless the specimen is glued, and a load of its own.
Recording approached(
    const std::function<double(double)>& depth, double end_s, std::uint64_t seed,
    bool glued = false, const std::function<double(double)>& own_N = [](double) { return 0.0; }) {
  Recording r;
  r.header.id = "made";
  Random random(seed);
  double branch = 0.0, before = std::max(depth(0.0), 0.0);
  for (double t = 0.0; t <= end_s + 1e-9; t += kTick_s) {
    const double now = glued ? depth(t) : std::max(depth(t), 0.0);
    const double left = std::exp(-kTick_s / 2.0);
    branch = branch * left + 45.0 * (now - before) * 2.0 / kTick_s * (1.0 - left);
    before = now;
    const double force = 60.0 * now + branch;
    r.time_s.push_back(t);
    r.drive.push_back(depth(t));
    r.response.push_back((glued ? force : std::max(force, 0.0)) + own_N(t) +
                         kAirNoise_N * random.normal());
  }
  return r;
}

/// Rest of 1.5 s at 1 mm, an approach of 0.5 s, a ramp of 2 s to 4 mm and a hold.
double approach_and_ramp(double t) {
  if (t < 2.0) return -1e-3 * std::min((2.0 - t) / 0.5, 1.0);
  return 4e-3 * std::min((t - 2.0) / 2.0, 1.0);
}

Selection selected_before_load(Recording r) {
  return test::select_one("linear-1", prepare_recording("made.csv", std::move(r)),
                          test::setup_of(8, false));
}

const FitResult& chosen_of(const Selection& s) {
  return s.candidates[s.recommended].fit;
}

/// Residuals of a law that is right, and a rest.
struct NoisyRest {
  std::vector<double> rest_time_s, rest, time_s, reading, residual;

  explicit NoisyRest(std::uint64_t seed) {
    Random random(seed);
    for (int i = 0; i < 60; ++i) {
      rest_time_s.push_back(0.1 * (i - 60));
      rest.push_back(random.normal());
    }
    for (int i = 0; i < 240; ++i) {
      time_s.push_back(0.1 * i);
      residual.push_back(random.normal());
      reading.push_back(100.0 + residual.back());
    }
  }
  [[nodiscard]] AdequacyData data() const {
    return {rest_time_s, rest, time_s, reading, residual, 3};
  }
};

}  // namespace

TEST_CASE("single readings far off in a rest are spikes, two levels are not", "[before_load]") {
  Random random(1);
  std::vector<double> reading;
  for (int i = 0; i < 24; ++i) reading.push_back(random.normal());
  CHECK(std::ranges::count(spikes_at_rest(reading), true) == 0);
  reading[6] += 300.0;
  reading[20] -= 100.0;
  const std::vector<bool> spikes = spikes_at_rest(reading);
  CHECK(std::ranges::count(spikes, true) == 2);
  CHECK(spikes[6]);
  CHECK(spikes[20]);
  std::vector<double> levels = reading;
  for (int i = 8; i < 14; ++i) levels[i] = 50.0;
  CHECK(std::ranges::count(spikes_at_rest(levels), true) == 2);
  for (int i = 1; i < 16; i += 2) levels[i] = 500.0;
  CHECK(std::ranges::count(spikes_at_rest(levels), true) == 0);
}

TEST_CASE("spikes in a short rest move neither zero nor noise", "[before_load]") {
  Recording r = approached(approach_and_ramp, 30.0, 2);
  r.response[6] += 0.25;
  r.response[20] += 0.11;
  const RestReadings rests = read_rests(prepare_recording("made.csv", r));
  REQUIRE(rests.zero);
  CHECK(std::abs(rests.zero->value) < kAirNoise_N);
  CHECK(rests.noise_sd < 2.0 * kAirNoise_N);
  const Selection s = selected_before_load(std::move(r));
  const FitResult& fit = chosen_of(s);
  REQUIRE(fit.adequacy);
  REQUIRE(fit.adequacy->is_adequate());
  CHECK(fit.adequacy->residual_over_noise.value() > 0.6);
  CHECK(std::abs(fit.parameters.front().estimate - 60.0) < 0.3);
}

TEST_CASE("a spike in a course is taken away, corners and steps stay", "[before_load]") {
  std::vector<double> time_s, course;
  Random random(13);
  for (int i = 0; i < 100; ++i) {
    time_s.push_back(0.1 * i);
    course.push_back(std::max(i - 40, 0) * 5.0 + (i > 70 ? 200.0 : 0.0) + 0.1 * random.normal());
  }
  CHECK(without_spikes(time_s, course) == course);
  std::vector<double> spiked = course;
  spiked[45] += 100.0;
  spiked[20] -= 30.0;
  const std::vector<double> clean = without_spikes(time_s, spiked);
  for (std::size_t i = 0; i < clean.size(); ++i) CHECK(std::abs(clean[i] - course[i]) < 1.0);
}

TEST_CASE("a spike within a ramp is left out, and one of two readings is named", "[before_load]") {
  constexpr std::size_t kInRamp = 58;  // at 2.9 s, of a ramp from 2 s to 4 s
  for (const double spike_N : {0.1, -0.1, 5.0}) {
    Recording one = approached(approach_and_ramp, 30.0, 21);
    one.response[kInRamp] += spike_N;
    const Selection s = selected_before_load(std::move(one));
    const FitResult& fit = chosen_of(s);
    CAPTURE(spike_N);
    REQUIRE(fit.adequacy);
    CHECK(fit.adequacy->is_adequate());
    CHECK(std::ranges::count(fit.recordings.at(0).outlier, true) == 1);
    CHECK(std::abs(fit.parameters.front().estimate - 60.0) < 0.3);
  }
  Recording two = approached(approach_and_ramp, 30.0, 21);
  two.response[kInRamp] += 0.2;
  two.response[kInRamp + 1] += 0.2;
  const Selection s = selected_before_load(std::move(two));
  const FitResult& fit = chosen_of(s);
  REQUIRE(fit.adequacy);
  REQUIRE(fit.adequacy->is_rejected());
  REQUIRE(fit.adequacy->causes.size() == 1);
  CHECK(fit.adequacy->causes.front().code == "spike");
  CHECK_THAT(fit.adequacy->causes.front().text, Contains("a spike at 2.9 s: two readings"));
}

TEST_CASE("residuals that step, turn or ring are no spike", "[before_load]") {
  const auto code_of = [](const std::function<double(int)>& misfit) {
    NoisyRest made(22);
    for (std::size_t i = 0; i < made.residual.size(); ++i) {
      made.residual[i] += misfit(static_cast<int>(i));
    }
    const Adequacy a = judge_adequacy(made.data());
    REQUIRE(a.described == Described::not_described);
    return a.causes.empty() ? std::string() : a.causes.front().code;
  };
  CHECK(code_of([](int i) { return i == 100 ? 300.0 : 0.0; }) == "spike");
  CHECK(code_of([](int i) { return i == 100 || i == 101 ? -300.0 : 0.0; }) == "spike");
  CHECK(code_of([](int i) { return i >= 100 ? 300.0 : 0.0; }) != "spike");
  CHECK(code_of([](int i) { return std::max(0, 60 - std::abs(i - 100)) * 5.0; }) != "spike");
  CHECK(code_of([](int i) { return 300.0 * std::sin(0.4 * i) * std::exp(-i / 40.0); }) != "spike");
  // Beside a larger misfit it is not what makes the law wrong.
  CHECK(code_of([](int i) { return 100.0 * std::sin(0.05 * i) + (i == 100 ? 300.0 : 0.0); }) !=
        "spike");
}

TEST_CASE("where an approach through the air begins is no noise of the depth", "[before_load]") {
  const Selection s = selected_before_load(approached(approach_and_ramp, 30.0, 3));
  const FitResult& fit = chosen_of(s);
  REQUIRE(fit.adequacy);
  REQUIRE(fit.adequacy->is_adequate());
  CHECK(fit.adequacy->residual_over_noise.value() > 0.6);
  CHECK(fit.adequacy->residual_over_noise.value() < 1.6);
}

TEST_CASE("readings that do not rest before the load tell no noise", "[before_load]") {
  NoisyRest alike(4);
  for (double& v : alike.rest) v *= 1.5;
  CHECK(judge_adequacy(alike.data()).described == Described::adequate);
  NoisyRest settles(5);
  for (std::size_t i = 0; i < settles.rest.size(); ++i) {
    settles.rest[i] += 200.0 * std::exp(-0.25 * static_cast<double>(i));
  }
  const Adequacy a = judge_adequacy(settles.data());
  CHECK(a.described == Described::not_judged);
  CHECK(a.restless);
}

TEST_CASE("a ramp that the law does not have is not called a transient", "[before_load]") {
  NoisyRest early(7);
  for (int i = 0; i < 20; ++i) early.residual[i] += 20.0 * std::sin(0.3 * i);
  AdequacyData data = early.data();
  REQUIRE(judge_adequacy(data).causes.size() == 1);
  CHECK(judge_adequacy(data).causes.front().code == "transient");
  data.ramp_to_s = 2.0;
  REQUIRE(judge_adequacy(data).causes.size() == 1);
  CHECK(judge_adequacy(data).causes.front().code == "ramp_or_transient");
  CHECK_THAT(judge_adequacy(data).causes.front().text,
             Catch::StartsWith("the shape of the ramp, or a transient: without the first 24"));
}

TEST_CASE("a load that changes with the motion in the air is no drift", "[before_load]") {
  const auto slow = [](double t) {
    return t < 6.0 ? -3e-3 * std::min((6.0 - t) / 4.0, 1.0) : 4e-3 * std::min((t - 6.0) / 2.0, 1.0);
  };
  Recording buoyant = approached(slow, 36.0, 8);
  for (std::size_t i = 0; i < buoyant.drive.size(); ++i) {
    buoyant.response[i] -= 2.0 * (buoyant.drive[i] + 3e-3);
  }
  CHECK_THAT(load_in_air(buoyant, 110), Contains("moves before contact"));
  const Recording drifts = approached(slow, 36.0, 9, false, [](double t) { return -2e-3 * t; });
  CHECK(load_in_air(drifts, 110).empty());
  // The samples in which the probe stands still tell the noise, and the slope goes with the depth.
  const Selection s = selected_before_load(std::move(buoyant));
  REQUIRE(chosen_of(s).adequacy);
  CHECK(chosen_of(s).adequacy->is_adequate());
  CHECK(std::abs(chosen_of(s).parameters.front().estimate - 58.0) < 1.0);
}

TEST_CASE("a probe that sticks is named, and no late channel", "[before_load]") {
  const auto press = [](double t) {
    const double down = std::min(std::max(t - 2.0, 0.0), 4.0);
    return -1e-3 + 1e-3 * (t < 10.0 ? down : std::max(4.0 - (t - 10.0), 0.0));
  };
  Recording r = approached(press, 18.0, 10);
  bool touched = false;
  for (std::size_t i = 0; i < r.drive.size(); ++i) {
    touched = touched || r.drive[i] > 0.0;
    if (touched && r.drive[i] > -0.5e-3) r.response[i] -= 0.02;
  }
  const Selection s = selected_before_load(std::move(r));
  REQUIRE(chosen_of(s).adequacy);
  REQUIRE(chosen_of(s).adequacy->is_rejected());
  REQUIRE(chosen_of(s).adequacy->causes.size() == 1);
  CHECK(chosen_of(s).adequacy->causes.front().code == "adhesion");
}

TEST_CASE("a stress that goes up in stairs is imposed", "[before_load][creep]") {
  Recording r;
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  Random random(11);
  constexpr double kInstant = 1.0 / 1800.0, kLater = 1.0 / 1000.0, kRetards_s = 9.0;
  double late = 0.0;
  for (int i = 0; i <= 800; ++i) {
    const double t = 0.1 * i;
    const double stress = t < 1.0 ? 0.0 : t < 41.0 ? 20.0 : 50.0;
    late += ((kLater - kInstant) * stress - late) * (1.0 - std::exp(-0.1 / kRetards_s));
    r.time_s.push_back(t);
    r.response.push_back(stress);
    r.drive.push_back(kInstant * stress + late + 5e-5 * random.normal());
  }
  CHECK(prepare_recording("stairs.csv", r).load_imposed);
  // Strain in stairs, whose stress relaxes within a tenth of each: the strain was imposed.
  std::swap(r.drive, r.response);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double t = r.time_s[i];
    r.drive[i] = t < 1.0 ? 0.0 : t < 41.0 ? 0.02 : 0.05;
    const double since = t < 41.0 ? t - 1.0 : t - 41.0;
    r.response[i] = 1000.0 * r.drive[i] + (t < 1.0 ? 0.0 : 20.0 * std::exp(-since / 2.0)) +
                    0.05 * random.normal();
  }
  CHECK_FALSE(prepare_recording("relaxes.csv", r).load_imposed);
}

TEST_CASE("where the load turns its sign no law is said to fail", "[before_load]") {
  const auto pull = [](double t) {
    if (t < 2.0) return 0.0;
    return t < 22.0 ? 4e-3 * std::min((t - 2.0) / 2.0, 1.0)
                    : std::max(4e-3 - 2e-3 * (t - 22.0), 0.0);
  };
  const Selection s = selected_before_load(approached(pull, 30.0, 12, true));
  const std::vector<Remark> remarks = outside_remarks(chosen_of(s));
  const auto after = std::ranges::find(remarks, "not_described_after_fit", &Remark::code);
  REQUIRE(after != remarks.end());
  CHECK_THAT(after->text, Contains("the load turns its sign") && !Contains("does not describe"));
}
