// Runs the program on bad input of every file type and checks that it answers as promised: one line
// on standard error, an exit code that is not zero, no output file left behind. The answers are the
// table docs/errors.md. To add a file type, write a function that returns its cases and add it to
// all_cases(). After a wanted change run this test with TPM_UPDATE_DOCS=1 and review the table.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "curve_error_cases.hpp"
#include "error_case.hpp"
#include "fit_error_cases.hpp"
#include "jpk_error_cases.hpp"
#include "material_error_cases.hpp"
#include "organ_law_error_cases.hpp"
#include "placement_error_cases.hpp"
#include "scene_error_cases.hpp"
#include "session_error_cases.hpp"
#include "simulation_error_cases.hpp"
#include "sweep_error_cases.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "validation_error_cases.hpp"

using namespace tpm;
using namespace tpm::files;
using test::ErrorCase;
using test::TempFolder;
using test::with_files;

namespace {

std::vector<ErrorCase> all_cases() {
  std::vector<ErrorCase> all;
  for (const auto& cases : {test::error_cases::curve_csv_cases(),
                            test::error_cases::curve_json_cases(),
                            test::error_cases::machine_cases(),
                            test::error_cases::spectrum_cases(),
                            test::error_cases::digitizer_cases(),
                            test::jpk_error_cases(),
                            test::error_cases::hdf5_cases(),
                            test::error_cases::fit_config_cases(),
                            test::error_cases::oscillation_cases(),
                            test::error_cases::fit_tables_cases(),
                            test::error_cases::design_cases(),
                            test::error_cases::claims_cases(),
                            test::error_cases::recording_folder_cases(),
                            test::error_cases::law_cases(),
                            test::error_cases::scene_cases(),
                            test::error_cases::table_option_cases(),
                            test::error_cases::session_cases(),
                            test::error_cases::device_file_cases(),
                            test::error_cases::session_recording_cases(),
                            test::error_cases::view_cases(),
                            test::simulation_error_cases(),
                            test::sweep_error_cases(),
                            test::material_error_cases(),
                            test::placement_error_cases(),
                            test::plugin_error_cases(),
                            test::organ_law_error_cases(),
                            test::validation_error_cases()}) {
    all.insert(all.end(), cases.begin(), cases.end());
  }
  return all;
}

std::string replace_all(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

struct ProgramAnswer {
  int exit_code = 0;
  std::string error;
};

ProgramAnswer run(const std::string& arguments, const TempFolder& folder) {
  const std::string error_file = folder / "stderr";
  const std::string command = std::string("\"") + TPM_TEST_PROGRAM + "\" " +
                              replace_all(arguments, "{}", folder.path().string()) +
                              " >/dev/null 2>\"" + error_file + "\"";
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  std::ifstream in(error_file, std::ios::binary);
  ProgramAnswer answer{WEXITSTATUS(status), std::string(std::istreambuf_iterator<char>(in), {})};
  std::filesystem::remove(error_file);
  return answer;
}

std::size_t count_files(const TempFolder& folder) {
  using Iterator = std::filesystem::recursive_directory_iterator;
  return static_cast<std::size_t>(
      std::count_if(Iterator(folder.path()), Iterator(),
                    [](const auto& entry) { return entry.is_regular_file(); }));
}

/// A row of the table, without anything that differs from machine to machine.
std::string table_row(const ErrorCase& error_case, const ProgramAnswer& answer,
                      const TempFolder& folder) {
  std::string message = answer.error.substr(0, answer.error.find('\n'));
  message = replace_all(message, folder.path().string() + "/", "");
  message = replace_all(message, folder.path().string(), "FOLDER");
  message = replace_all(message, share_dir().string() + "/", "");
  // The load at which a path meets an instability depends on roundings of the linear algebra.
  static const std::regex buckling(R"(a load of [0-9.]+ N(,? the tissue buckles) around [^:]* mm)");
  message = std::regex_replace(message, buckling, "a load of ... N$1 around sphere ...");
  static const std::regex sagging(R"((that stay the tissue buckles) around [^:;]* mm)");
  message = std::regex_replace(message, sagging, "$1 around sphere ...");
  message = replace_all(message, "|", "\\|");
  return "| " + error_case.file_type + " | " + error_case.what + " | " +
         std::to_string(answer.exit_code) + " | `" + message + "` |\n";
}

/// The lines of one text that the other has not.
std::string rows_only_in(const std::string& text, const std::string& other) {
  std::istringstream lines(other);
  std::set<std::string> known;
  for (std::string line; std::getline(lines, line);) known.insert(line);
  std::string rows;
  lines = std::istringstream(text);
  for (std::string line; std::getline(lines, line);) {
    if (!known.contains(line)) rows += line + "\n";
  }
  return rows;
}

}  // namespace

TEST_CASE("bad input gives one line, an exit code and no output; docs/errors.md says which",
          "[heavy]") {
  std::string table =
      "# What tpm says to bad input\n\n"
      "Written by `tests/files/test_errors.cpp`, which runs the program on each of these files; "
      "after a\n"
      "wanted change run it with `TPM_UPDATE_DOCS=1`. Exit codes: 1 the answer is no, 2 command\n"
      "line, also a bad value of an option or an output that exists, 3 bad input, 4 numerical "
      "failure,\n"
      "5 environment.\n\n"
      "| file type | fault | exit code | message |\n| --- | --- | --- | --- |\n";
  for (const ErrorCase& error_case : all_cases()) {
    INFO(error_case.file_type << ": " << error_case.what);
    const TempFolder folder;
    error_case.make(folder);
    const std::size_t files_before = count_files(folder);
    const ProgramAnswer answer = run(error_case.arguments, folder);
    CAPTURE(answer.error.substr(0, 500));
    CHECK(answer.exit_code != 0);
    CHECK(answer.error.starts_with("tpm: "));
    CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 1);
    CHECK(answer.error.size() < 600);
    CHECK(answer.error.find("internal error") == std::string::npos);
    CHECK(count_files(folder) == files_before);
    table += table_row(error_case, answer, folder);
  }
  // Beside the test program, to compare by hand.
  std::ofstream(TPM_TEST_BINARY_DIR "/errors.md", std::ios::binary) << table;
  const std::string committed = std::string(TPM_TEST_SOURCE_DIR) + "/docs/errors.md";
  if (std::getenv("TPM_UPDATE_DOCS") != nullptr) write_file(committed, table);
  INFO("docs/errors.md is out of date: run this test with TPM_UPDATE_DOCS=1 and review it");
  CHECK(rows_only_in(table, read_file(committed)) == "");
  CHECK(rows_only_in(read_file(committed), table) == "");
  CHECK((read_file(committed) == table));
}

