// --device inverse3: the force that a service reports beside the one that was commanded.
#include <fmt/format.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <thread>

#include "inverse_sessions.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/inverse/force_comparison.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/show/hil_report.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using namespace test::inverse_sessions;
using test::StandInFaults;
using test::StandInInverse;
using How = StandInFaults::How;

constexpr std::int64_t kPeriod_ns = 1'000'000;

Eigen::Vector3d along_z(double newtons) {
  return {0.0, 0.0, newtons};
}

std::string lines_of(const ForceComparison& forces) {
  std::string lines;
  for (const DeviceFinding& finding : forces.findings()) lines += finding.text + "\n";
  return lines;
}

/// What is found if `share` of a sine of 1 N and 1 Hz is reported, late by some milliseconds.
std::string found_of(double share, int late_ms, int lasts_ms = 2000) {
  ForceComparison forces;
  forces.begin(0);
  const auto commanded = [](int ms) { return along_z(std::sin(2e-3 * M_PI * ms)); };
  for (int ms = 1; ms <= lasts_ms; ++ms) {
    forces.command(commanded(ms), ms * kPeriod_ns);
    forces.report(share * commanded(std::max(0, ms - late_ms)), ms * kPeriod_ns);
  }
  return lines_of(forces);
}

TEST_CASE("A reported force may be late and differ a little, and not be scaled or gated") {
  CHECK(found_of(1.0, 0).empty());
  CHECK(found_of(1.0, 5).empty());
  CHECK(found_of(1.0, 49).empty());
  CHECK(found_of(1.04, 0).empty());
  CHECK_THAT(found_of(2.0, 0), Contains("the service reported ") && Contains(" was commanded"));
  // A force that stays: half of it, and none at all.
  for (const double share : {0.5, 0.0}) {
    CAPTURE(share);
    ForceComparison forces;
    forces.begin(0);
    for (int ms = 1; ms <= 1000; ++ms) {
      forces.command(along_z(1.0), ms * kPeriod_ns);
      forces.report(along_z(share), ms * kPeriod_ns);
    }
    CHECK_THAT(lines_of(forces),
               Contains(share > 0.0 ? "reported 0.5 N where 1 N" : "reported 0 N where 1 N"));
  }
}

TEST_CASE("A difference of forces counts once it has lasted, and agreement ends it") {
  ForceComparison forces;
  forces.begin(0);
  std::int64_t at_ns = 0;
  const auto live = [&](double reported_N, int lasts_ms) {
    for (int i = 0; i < lasts_ms; ++i) {
      at_ns += kPeriod_ns;
      forces.command(along_z(1.0), at_ns);
      forces.report(along_z(reported_N), at_ns);
    }
  };
  live(1.0, 200);
  live(0.5, 190);
  live(1.0, 10);
  live(0.5, 190);
  CHECK(lines_of(forces).empty());
  live(1.0, 10);
  live(0.5, 401);
  CHECK_THAT(lines_of(forces), Contains("for 0.4 s in all"));
  live(1.0, 1000);
  CHECK_THAT(lines_of(forces), Contains("for 0.4 s in all"));
  forces.begin(at_ns);
  CHECK(lines_of(forces).empty());
  forces.no_report();
  CHECK_THAT(lines_of(forces), Contains("the service reported no force"));
}

TEST_CASE("A force that is reported where none was commanded is somebody else's") {
  ForceComparison forces;
  forces.begin(0);
  std::int64_t at_ns = 0;
  const auto live = [&](double commanded_N, double reported_N, int lasts_ms) {
    for (int i = 0; i < lasts_ms; ++i) {
      at_ns += kPeriod_ns;
      forces.command(along_z(commanded_N), at_ns);
      forces.report(along_z(reported_N), at_ns);
    }
  };
  live(0.0, 0.0, 1000);
  CHECK(forces.findings().empty());
  live(0.0, 0.7, 501);
  REQUIRE(forces.findings().size() == 1);
  CHECK_THAT(lines_of(forces), Contains("up to 0.7 N where nothing was commanded, for 0.5 s") &&
                                   Contains("another client pushes (end it)"));
  live(1.0, 1.0, 300);
  CHECK(forces.findings().size() == 1);
  // And where a force is commanded: another client may have the seat of the driver.
  live(1.0, 0.2, 500);
  REQUIRE(forces.findings().size() == 2);
  CHECK(forces.findings().front().code == "force_without_command");
  CHECK(forces.findings().back().code == "force_differs");
  CHECK_THAT(forces.findings().back().text, Contains("reported 0.2 N where 1 N was commanded") &&
                                                Contains("another client may drive the device"));
}

