#pragma once
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
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

  [[nodiscard]] bool happened(const std::string& event) const {
    std::ifstream events(folder_ / "events");
    std::string name;
    long long time = 0;
    while (events >> name >> time) {
      if (name == event) return true;
    }
    return false;
  }
  [[nodiscard]] std::string file(const char* name) const { return folder_ / name; }

 private:
  TempFolder folder_;
};

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