TEST_CASE("tpm data check reports every failing file and answers no") {
  const TempFolder folder;
  const std::string& points = test::error_cases::kPointsJson;
  const std::string broken = "depth_mm,force_N,provenance\n2,x,table\n";
  with_files({{"c.json", points}, {"c.csv", broken}, {"d.json", points}, {"d.csv", broken}})(
      folder);
  const ProgramAnswer answer = run("data check {}/c.csv evren_static {}/d.csv", folder);
  CHECK(answer.exit_code == 1);
  CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 2);
  CHECK(run("data check {}/c.csv {}/missing.csv", folder).exit_code == 3);
  CHECK(run("data check evren_static", folder).exit_code == 0);
}

TEST_CASE("tpm data import and pack do not replace files without --overwrite") {
  const TempFolder folder;
  with_files({{"m.csv", "Time (s),Force (N)\n0,0\n1,1\n"}})(folder);
  CHECK(run("data import {}/m.csv -o {}/out", folder).exit_code == 0);
  const std::string first = read_file(folder / "out.csv");
  CHECK(run("data import {}/m.csv -o {}/out", folder).exit_code == 2);
  CHECK(run("data import {}/m.csv -o {}/out --overwrite", folder).exit_code == 0);
  CHECK(read_file(folder / "out.csv") == first);
  CHECK(run("data pack {}/out.csv -o {}/p.h5", folder).exit_code == 0);
  CHECK(run("data pack {}/out.csv -o {}/p.h5", folder).exit_code == 2);
  CHECK(run("data show {}/p.h5 --format json", folder).exit_code == 0);
}

TEST_CASE("tpm hil identify does not replace a file without --overwrite") {
  const TempFolder folder;
  with_files({{"mine.txt", "foreign\n"}})(folder);
  const char* line = "hil identify --duration '5 s' -o {}/mine.txt";
  const ProgramAnswer refused = run(line, folder);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.error,
             Catch::Contains("mine.txt: the file exists; expected another --output, or "
                             "--overwrite"));
  CHECK(read_file(folder / "mine.txt") == "foreign\n");
  CHECK(run(std::string(line) + " --overwrite", folder).exit_code == 0);
  CHECK_THAT(read_file(folder / "mine.txt"), Catch::Contains("\"device\": \"virtual\""));
  CHECK(run(line, folder).exit_code == 2);  // nor a measurement of its own
}
