// The fuzzer of every kind of input (libFuzzer). TPM_FUZZ names the kind; files are written to the
// folder TPM_FUZZ_FOLDER, best one in memory. scripts/fuzz.sh runs them all.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>

#include "fuzz/inputs.hpp"

namespace {

const tpm::fuzz::Input* chosen = nullptr;
std::filesystem::path folder;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  const char* name = std::getenv("TPM_FUZZ");
  const char* place = std::getenv("TPM_FUZZ_FOLDER");
  try {
    chosen = &tpm::fuzz::input_named(name == nullptr ? "" : name);
    folder = place == nullptr ? std::filesystem::temp_directory_path() : place;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fuzz_inputs: %s\n", error.what());
    std::exit(2);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  (void)tpm::fuzz::reads(*chosen, folder, text);
  return 0;
}
