// Recordings from one path, and their phases.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "expected_values.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/data/phases.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/recording_file.hpp"

using namespace tpm;
using namespace tpm::files;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::TempFolder;

namespace {

/// Corners of a drive: time in s, depth in mm.
using DrivePath = std::vector<std::pair<double, double>>;

double along(const DrivePath& path, double time) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (time > path[i].first && i + 1 < path.size()) continue;
    const auto& [t0, u0] = path[i - 1];
    const auto& [t1, u1] = path[i];
    return u0 + (u1 - u0) * std::min(1.0, (time - t0) / (t1 - t0));
  }
  return path.front().second;
}

struct Making {
  double step_s = 0.1;
  double force_noise_N = 0.0;
  double drive_noise_mm = 0.0;
  double contact_mm = 0.0;
  double offset_N = 0.0;
  bool uneven = false;
};

/// A relaxing contact, k (e + q) with e the depth in contact and q an overstress that fades within
/// 2 s, never below 0 (nothing sticks).
Recording made(const DrivePath& path, const Making& making) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  Recording recording;
  recording.header.id = "made";
  double overstress = 0.0;
  double before = 0.0;
  double time = 0.0;
  while (time <= path.back().first + 1e-9) {
    const double depth = along(path, time);
    const double contact = std::max(depth - making.contact_mm, 0.0);
    const double step = recording.time_s.empty() ? making.step_s : time - recording.time_s.back();
    overstress = (overstress + contact - before) * std::exp(-step / 2.0);
    before = contact;
    const double force = std::max(0.1 * contact + 0.1 * overstress, 0.0);
    recording.time_s.push_back(time);
    recording.drive.push_back(1e-3 * (depth + making.drive_noise_mm * normal(random)));
    recording.response.push_back(force + making.offset_N + making.force_noise_N * normal(random));
    const bool wide = making.uneven && recording.time_s.size() % 3 == 0;
    time += wide ? 2.5 * making.step_s : making.step_s;
  }
  return recording;
}

std::string kinds(const RecordingPhases& found) {
  std::string text;
  for (const Phase& phase : found.phases) {
    text += (text.empty() ? "" : ", ") + std::string(phase_name(phase.kind));
  }
  return text;
}

std::string all_words(const RecordingPhases& found) {
  std::string text;
  for (const std::string& sentence : found.summary) text += sentence + "\n";
  return text;
}

/// Phases cover all samples, in order, sharing their ends.
void check_cover(const Recording& recording, const RecordingPhases& found) {
  REQUIRE(!found.phases.empty());
  CHECK(found.phases.front().first == 0);
  CHECK(found.phases.back().last == recording.response.size() - 1);
  for (std::size_t i = 0; i < found.phases.size(); ++i) {
    CHECK(found.phases[i].first < found.phases[i].last);
    if (i > 0) CHECK(found.phases[i].first == found.phases[i - 1].last);
  }
}

RecordingPhases phases_of(const Recording& recording, const PhaseOptions& options = {}) {
  RecordingPhases found = find_phases(recording, options);
  INFO(all_words(found));
  check_cover(recording, found);
  return found;
}

const DrivePath kRampHold = {{0, 0}, {1, 0}, {3, 4}, {13, 4}};

}  // namespace

TEST_CASE("a ramp and a hold with a late contact, with and without noise") {
  for (const double noise : {0.0, 1e-3}) {
    for (const double jitter_mm : {0.0, 2e-3}) {
      CAPTURE(noise, jitter_mm);
      Making making;
      making.step_s = 0.02;
      making.force_noise_N = noise;
      making.drive_noise_mm = jitter_mm;
      making.contact_mm = 1.0;
      making.offset_N = 0.02;
      const auto found = phases_of(made(kRampHold, making));
      CHECK(kinds(found) == "before contact, loading, hold");
      CHECK(found.contact_found);
      CHECK_FALSE(found.preloaded);
      CHECK_THAT(found.contact_drive, WithinAbs(1e-3, test::allowed_error("phases.contact")));
      CHECK_THAT(found.floor_response, WithinAbs(0.02, test::allowed_error("phases.floor")));
      CHECK_THAT(found.phases[1].typical_rate,
                 WithinRel(2e-3, test::allowed_error("phases.typical_rate")));
      CHECK_THAT(found.phases[1].mean_rate,
                 WithinRel(2e-3, test::allowed_error("phases.mean_rate")));
      CHECK(static_cast<int>(found.phases[2].first) == Approx(150).margin(2));
      CHECK_THAT(found.noise_sd_estimate, WithinAbs(noise, 0.15 * noise + 1e-5));
    }
  }
}

