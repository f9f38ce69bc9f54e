// --device inverse3 on a stand-in service: what acts on a force there is neutral, or refused.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>
#include <memory>

#include "inverse_sessions.hpp"
#include "temp_folder.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/haptics/session/recording.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using namespace test::inverse_sessions;
using test::StandInFaults;
using test::StandInInverse;

TEST_CASE("What no message sets is set over HTTP, read back and recorded") {
  for (const char* version : {"3.5.0.0", "3.1.0.0"}) {
    CAPTURE(version);
    StandInFaults f;
    f.version = version;
    StandInInverse service(PlantSettings{}, {}, false, f);
    InverseDevice device(service.address(), limits_of("inverse3"));
    const std::vector<std::string> lines = base::remark_texts(device.open().assumptions);
    CHECK(service.settings().carried() == 1.0);
    CHECK_THAT(fmt::format("{}", fmt::join(lines, "\n")),
               Contains("gravity compensation on, factor 1"));
    CHECK(service.posts().size() == 1);
    InverseAddress half = service.address();
    half.gravity_carried = 0.5;
    InverseDevice again(half, limits_of("inverse3"));
    CHECK_THAT(fmt::format("{}", fmt::join(base::remark_texts(again.open().assumptions), "\n")),
               Contains("gravity compensation on, factor 0.5"));
    InverseAddress none = service.address();
    none.gravity_carried = 0.0;
    InverseDevice last(none, limits_of("inverse3"));
    (void)last.open();
    CHECK(service.settings().carried() == 0.0);
    f.keeps = {"gravity_compensation"};
    CHECK_THAT(refusal(f), Contains("stays at carrying 0 of the device's weight; expected 1, or "
                                    "--inverse-gravity with what it keeps"));
  }
}

TEST_CASE("Each setting that changes a force is neutral over HTTP, recorded, or refused") {
  const test::TempFolder folder;
  const HilSession session = test::parsed(inverse_session());
  struct Case {
    const char* name;
    std::function<void(StandInFaults&)> begin;
    const char* recorded;  ///< in the header of the session
    const char* refused;   ///< when the service keeps what it has
  };
  for (const Case& c :
       {Case{"preset", [](StandInFaults& f) { f.preset = "defaults"; },
             "preset 'arm_front_centered', basis XYZ", "preset of the service stays at 'defaults'"},
        Case{"basis", [](StandInFaults& f) { f.basis = "YXZ"; },
             "preset 'arm_front_centered', basis XYZ", "exchanges axes: basis YXZ"},
        Case{"force_gate", [](StandInFaults& f) { f.gate = 0.3; }, "force gate 0",
             "force gate of the service stays at 0.3"},
        Case{"damping", [](StandInFaults& f) { f.damping = 0.5; }, "damping 0, by direction 0 0 0",
             "damping of the service stays at 0.5"},
        Case{"damping", [](StandInFaults& f) { f.damping_along_z = 0.2; },
             "damping 0, by direction 0 0 0", "stays at 0, by direction 0 0 0.2"},
        Case{"mount",
             [](StandInFaults& f) {
               f.preset = "";
               f.mount_turned_rad = 0.5;
             },
             "mount at 0 0 0 m, turned by 0 rad, scale 1 1 1", "turns coordinates: a mount by 0.5"},
        Case{"mount",
             [](StandInFaults& f) {
               f.preset = "";
               f.scale = 2.0;
             },
             "turned by 0 rad, scale 1 1 1", "scales coordinates"},
        Case{"gravity_compensation", [](StandInFaults& f) { f.gravity = 0.5; },
             "gravity compensation on, factor 1",
             "stays at carrying 0.5 of the device's weight"}}) {
    CAPTURE(c.name, c.refused);
    StandInFaults f;
    f.preset = kCentredPreset;
    f.gate = 0.0;
    f.gravity = 1.0;
    f.settings_by_http = true;  // what a message configures is not heard
    c.begin(f);
    StandInInverse service(plant_of(session, 0), session.operator_script(), false, f);
    SessionRunOptions options;
    options.recording = folder / "recorded.tpmrec";
    std::filesystem::remove(options.recording);
    options.interrupted = [] { return true; };  // the header is what counts here
    DeviceLimits limits = limits_of("inverse3");
    limits.simulated = true;  // its delay is not what is tried here
    const auto device =
        std::make_shared<InverseDevice>(choice_of(service).inverse, limits_of("inverse3"));
    (void)run_session_on(session, device, limits, {}, options);
    const bool of_device = std::string_view(c.name) == "gravity_compensation";
    CHECK(service.posts() ==
          std::vector<std::string>{
              fmt::format("/inverse3/049D/config/{}{}", c.name, of_device ? "" : "?session=%237")});
    const std::string header = read_recording(options.recording).header.at("device").dump();
    CHECK_THAT(header, Contains(c.recorded));
    f.keeps = {c.name};
    CHECK_THAT(refusal(f), Contains(c.refused));
  }
}

}  // namespace
}  // namespace tpm::haptics
