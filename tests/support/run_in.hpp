#pragma once
#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"

namespace tpm::test {

/// Outcome of the program: its exit code, -1 after a signal, and both streams.
struct ProgramRun {
  int code;
  std::string said;
};

/// The program on a folder, from within it.
/// @param before  a command whose output goes into the program, such as "cat FILE |"
inline ProgramRun run_in(const TempFolder& folder, const std::string& arguments,
                         const std::string& before = "") {
  const std::string out = folder / "said.log";
  const int status = std::system(fmt::format("cd '{}' && {} '" TPM_TEST_PROGRAM "' {} > '{}' 2>&1",
                                             folder.path().string(), before, arguments, out)
                                     .c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          std::filesystem::is_empty(out) ? std::string() : files::read_file(out)};
}

}  // namespace tpm::test
