// Which of the devices of the vendor's library is taken, and how they are listed.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <optional>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "vendor_script.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("No device, and a device of another type, are told") {
  {
    const test::VendorScript none("devices 0\n");
    CHECK_THAT(test::vendor_message_of([] { (void)ForceDimension(TPM_STAND_IN_DHD).open(); }),
               Contains("no device found"));
  }
  const test::VendorScript other("type 33\n");
  CHECK_THAT(test::vendor_message_of([] { (void)ForceDimension(TPM_STAND_IN_DHD).open(); }),
             Contains("of type 33"));
}

TEST_CASE("Of several devices one is chosen by its kind, its serial number or its index") {
  const test::VendorScript script("types 63 35 37 60\n");
  const auto opened = [](const char* kind, DeviceSelection which) {
    ForceDimension device(TPM_STAND_IN_DHD, kind, which);
    return device.open();
  };
  CHECK(opened("omega7", {.serial = 4713, .index = std::nullopt}).serial == "4713");
  CHECK(opened("omega7", {.serial = std::nullopt, .index = 1}).serial == "4712");
  CHECK(opened("falcon", {}).serial == "4714");
  const DeviceIdentity delta = opened("delta3", {});
  CHECK(delta.kind == "delta3");
  REQUIRE(delta.assumptions.size() == 7);  // and where each of six limits comes from
  CHECK(delta.assumptions.front().code == "never_tried");
  CHECK_THAT(delta.assumptions.front().text, Contains("never tried with delta.3"));
  CHECK(delta.assumptions[1].code == "limit_source");
  CHECK_THAT(delta.assumptions[1].text, Contains("force_N: assumed: that of the Omega.7"));
  CHECK_THAT(test::vendor_message_of([&] { (void)opened("omega7", {}); }),
             Contains("2 devices are 'omega.7'") && Contains("serial 4713") &&
                 Contains("--serial NUMBER"));
  CHECK_THAT(test::vendor_message_of([&] { (void)opened("sigma7", {}); }),
             Contains("0 devices are 'sigma.7'"));
  CHECK_THAT(test::vendor_message_of(
                 [&] { (void)opened("omega7", {.serial = 99, .index = std::nullopt}); }),
             Contains("0 devices are of serial 99"));
  CHECK_THAT(test::vendor_message_of(
                 [&] { (void)opened("omega7", {.serial = std::nullopt, .index = 4}); }),
             Contains("--index 0 to 3"));
  CHECK_THAT(test::vendor_message_of(
                 [&] { (void)opened("omega7", {.serial = std::nullopt, .index = 0}); }),
             Contains("type 63") && Contains("--device delta3"));
  const auto seen = seen_devices(TPM_STAND_IN_DHD);
  REQUIRE(seen.size() == 4);
  CHECK(seen[3].kind == "falcon");
  CHECK(seen[3].serial == 4714);
  CHECK_FALSE(seen[3].simulated);
}

TEST_CASE("The list of devices marks one behind a link on which a simulator may be") {
  const test::TempFolder folder;
  const auto listed = [&](const char* format) {
    const std::string line = "'" TPM_TEST_PROGRAM "' hil devices --dhd-library '" TPM_STAND_IN_DHD
                             "' --format " +
                             std::string(format) + " > '" + (folder / "listed") + "'";
    REQUIRE(std::system(line.c_str()) == 0);
    return read_file(folder / "listed");
  };
  const auto marked = [&] {
    const Json answer = Json::parse(listed("json"));
    return answer.at("force_dimension").at("devices")[0].at("simulated_device").get<bool>();
  };
  for (const char* mode : {"3", "4"}) {
    CAPTURE(mode);
    const test::VendorScript script(std::string("com_mode ") + mode + "\n");
    CHECK_THAT(listed("text"), Contains("omega.7, SIMULATED DEVICE, serial 4711: --device omega7"));
    CHECK(marked());
  }
  // A link that nobody knows may lead to motors.
  for (const char* mode : {"0", "1", "9"}) {
    CAPTURE(mode);
    const test::VendorScript script(std::string("com_mode ") + mode + "\n");
    CHECK_THAT(listed("text"), Contains("omega.7, serial 4711: --device omega7"));
    CHECK_FALSE(marked());
  }
}

}  // namespace
}  // namespace tpm::haptics
