// The fuzzer of every kind of input (libFuzzer). TPM_FUZZ names the kind; files are written to the
// folder TPM_FUZZ_FOLDER, best one in memory. scripts/fuzz.sh runs them all.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>

#include "fuzz/inputs.hpp"
#include "fuzz/json_mutator.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* bytes, std::size_t size, std::size_t most);

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

/// JSON is changed as JSON three times of four, so that what comes is read past its first bracket.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* bytes, std::size_t size,
                                               std::size_t most, unsigned int seed) {
  if (chosen->ending == ".json" && seed % 4 != 0) {
    const std::string changed =
        tpm::fuzz::mutated_json({reinterpret_cast<const char*>(bytes), size}, seed / 4);
    if (!changed.empty() && changed.size() <= most) {
      std::copy(changed.begin(), changed.end(), bytes);
      return changed.size();
    }
  }
  return LLVMFuzzerMutate(bytes, size, most);
}
