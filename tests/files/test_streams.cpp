// Standard output and error that take nothing, and programs that lie where the user stands.
#include <hdf5.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/files/json.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::files {
using namespace show;

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
  for (const char* command : {"version", "--help", "paper tables --format json", "laws"}) {
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

TEST_CASE("Tables of depths beyond the paper's validity say so, a slip of the unit above all") {
  const test::TempFolder folder;
  const std::string said = folder / "said";
  CHECK(exit_code_of("$TPM paper tables --depths 2mm,8m > /dev/null 2> '" + said + "'") == 0);
  CHECK(read_file(said) ==
        "tpm: warning: --depths: 8000 mm is beyond 10 mm, where the paper's validity ends\n");
  CHECK(exit_code_of("$TPM paper tables --depths '2,10 mm' > /dev/null 2> '" + said + "'") == 0);
  CHECK(std::filesystem::file_size(said) == 0);
}

TEST_CASE("A message never lands in a file that took the place of a closed stream") {
  const test::TempFolder folder;
  const std::string file = folder / "tables.json";
  CHECK(exit_code_of("$TPM paper tables --format json > '" + file + "' 2>&- <&-") == 0);
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
    CHECK_FALSE(find_drawing_python().empty());
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

TEST_CASE("Slurm tasks that are submitted again alone run the shards of the first submission") {
  const test::TempFolder folder;
  const std::string output = folder / "s.h5", source = TPM_TEST_SOURCE_DIR;
  const auto task = [&](int id, int least, int most, int count) {
    return exit_code_of("export TPM SLURM_ARRAY_TASK_ID=" + std::to_string(id) +
                        " SLURM_ARRAY_TASK_MIN=" + std::to_string(least) +
                        " SLURM_ARRAY_TASK_MAX=" + std::to_string(most) +
                        " SLURM_ARRAY_TASK_COUNT=" + std::to_string(count) + "; bash '" + source +
                        "/scripts/sweep.sbatch' '" + source + "/configs/sweep_x_depth.json' '" +
                        output + "' > /dev/null 2>&1");
  };
  CHECK(task(3, 3, 3, 1) == 2);  // nothing says yet into how many shards
  // What another task of the array is just writing bears a temporary name.
  const std::string unfinished = output + ".shard-2-of-4.part-77";
  std::ofstream(unfinished) << "a";
  CHECK(task(1, 1, 4, 4) == 0);
  std::filesystem::remove(unfinished);
  CHECK(task(3, 3, 3, 1) == 0);  // --array=3
  CHECK(task(4, 2, 4, 2) == 0);  // --array=2,4
  for (const int shard : {1, 3, 4}) {
    CHECK(std::filesystem::exists(output + ".shard-" + std::to_string(shard) + "-of-4"));
  }
  CHECK(task(5, 5, 5, 1) == 2);  // there are only four
  const std::string stale = output + ".shard-1-of-8";
  std::ofstream(stale) << "a";
  CHECK(task(3, 3, 3, 1) == 2);  // of four or of eight?
  std::filesystem::remove(stale);
  const std::string by_hand =
      "$TPM sweep '" + source + "/configs/sweep_x_depth.json' -o '" + output + "' --shard ";
  CHECK(exit_code_of(by_hand + "1/2 2> /dev/null") == 2);
  CHECK(task(2, 2, 2, 1) == 0);
  CHECK(exit_code_of("$TPM sweep merge '" + source + "/configs/sweep_x_depth.json' -o '" + output +
                     "' > /dev/null") == 0);
}

TEST_CASE("a place between those of an axis is told, not taken silently") {
  const test::TempFolder folder;
  const std::string file = folder / "s.h5", pictures = folder / "p", told = folder / "told";
  std::ofstream(folder / "sweep.json") << R"({"title": "t", "model": "single_contact",
    "indentation": {"kind": "step_hold"}, "outputs": ["peak_force"], "axes": [
    {"parameter": "depth", "values": ["2 mm", "4 mm"]}, {"parameter": "spacing", "values": ["20 mm", "30 mm"]},
    {"parameter": "E1", "values": ["6 kPa", "12 kPa"]}]})";
  REQUIRE(exit_code_of("$TPM sweep '" + std::string(folder / "sweep.json") + "' -o '" + file +
                       "' > /dev/null 2>&1") == 0);
  const auto plot = [&](const std::string& at) {
    return exit_code_of("$TPM sweep plot '" + file + "' --folder '" + pictures +
                        "' --at 'depth=" + at + "' 2> '" + told + "'");
  };
  CHECK(plot("4 mm") == 0);
  CHECK(exit_code_of("grep -q 'between places' '" + told + "'") == 1);
  CHECK(plot("3.5 mm") == 0);
  CHECK_THAT(read_file(told),
             Contains("--at depth: 0.0035 m lies between places of that axis; 0.004 m is taken"));
}

/// A file whose attribute `text` of the root holds so many texts.
void write_attribute(const std::string& file, hsize_t count) {
  const hid_t made = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate_simple(1, &count, nullptr);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const hid_t attribute = H5Acreate2(made, "text", type, space, H5P_DEFAULT, H5P_DEFAULT);
  const std::vector<const char*> texts(count, "word");
  H5Awrite(attribute, type, static_cast<const void*>(texts.data()));
  H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
  H5Fclose(made);
}

TEST_CASE("An attribute of many texts is refused, not read into the room for one") {
  const test::TempFolder folder;
  write_attribute(folder / "one.h5", 1);
  CHECK(Hdf5Reader(folder / "one.h5").attribute("/", "text") == "word");
  write_attribute(folder / "many.h5", 2000);
  CHECK_THROWS_WITH(Hdf5Reader(folder / "many.h5").attribute("/", "text"),
                    Contains("not a single text"));
}

}  // namespace
}  // namespace tpm::files