TEST_CASE("a preload is told from an offset by what the first movement does") {
  Making making;
  making.step_s = 0.02;
  making.force_noise_N = 5e-4;
  making.offset_N = 0.02;
  const auto found = phases_of(made(kRampHold, making));
  CHECK(found.preloaded);
  CHECK(kinds(found) == "hold, loading, hold");
  CHECK_THAT(found.contact_drive, WithinAbs(0.0, 1e-5));
  CHECK_THAT(all_words(found), Catch::Contains("preloaded: 0.0"));
}

TEST_CASE("a rest in the air that ends at contact is told from a preload by the withdrawal") {
  const DrivePath withdrawn = {{0, 0}, {1, 0}, {3, 4}, {13, 4}, {16, -2}, {20, -2}};
  Making air;
  air.step_s = 0.02;
  air.force_noise_N = 5e-4;
  air.offset_N = 0.02;
  const auto rested = phases_of(made(withdrawn, air));
  CHECK_FALSE(rested.preloaded);
  CHECK(rested.contact_found);
  CHECK_THAT(rested.contact_drive, WithinAbs(0.0, 1e-4));
  CHECK(rested.phases.front().kind == PhaseKind::before_contact);
  // The same force at rest from tissue: clear of it the force is gone.
  Making preload = air;
  preload.offset_N = 0.0;
  preload.contact_mm = -0.2;
  CHECK(phases_of(made(withdrawn, preload)).preloaded);
  // No withdrawal, or none further than the rest: not told.
  CHECK(phases_of(made(kRampHold, air)).preloaded);
  CHECK(phases_of(made({{0, 0}, {1, 0}, {3, 4}, {13, 4}, {15, 0}, {20, 0}}, air)).preloaded);
}

TEST_CASE("a contact force that is told goes before the noise") {
  Making making;
  making.step_s = 0.02;
  PhaseOptions options;
  options.contact_response = 0.1;
  const auto found = phases_of(made(kRampHold, making), options);
  CHECK(found.contact_drive > 0.4e-3);
  CHECK(found.contact_drive < 1e-3);
  options.contact_response = 10.0;
  const auto none = phases_of(made(kRampHold, making), options);
  CHECK_FALSE(none.contact_found);
  CHECK_THAT(all_words(none), Catch::Contains("the response never stays at 10 N: no contact"));
}

TEST_CASE("ramps of 1 s and of 100 s, sampled unevenly") {
  for (const double ramp_s : {1.0, 100.0}) {
    CAPTURE(ramp_s);
    Making making;
    making.step_s = ramp_s / 100.0;
    making.uneven = true;
    making.force_noise_N = 1e-3;
    making.drive_noise_mm = 1e-3;
    DrivePath path = {{0, 0}, {0.1 * ramp_s, 0}, {1.1 * ramp_s, 5}, {3 * ramp_s, 5}};
    const Recording recording = made(path, making);
    const auto found = phases_of(recording);
    CHECK(kinds(found).ends_with("loading, hold"));
    const Phase& loading = found.phases[found.phases.size() - 2];
    CHECK_THAT(loading.mean_rate,
               WithinRel(5e-3 / ramp_s, test::allowed_error("phases.uneven_rate")));
    CHECK_THAT(recording.time_s[loading.last], WithinAbs(1.1 * ramp_s, 0.05 * ramp_s));
    CHECK_THAT(found.noise_sd_estimate,
               WithinRel(1e-3, test::allowed_error("phases.uneven_noise")));
  }
}

TEST_CASE("several ramps and holds, no hold, and a triangle") {
  Making making;
  making.step_s = 0.02;
  making.force_noise_N = 1e-3;
  const auto steps =
      phases_of(made({{0, 0}, {1, 1}, {4, 1}, {5, 2}, {8, 2}, {9, 3}, {12, 3}}, making));
  CHECK_THAT(kinds(steps), Catch::EndsWith("loading, hold, loading, hold, loading, hold"));
  const auto ramp = phases_of(made({{0, 0}, {5, 5}}, making));
  CHECK_THAT(kinds(ramp), Catch::EndsWith("loading"));
  CHECK_THAT(all_words(ramp), Catch::Contains("nothing is held"));
  Recording pulled = made({{0, 1}, {1, 2}, {2, 1}, {3, 2}, {4, 1}}, making);
  pulled.drive_quantity = Quantity::relative_length;
  pulled.response_quantity = Quantity::stress;
  CHECK(kinds(phases_of(pulled)) == "loading, unloading, loading, unloading");
}