TEST_CASE("Forces that are compared are read by another thread as a whole") {
  ForceComparison forces;
  std::atomic<bool> ending{false};
  const std::string one = "the service reported 2 N where 1 N was commanded, apart by up to 1 N, ";
  const std::string two = "the service reported 5 N where 2 N was commanded, apart by up to 3 N, ";
  int torn = 0;
  std::thread reader([&] {
    while (!ending) {
      for (const DeviceFinding& finding : forces.findings()) {
        const bool whole = finding.text.starts_with(one) || finding.text.starts_with(two);
        torn += whole && finding.text.find("for 0.3 s in all") != std::string::npos ? 0 : 1;
      }
    }
  });
  constexpr std::int64_t kLasted_ns = 300'000'000;
  for (int i = 0; i < 20'000; ++i) {
    const bool first = i % 2 == 0;
    forces.begin(0);
    forces.command(along_z(first ? 1.0 : 2.0), 0);
    forces.report(along_z(first ? 2.0 : 5.0), 0);
    forces.report(along_z(first ? 2.0 : 5.0), kLasted_ns);
  }
  ending = true;
  reader.join();
  CHECK(torn == 0);
  CHECK_THAT(lines_of(forces), Contains(two));
}

/// 500 periods of 1 N on such a service.
std::vector<DeviceFinding> findings_on(const StandInFaults& faults) {
  StandInInverse service(PlantSettings{}, {}, false, faults);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  device.prepare({});
  device.enable_forces();
  Eigen::Vector3d at_m;
  for (int i = 0; i < 500; ++i) {
    CHECK(device.read(at_m) == DeviceAnswer::ok);
    CHECK(device.write(along_z(1.0)) == DeviceAnswer::ok);
  }
  CHECK(device.status().forces_off == ForcesOff::none);  // nothing was ended
  device.stop();
  return device.findings();
}

TEST_CASE("A service that gates forces during a session is noticed if it reports what it renders") {
  StandInFaults faults;
  CHECK(findings_on(faults).empty());
  faults.from = 100;
  faults.how = How::gate;
  for (const double rendered : {0.5, 0.0, 1.5}) {
    CAPTURE(rendered);
    faults.rendered = rendered;
    const std::vector<DeviceFinding> found = findings_on(faults);
    REQUIRE(found.size() == 1);
    CHECK_THAT(found.front().text,
               Contains(fmt::format("reported {:.3g} N where 1 N was commanded", rendered)));
  }
  // One that reports the command is not noticed: this comparison cannot replace a look at filters.
  faults.rendered = 0.5;
  faults.how = How::gate_unseen;
  CHECK(findings_on(faults).empty());
  faults.how = How::no_report;
  const std::vector<DeviceFinding> silent = findings_on(faults);
  REQUIRE(silent.size() == 1);
  CHECK(silent.front().code == "force_not_reported");
  CHECK_THAT(silent.front().text, Contains("the service reported no force"));
}

TEST_CASE("What was noticed of forces is recorded and said, and the session goes on") {
  const test::TempFolder folder;
  Json json = inverse_session();
  json.erase("creep");  // who keeps a force would push a device that gates too deep
  const HilSession session = test::parsed(json);
  StandInFaults faults;
  faults.from = 1;
  faults.how = How::gate;
  StandInInverse service(plant_of(session, 0), session.operator_script(), false, faults);
  const auto device =
      std::make_shared<InverseDevice>(choice_of(service).inverse, limits_of("inverse3"));
  DeviceLimits limits = limits_of("inverse3");
  limits.simulated = true;  // its delay is not what is tried here
  SessionRunOptions options;
  options.recording = folder / "gated.tpmrec";
  bool begun = false;
  options.watcher = [&](const ServoRecord& row) {
    if (row.phase >= 0 && !begun) service.begin();
    begun = begun || row.phase >= 0;
  };
  std::vector<DeviceFinding> told;
  options.noticed = [&told](const DeviceFinding& finding) { told.push_back(finding); };
  const SessionRun run = run_session_on(session, device, limits, {}, options);
  CHECK(told == run.findings);
  CAPTURE(to_string(run.outcome.cause), run.outcome.detail, run.largest_force_N);
  CHECK(run.outcome.cause == StopCause::finished);
  REQUIRE(run.findings.size() == 1);
  CHECK(run.findings.front().code == "force_differs");
  CHECK_THAT(run.findings.front().text,
             Contains("the service reported ") && Contains(" N was commanded"));
  CHECK_THAT(run_text(session, run), Contains("the device noticed: the service reported "));
  const Json listed = run_json(session, run).at("outcome").at("device_findings");
  CHECK(listed == Json::array({{{"code", "force_differs"}, {"text", run.findings.front().text}}}));
  const HilRecording recording = read_recording(options.recording);
  CHECK(recording.closing.at("device_findings") == listed);
}

}  // namespace
}  // namespace tpm::haptics
