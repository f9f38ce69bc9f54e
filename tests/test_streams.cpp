// Standard output and error that take nothing, and programs that lie where the user stands.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "temp_folder.hpp"
#include "tpm/core/error.hpp"
#include "tpm/report/draw.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/json.hpp"

namespace tpm {
namespace {

using Catch::Matchers::Contains;

/// Exit code of a shell line in which TPM stands for the program; 128 + signal if it was killed.
int exit_code_of(const std::string& line) {
  const std::string command = "TPM='" TPM_TEST_PROGRAM "'; " + line;
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST_CASE("Output that cannot be written is an error, never a success") {
  const test::TempFolder folder;
  const std::string said = folder / "said";
  for (const char* command : {"version", "--help", "tables --format json", "laws"}) {
    INFO(command);
    CHECK(exit_code_of("$TPM " + std::string(command) + " > /dev/full 2> '" + said + "'") == 5);
    const std::string text = read_file(said);
    CHECK_THAT(text, Contains("tpm: standard output"));
    CHECK(std::count(text.begin(), text.end(), '\n') == 1);
    CHECK(exit_code_of("$TPM " + std::string(command) + " >&- 2> /dev/null") == 5);
  }
}

TEST_CASE("Standard error that is closed or full changes no exit code") {
  for (const char* error : {"2>&-", "2> /dev/full"}) {
    INFO(error);
    CHECK(exit_code_of("$TPM version > /dev/null " + std::string(error)) == 0);
    CHECK(exit_code_of("$TPM no-such-command " + std::string(error)) == 2);
    CHECK(exit_code_of("$TPM fit no-such-file.csv " + std::string(error)) == 3);
  }
}

TEST_CASE("A message never lands in a file that took the place of a closed stream") {
  const test::TempFolder folder;
  const std::string file = folder / "tables.json";
  CHECK(exit_code_of("$TPM tables --format json > '" + file + "' 2>&- <&-") == 0);
  CHECK_NOTHROW(parse_json(read_file(file), file));
}

TEST_CASE("The search for a Python imports nothing from the current folder") {
  const test::TempFolder folder;
  for (const char* module : {"matplotlib.py", "numpy.py", "sitecustomize.py", "argparse.py"}) {
    write_file(folder / module, "open('" + (folder / "was_run") + "', 'w')\n");
  }
  const auto before = std::filesystem::current_path();
  const char* path = std::getenv("PYTHONPATH");
  const std::string kept = path == nullptr ? "" : path;
  std::filesystem::current_path(std::filesystem::path(folder / "."));
  for (const char* harmful : {"", ":", ".", "x:."}) {
    (void)setenv("PYTHONPATH", harmful, 1);
    CHECK_NOTHROW(find_drawing_python());
  }
  std::filesystem::current_path(before);
  if (path == nullptr) {
    (void)unsetenv("PYTHONPATH");
  } else {
    (void)setenv("PYTHONPATH", kept.c_str(), 1);
  }
  CHECK_FALSE(std::filesystem::exists(folder / "was_run"));
}

TEST_CASE("JSON that is nested without end is refused in one line") {
  for (const char* opening : {"[", "{\"a\":"}) {
    std::string text;
    for (int level = 0; level < 100'000; ++level) text += opening;
    CHECK_THROWS_WITH(parse_json(text, "deep.json"),
                      Contains("deep.json: is nested more than 200 levels deep"));
  }
  CHECK_NOTHROW(parse_json(std::string(200, '[') + std::string(200, ']'), "flat.json"));
}

}  // namespace
}  // namespace tpm