TEST_CASE("a measured depth that wobbles and overshoots is no unloading") {
  // A ramp of 4 mm with a slow wobble of 2 % and an overshoot of 3 %, then a hold: neither is an
  // unloading; a fall of a quarter is one.
  const auto drive_of = [](double t) {
    if (t < 4.0) return 1.0 * t + 0.08 * std::sin(9.0 * t) * std::min(1.0, 4.0 - t);
    return 4.0 + 0.12 * std::exp(-(t - 4.0) / 0.1) - 0.0 * t;
  };
  Recording recording = made({{0, 0}, {10, 4}}, {});
  recording.time_s.clear();
  recording.drive.clear();
  recording.response.clear();
  for (int i = 0; i <= 400; ++i) {
    const double t = 0.03 * i;
    recording.time_s.push_back(t);
    recording.drive.push_back(1e-3 * drive_of(t));
    recording.response.push_back(0.1 * drive_of(t));
  }
  const RecordingPhases found = find_phases(recording);
  INFO(kinds(found) << "\n" << all_words(found));
  for (const Phase& phase : found.phases) CHECK(phase.kind != PhaseKind::unloading);
  CHECK(found.phases.back().kind == PhaseKind::hold);
  const RecordingPhases partly = find_phases(made({{0, 0}, {4, 4}, {8, 4}, {9, 3}, {13, 3}}, {}));
  CHECK(kinds(partly).find("unloading") != std::string::npos);
}

TEST_CASE("unloading leaves the force at its floor before the drive is back") {
  Making making;
  making.step_s = 0.02;
  making.force_noise_N = 1e-3;
  // After a hold, the overstress turns negative on the way back: the tissue lags behind.
  const DrivePath path = {{0, 0}, {1, 0}, {5, 4}, {15, 4}, {17, 0}, {20, 0}};
  const Recording recording = made(path, making);
  const auto found = phases_of(recording);
  CHECK_THAT(kinds(found), Catch::EndsWith("loading, hold, unloading, detached, recovery") ||
                               Catch::EndsWith("loading, hold, unloading, detached"));
  REQUIRE(found.detachment_index);
  CHECK(recording.drive[*found.detachment_index] > 0.5e-3);
  CHECK(recording.drive[*found.detachment_index] < 2.5e-3);
  CHECK_THAT(all_words(found), Catch::Contains("detached at"));
}

TEST_CASE("cycles with detachment in each of them") {
  Making making;
  making.step_s = 0.02;
  making.force_noise_N = 1e-3;
  const DrivePath path = {{0, 0},  {1, 0},  {3, 4},  {9, 4}, {11, 0},
                          {13, 0}, {15, 4}, {21, 4}, {23, 0}};
  const auto found = phases_of(made(path, making));
  CHECK_THAT(kinds(found), Catch::EndsWith("loading, hold, unloading, detached, loading, hold, "
                                           "unloading, detached"));
}

TEST_CASE("a force that is held while the depth grows is creep") {
  Recording recording;
  recording.header.id = "creep";
  for (int i = 0; i <= 300; ++i) {
    const double t = 0.1 * i;
    recording.time_s.push_back(t);
    recording.response.push_back(std::min(t, 1.0) * 0.2);
    recording.drive.push_back(t < 1.0 ? 2e-3 * t : 2e-3 + 1e-3 * std::log(t));
  }
  const auto found = phases_of(recording);
  CHECK_THAT(kinds(found), Catch::EndsWith("loading, creep"));
  CHECK_THAT(recording.time_s[found.phases.back().first], WithinAbs(1.0, 0.2));
}

TEST_CASE("recordings in which little happens get an explained answer") {
  Recording recording;
  recording.header.id = "r";
  recording.time_s = {0, 1, 2};
  recording.drive = {0, 1e-3, 1e-3};
  recording.response = {0, 1, 0.5};
  const auto three = phases_of(recording);
  CHECK(kinds(three) == "loading, hold");
  CHECK_THAT(all_words(three), Catch::Contains("no noise can be told"));

  Making making;
  making.force_noise_N = 1e-3;
  making.contact_mm = 10.0;
  const auto air = phases_of(made(kRampHold, making));
  CHECK_FALSE(air.contact_found);
  CHECK(kinds(air) == "before contact");
  CHECK_THAT(all_words(air), Catch::Contains("never rises out of its noise"));

  making.drive_noise_mm = 0.01;
  const auto still = phases_of(made({{0, 1}, {20, 1}}, making));
  CHECK(kinds(still) == "hold");
  CHECK_THAT(all_words(still), Catch::Contains("the drive never moves"));
  recording.time_s.clear();
  recording.drive.clear();
  recording.response.assign(50, 0.3);
  for (int i = 0; i < 50; ++i) {
    recording.time_s.push_back(i);
    recording.drive.push_back(2e-3);
  }
  CHECK(kinds(phases_of(recording)) == "hold");
  for (std::size_t i = 0; i < 50; ++i) recording.drive[i] = 1e-4 * static_cast<double>(i);
  CHECK_THAT(all_words(phases_of(recording)), Catch::Contains("no contact"));

  Recording upside_down = made(kRampHold, Making{});
  for (double& force : upside_down.response) force = -force;
  CHECK_THAT(all_words(phases_of(upside_down)), Catch::Contains("--negate-response"));
  for (double& depth : upside_down.drive) depth = -depth;
  CHECK_THAT(all_words(phases_of(upside_down)), Catch::Contains("--negate-drive"));
}

