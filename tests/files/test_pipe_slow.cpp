// Pipes as inputs. One into which nobody writes ends in one line, after a wait.
#include <sys/stat.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>

#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"

namespace tpm::files {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("A mesh that is a pipe without a writer is refused") {
  const test::TempFolder folder;
  const std::string pipe = folder / "m.obj";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  write_file(folder / "s.json",
             R"({"organ": {"kind": "mesh", "mesh": "m.obj", "unit": "mm", "count": 40}})");
  const std::string line = "cd '" + folder.path().string() +
                           "' && timeout 600 '" TPM_TEST_PROGRAM
                           "' network check s.json > out 2> said";
  const int status = std::system(line.c_str());
  CHECK(WEXITSTATUS(status) == 3);
  CHECK_THAT(read_file(folder / "said"),
             Contains("m.obj: is a pipe into which nothing was written"));
}

TEST_CASE("A pipe that something is written into is read, with a name and without") {
  const test::TempFolder folder;
  const std::string pipe = folder / "p";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const std::string begin = "cd '" + folder.path().string() + "' && ";
  CHECK(std::system((begin + "(sleep 1; echo '{\"organ\": {\"kind\": \"liver\"}}' > p) & cd '" +
                     folder.path().string() +
                     "' && '" TPM_TEST_PROGRAM "' network check p > out 2> said")
                        .c_str()) == 0);
  CHECK(std::system((begin + "echo '{\"organ\": {\"kind\": \"liver\"}}' | '" TPM_TEST_PROGRAM
                             "' network check /dev/stdin > out 2> said")
                        .c_str()) == 0);
}

}  // namespace
}  // namespace tpm::files
