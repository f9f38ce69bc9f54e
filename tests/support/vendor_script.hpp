#pragma once
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"

namespace tpm::test {

/// A script for the stand-in library, for as long as this lives.
class VendorScript {
 public:
  explicit VendorScript(const std::string& lines) {
    files::write_file(folder_ / "script", lines + "events " + (folder_ / "events") + "\n");
    (void)setenv("TPM_STAND_IN_SCRIPT", (folder_ / "script").c_str(), 1);
  }
  ~VendorScript() { (void)unsetenv("TPM_STAND_IN_SCRIPT"); }
  VendorScript(const VendorScript&) = delete;
  VendorScript& operator=(const VendorScript&) = delete;

  /// When it happened first, of the library's clock; -1 if it did not.
  [[nodiscard]] long long event_ns(const std::string& event) const {
    std::ifstream events(folder_ / "events");
    std::string name;
    long long time = 0;
    while (events >> name >> time) {
      if (name == event) return time;
    }
    return -1;
  }
  [[nodiscard]] bool happened(const std::string& event) const { return event_ns(event) != -1; }
  [[nodiscard]] std::string file(const char* name) const { return folder_ / name; }

 private:
  TempFolder folder_;
};

/// The stand-in library as a device.
/// @param file of the device; empty: none
inline haptics::DeviceChoice stand_in_choice(const std::string& file = TPM_TEST_SOURCE_DIR
                                             "/tests/fixtures/stand_in_device.json") {
  haptics::DeviceChoice device;
  device.kind = "omega7";
  device.library = TPM_STAND_IN_DHD;
  device.file = file;
  return device;
}

/// Message of the Error(environment) that the action throws.
inline std::string vendor_message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    CHECK(error.code() == ExitCode::environment);
    return error.what();
  }
  FAIL("nothing was refused");
  return {};
}

}  // namespace tpm::test