TEST_CASE("a force that is held in noise is creep") {
  const std::uint64_t seed = GENERATE(1, 2, 3, 4, 5);
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  base::Random random(seed);
  for (int i = 0; i < 300; ++i) {
    const double t = 0.1 * i, load_s = std::clamp(t - 1.0, 0.0, 1.0);
    r.time_s.push_back(t);
    r.drive.push_back(2e-3 * load_s + 1e-3 * std::log(std::max(t - 1.0, 1.0)));
    r.response.push_back(0.2 * load_s + 0.01 * random.normal());
  }
  INFO(seed);
  CHECK_THAT(kinds(phases_of(r)), Catch::Contains("creep"));
}

TEST_CASE("a ramp that noise hides is no creep") {
  const std::uint64_t seed = GENERATE(4, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12);
  const double step_s = seed == 4 ? 0.05 : 0.08;  // few samples on the ramp
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  base::Random random(seed);
  for (int i = 0; i < 480; ++i) {
    const double t = step_s * i, depth = std::clamp(2e-3 * (t - 3.0), 0.0, 4e-3);
    r.time_s.push_back(t);
    r.drive.push_back(depth);
    // Noise of a fifth of the peak: near the end of the ramp the readings overlap.
    r.response.push_back(90.0 * depth + 0.08 * random.normal());
  }
  const RecordingPhases phases = find_phases(r);
  INFO(seed);
  for (const Phase& phase : phases.phases) CHECK(phase.kind != PhaseKind::creep);
}

TEST_CASE("what cannot be cut into phases is refused") {
  Recording recording = made(kRampHold, Making{});
  Recording none = recording;
  none.time_s.clear();
  CHECK_THROWS_WITH(find_phases(none),
                    "made: the recording has no times; expected a time column (--time COLUMN)");
  none = recording;
  none.drive.clear();
  CHECK_THROWS_WITH(find_phases(none), Catch::Contains("does not say what was imposed"));
  none.response_quantity = Quantity::relaxation_modulus;
  CHECK_THROWS_WITH(find_phases(none), Catch::Contains("holds a relaxation modulus, without what "
                                                       "was imposed"));
  recording.response[5] = std::nan("");
  CHECK_THROWS_WITH(find_phases(recording),
                    Catch::Contains("the response holds a value that is not"));
  recording.time_s.resize(2);
  recording.drive.resize(2);
  recording.response.resize(2);
  CHECK_THROWS_WITH(find_phases(recording), Catch::Contains("at least 3 samples"));
}

