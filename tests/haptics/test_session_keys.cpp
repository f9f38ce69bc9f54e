// Files of sessions and devices: their schemas say what their readers say.
#include <catch2/catch.hpp>

#include "odd_documents.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpm/haptics/session/session_keys.hpp"

using namespace tpm;
using namespace tpm::haptics;

namespace {

Json of_source(const std::string& file) {
  return read_json(std::string(TPM_TEST_SOURCE_DIR "/") + file);
}

}  // namespace

TEST_CASE("schema and reader of a session agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      session_kind(),
      {of_source("configs/hil_liver.json"), of_source("configs/hil_law.json"),
       of_source("configs/hil_planned.json"), of_source("configs/hil_surface.json"),
       of_source("configs/hil_fine.json"), of_source("configs/hil_omega7.json"),
       of_source("configs/hil_inverse3.json"), of_source("configs/hil_inverse3_free.json"),
       of_source("configs/hil_inverse3_held.json"), example_of(session_kind())},
      test::kOddDocuments);
}

TEST_CASE("schema and reader of a device file agree on odd ones", "[keys]") {
  test::compare_schema_and_form(
      device_kind(),
      {of_source("configs/devices/delta3.json"), of_source("configs/devices/inverse3.json"),
       example_of(device_kind())},
      test::kOddDocuments);
}
