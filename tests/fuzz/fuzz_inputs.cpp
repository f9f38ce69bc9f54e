// The fuzzer of every kind of input (libFuzzer). TPM_FUZZ names the kind; files are written to the
// folder TPM_FUZZ_FOLDER, best one in memory. scripts/fuzz.sh runs them all.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/inputs.hpp"
#include "fuzz/json_mutator.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* bytes, std::size_t size, std::size_t most);
// NOLINTNEXTLINE(bugprone-reserved-identifier): the linker's names
extern "C" std::uint8_t __start___sancov_cntrs[], __stop___sancov_cntrs[];

namespace {

const tpm::fuzz::Input* chosen = nullptr;
std::filesystem::path folder;

/// HDF5 is read by child processes. The counters of covered edges are put into memory that a child
/// shares, so that what it covers counts. Pages that hold something else as well stay.
void share_counters_with_children() {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const std::uintptr_t begin =
      (reinterpret_cast<std::uintptr_t>(__start___sancov_cntrs) + page - 1) / page * page;
  const std::uintptr_t end = reinterpret_cast<std::uintptr_t>(__stop___sancov_cntrs) / page * page;
  if (begin >= end) return;
  auto* first = reinterpret_cast<std::uint8_t*>(begin);  // NOLINT(performance-no-int-to-ptr)
  const std::vector<std::uint8_t> counted(first, first + (end - begin));
  if (mmap(first, end - begin, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_FIXED, -1,
           0) == MAP_FAILED) {
    std::perror("fuzz_inputs: mmap");
    std::exit(2);
  }
  std::copy(counted.begin(), counted.end(), first);
}

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
  share_counters_with_children();
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