TEST_CASE("any recording from one path: described, exported or digitised") {
  const TempFolder folder;
  const auto fixture = [](const char* name) {
    return std::string(TPM_TEST_SOURCE_DIR) + "/tests/fixtures/" + name;
  };
  write_file(folder / "short.csv", "time_s,depth_mm,force_N\n0,0,0\n0.5,1,0.25\n");
  write_file(folder / "words.csv", "Time (s),Displacement (mm),Load (N)\n0,0,0\n0.5,1,0.25\n");
  for (const char* name : {"short.csv", "words.csv"}) {
    INFO(name);
    const RecordingFile read = read_recording_file(folder / name);
    CHECK(read.recording.time_s == std::vector<double>{0, 0.5});
    CHECK(read.recording.depth_m() == std::vector<double>{0, 1e-3});
    CHECK(read.recording.force_N() == std::vector<double>{0, 0.25});
    CHECK(read.recording.header.sha256 == sha256_hex(read_file(folder / name)));
    CHECK(read.recording.header.id == std::filesystem::path(name).stem().string());
    CHECK_FALSE(read.findings.empty());
  }
  const RecordingFile french = read_recording_file(fixture("machine_french.csv"));
  CHECK(french.recording.header.title == "SYN-01");
  CHECK(french.recording.provenance == Provenance::measured);

  ImportOptions options;
  CHECK_THROWS_WITH(read_recording_file(fixture("strip_no_units.csv"), options),
                    Catch::Contains("--unit \"Time=UNIT\" with a unit of time"));
  options.drive_column = "L";
  options.drive_quantity = Quantity::relative_length;
  options.units = {{"Time", "s"}, {"F", "kPa"}, {"SD", "kPa"}};
  const Recording strip = read_recording_file(fixture("strip_no_units.csv"), options).recording;
  CHECK(strip.drive_quantity == Quantity::relative_length);
  CHECK(strip.response == std::vector<double>{-200, 1500, 1250});
  CHECK(strip.response_sd == std::vector<double>{100, 200, 300});

  ImportOptions figure;
  figure.x = parse_axis("time:s", "--x-quantity");
  figure.y = parse_axis("stress:kPa", "--y-quantity");
  CHECK_THROWS_WITH(read_recording_file(fixture("wpd_project_v4.json"), figure),
                    Catch::Contains("holds 2 curves; expected --dataset with one of"));
  figure.dataset = "pixels only";
  CHECK(read_recording_file(fixture("wpd_project_v4.json"), figure).recording.provenance ==
        Provenance::digitized);
  figure.depth_m = 4e-3;
  CHECK_THROWS_WITH(read_recording_file(fixture("wpd_project_v4.json"), figure),
                    Catch::Contains("readings, not a recording"));
}

TEST_CASE("a description beside a recording says everything") {
  const TempFolder folder;
  write_file(folder / "c.csv", "time_s,depth_mm,force_N\n0,0,0\n0.5,1,0.25\n");
  write_file(folder / "c.json", R"({"id": "c", "title": "t", "kind": "recording",
    "observable": "contact_force", "provenance": "derived",
    "columns": {"time_s": {"quantity": "time", "unit": "s"},
                "depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
                "force_N": {"quantity": "contact_force", "unit": "N"}}})");
  for (const char* name : {"c.csv", "c.json"}) {
    const RecordingFile read = read_recording_file(folder / name);
    CHECK(read.recording.provenance == Provenance::derived);
    CHECK(read.recording.depth_m() == std::vector<double>{0, 1e-3});
  }
  ImportOptions options;
  options.negate_drive = true;
  CHECK_THROWS_WITH(read_recording_file(folder / "c.csv", options),
                    Catch::Contains("has a description beside it"));
  CHECK_THROWS_WITH(read_recording_file("evren_static"),
                    Catch::Contains("is a curve of kind points"));
}

TEST_CASE("a number that is none is named with line and column however it is read") {
  const TempFolder folder;
  write_file(folder / "f.csv", "Time (s),Depth (mm),Force (N)\n0,0,0\n1,1,x\n");
  CHECK_THROWS_WITH(read_recording_file(folder / "f.csv"),
                    Catch::Contains("f.csv:3: column 3 'Force': 'x' is not a finite number"));
}

TEST_CASE("Even rows under a coarse clock get their times back, others become their mean") {
  const TempFolder folder;
  // 7 ms a row, a clock of 0.1 s that truncates; contact at 1.0 s.
  const auto written = [&](const std::string& name, double pause_s) {
    std::string text = "Time (s),Force (N),Depth (mm)\n";
    for (int i = 0; i < 400; ++i) {
      const double t = 7e-3 * i + (i < 200 ? 0.0 : pause_s);
      const double depth = std::max(t - 1.0, 0.0);
      text +=
          fmt::format("{:.1f},{:.6f},{:.6f}\n", std::floor(10.0 * t) / 10.0, 2.0 * depth, depth);
    }
    write_file(folder / name, text);
    return read_recording_file(folder / name, {});
  };
  const RecordingFile even = written("even.csv", 0.0);
  REQUIRE(even.recording.time_s.size() == 400);
  for (std::size_t i = 0; i < 400; ++i) {
    CHECK_THAT(even.recording.time_s[i], WithinAbs(7e-3 * static_cast<double>(i), 4e-3));
  }
  CHECK_THAT(columns_words(even.findings), Catch::Contains("the clock counts in steps of 0.1 s") &&
                                               Catch::Contains("rows at even times"));
  const RecordingFile paused = written("paused.csv", 3.0);
  CHECK(paused.recording.time_s.size() < 60);
  CHECK_THAT(columns_words(paused.findings), Catch::Contains("rows of one time became one"));
}
