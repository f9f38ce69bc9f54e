// tpm accuracy verify: every check holds, and every check fails when a coefficient is wrong.
#include <fmt/format.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "temp_folder.hpp"
#include "tpm/accuracy/show/verification_report.hpp"
#include "tpm/files/file.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using Catch::Matchers::Contains;

namespace {

VerificationRun verified(const std::string& group, double flaw) {
  const std::vector<std::string> names{group};
  return run_verification(chosen_groups(names), flaw);
}

/// Every check of a group holds as it is, and fails once a coefficient is wrong by 1 %.
void check_group(const std::string& group) {
  for (const double flaw : {0.0, 0.01}) {
    const VerificationRun verification = verified(group, flaw);
    REQUIRE(verification.rows.size() >= 5);
    for (const VerificationRow& row : verification.rows) {
      CAPTURE(row.what, row.quantity, row.measured, row.expected, row.tolerance, row.failure, flaw);
      CHECK(row.holds() == (flaw == 0.0));
      CHECK(row.tolerance > 0.0);
      CHECK_FALSE(row.source.empty());
    }
    CHECK(verification.failed() == (flaw == 0.0 ? 0 : verification.rows.size()));
  }
}

struct Run {
  int exit_code;
  std::string output;
};

Run run_program(const std::string& arguments) {
  const test::TempFolder folder;
  const std::string output = folder / "output";
  const int status =
      std::system(("'" TPM_TEST_PROGRAM "' " + arguments + " > '" + output + "' 2>&1").c_str());
  REQUIRE(WIFEXITED(status));
  return {WEXITSTATUS(status), read_file(output)};
}

/// The same with standard output on a terminal.
std::string on_terminal(const std::vector<const char*>& arguments, const char* no_color) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  REQUIRE(child >= 0);
  if (child == 0) {
    if (no_color != nullptr) ::setenv("NO_COLOR", no_color, 1);
    if (no_color == nullptr) ::unsetenv("NO_COLOR");
    std::vector<char*> words{const_cast<char*>("tpm")};
    for (const char* argument : arguments) words.push_back(const_cast<char*>(argument));
    words.push_back(nullptr);
    ::execv(TPM_TEST_PROGRAM, words.data());
    ::_exit(127);
  }
  std::string output;
  char bytes[4096];
  for (ssize_t count = 0; (count = ::read(terminal, bytes, sizeof bytes)) > 0;) {
    output.append(bytes, static_cast<std::size_t>(count));
  }
  ::waitpid(child, nullptr, 0);
  ::close(terminal);
  return output;
}

const std::string kRed = "\x1b[31m";

/// Two that hold, one with a wrong value, and one in which a solver gives up.
std::vector<VerificationCheck> stand_in_checks() {
  const auto check = [](double tolerance, double measured) {
    return VerificationCheck{"made", "value",   "this test",
                             1.0,    tolerance, [measured](double) { return measured; }};
  };
  VerificationCheck stuck = check(0.1, 1.0);
  stuck.measure = [](double) -> double {
    throw Error(ExitCode::numerical, "made", "gave up", "an answer");
  };
  return {check(0.1, 1.05), check(0.1, 1.2), stuck, check(0.5, 1.2)};
}

std::ptrdiff_t occurrences(const std::string& text, const std::string& words) {
  std::ptrdiff_t count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("verification: closed forms hold, and fail with a wrong coefficient") {
  check_group("closed-forms");
}

TEST_CASE("verification: certified problems hold, and fail with a wrong coefficient", "[heavy]") {
  check_group("regression");
}

TEST_CASE("verification: energy is accounted for, and is not with a wrong coefficient", "[heavy]") {
  check_group("energy");
}

TEST_CASE("verification: a check without a number has failed") {
  VerificationRow row;
  row.tolerance = 1.0;
  CHECK_FALSE(row.holds());
  row.measured = 0.5;
  CHECK(row.holds());
}

TEST_CASE("verification: of rows that hold and rows that fail, only the latter are red") {
  const std::vector<VerificationGroup> groups{{"stand-in", "rows of this test", stand_in_checks}};
  const VerificationRun run = run_verification(groups, 0.0);
  REQUIRE(run.rows.size() == 4);
  CHECK(run.failed() == 2);
  CHECK(verification_words(run) == "4 checks: 2 FAILED.");
  const std::vector<bool> holds{true, false, false, true};
  const Json json = to_json(run);
  CHECK(json.at("failed") == 2);
  CHECK(json.at("holds") == false);
  for (std::size_t i = 0; i < holds.size(); ++i) CHECK(json.at("rows")[i].at("holds") == holds[i]);
  CHECK(json.at("rows")[1].at("measured") == 1.2);
  CHECK_FALSE(json.at("rows")[2].contains("measured"));
  CHECK(json.at("rows")[2].at("failure") == "made: gave up; expected an answer");
  const std::string csv = verification_csv(run);
  CHECK(occurrences(csv, ",yes,") == 2);
  CHECK(occurrences(csv, ",no,") == 2);
  for (const VerificationLine& line : verification_lines(run)) {
    CAPTURE(line.text);
    CHECK(line.failed == (line.text.find("FAIL") != std::string::npos));
  }
  // In brief: the verdict, each group, what failed.
  const std::vector<VerificationLine> brief = brief_lines(run);
  REQUIRE(brief.size() == 4);
  CHECK(brief[0].text == "4 checks: 2 FAILED.\n");
  CHECK(brief[1].text == "  stand-in: 2 of 4 hold\n");
  for (const VerificationLine& line : brief) CHECK(line.failed);
  const test::TempFolder folder;
  write_verification(run, folder / "page", 1.0);
  const std::string page = read_file(folder / "page/report.html");
  CHECK(occurrences(page, "bad\">FAILS") == 2);
  CHECK(occurrences(page, "good\">holds") == 2);
  CHECK(occurrences(page, "FAILS") == 2);
  CHECK_THAT(page, Contains("bad\">1.2<") && Contains("bad\">made: gave up") &&
                       Contains("bad\">4 checks: 2 FAILED.") &&
                       Contains("bad\">stand-in: 2 of 4 hold"));
  const std::string text = read_file(folder / "page/report.md");
  CHECK(occurrences(text, "FAILS") == 2);
  // What all rows share stands once, above them.
  CHECK(occurrences(text, "Reference: this test.") == 1);
  CHECK(occurrences(text, "| this test") == 0);
}

TEST_CASE("verification: a problem has a table, whose rows name the method alone") {
  VerificationRun run;
  for (const char* method : {"one", "two"}) {
    for (const char* problem : {"a bar", "a beam"}) {
      VerificationRow row;
      row.group = "orders";
      row.what = fmt::format("{}, {}", method, problem);
      row.problem = problem;
      row.quantity = "order";
      row.source = fmt::format("closed form of {}", problem);
      row.measured = row.expected = 2.0;
      row.tolerance = 0.1;
      run.rows.push_back(std::move(row));
    }
  }
  const test::TempFolder folder;
  write_verification(run, folder / "page", 1.0);
  const std::string text = read_file(folder / "page/report.md");
  for (const char* problem : {"a bar", "a beam"}) {
    CHECK(occurrences(text, fmt::format("{0}. Reference: closed form of {0}.", problem)) == 1);
    CHECK(occurrences(text, std::string(", ") + problem) == 0);
  }
  CHECK(occurrences(text, "| one |") == 2);
  CHECK(to_json(run).at("rows")[0].at("what") == "one, a bar");
}

TEST_CASE("verification: names of groups") {
  CHECK(chosen_groups({}).size() == verification_groups().size());
  const std::vector<std::string> wrong{"closed_forms"};
  CHECK_THROWS_WITH(chosen_groups(wrong),
                    "GROUP: 'closed_forms'; expected one of orders, reduction, regression, "
                    "closed-forms, energy");
}

TEST_CASE("tpm accuracy verify: exit code, text, JSON, CSV and pages agree", "[heavy]") {
  const test::TempFolder folder;
  const Run good =
      run_program("accuracy verify closed-forms --verbose --folder '" + (folder / "good") + "'");
  CHECK(good.exit_code == 0);
  CHECK_THAT(good.output, Contains("all hold.") && !Contains("FAILS") && !Contains(kRed));
  const Run bad = run_program("accuracy verify closed-forms --flaw 1% --format json --folder '" +
                              (folder / "bad") + "'");
  CHECK(bad.exit_code == 1);
  const Json json = Json::parse(bad.output);
  CHECK(json.at("failed") == json.at("checks"));
  const Json written = Json::parse(read_file(folder / "bad/verification.json"));
  for (const auto& [key, value] : written.items()) {
    CHECK(json.at(key) == value);  // beside what stands in the answers of all commands
  }
  const std::string csv = read_file(folder / "bad/verification.csv");
  CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) ==
        1 + json.at("rows").size());
  CHECK_THAT(read_file(folder / "bad/report.html"), Contains("bad\">FAILS"));
  CHECK_THAT(read_file(folder / "good/report.md"), Contains("all hold"));
  for (const Json& row : json.at("rows")) {
    CHECK_THAT(read_file(folder / "bad/report.md"), Contains(row.at("quantity")));
    CHECK_THAT(good.output, Contains(row.at("what").get<std::string>()));
  }
}

TEST_CASE("tpm accuracy verify: failing rows are red on a terminal, others never", "[heavy]") {
  const std::vector<const char*> flawed{"accuracy", "verify", "closed-forms", "--flaw", "1%"};
  CHECK_THAT(on_terminal(flawed, nullptr), Contains(kRed + "FAILS"));
  CHECK_THAT(on_terminal(flawed, "1"), Contains("FAILS") && !Contains(kRed));
  CHECK_THAT(on_terminal({"accuracy", "verify", "closed-forms"}, nullptr),
             Contains("all hold") && !Contains(kRed));
}

TEST_CASE("tpm accuracy verify: a flaw that only some checks can see", "[heavy]") {
  const test::TempFolder folder;
  const Run run =
      run_program("accuracy verify closed-forms --flaw 0.00001% --format json --folder '" +
                  (folder / "page") + "'");
  CHECK(run.exit_code == 1);
  const Json json = Json::parse(run.output);
  std::ptrdiff_t failed = 0;
  for (const Json& row : json.at("rows")) failed += row.at("holds") ? 0 : 1;
  const auto checks = std::ssize(json.at("rows"));
  REQUIRE(failed > 0);
  REQUIRE(failed < checks);
  CHECK(json.at("failed") == failed);
  const std::string page = read_file(folder / "page/report.html");
  CHECK(occurrences(page, "bad\">FAILS") == failed);
  CHECK(occurrences(page, "good\">holds") == checks - failed);
  // Beside the rows: how many fail, and that there is a flaw.
  const std::string text = on_terminal(
      {"accuracy", "verify", "closed-forms", "--flaw", "0.00001%", "--verbose"}, nullptr);
  CHECK(occurrences(text, kRed) == failed + 2);
  CHECK(occurrences(text, kRed + "  FAILS") == failed);
}

TEST_CASE("the example in the help of tpm accuracy verify runs") {
  const Run help = run_program("accuracy verify --help");
  CHECK_THAT(help.output, Contains("tpm accuracy verify closed-forms --flaw 1%"));
  CHECK(run_program("accuracy verify closed-forms --flaw 1%").exit_code == 1);
  const Run list = run_program("accuracy verify --list");
  for (const VerificationGroup& group : verification_groups()) {
    CHECK_THAT(list.output, Contains(std::string(group.summary)));
  }
}

TEST_CASE("tpm accuracy verify: what it refuses is one line and exit code 2") {
  const Run group = run_program("accuracy verify closed_forms");
  CHECK(group.exit_code == 2);
  CHECK_THAT(group.output, Contains("tpm: GROUP: 'closed_forms'; expected one of orders"));
  const Run flaw = run_program("accuracy verify --flaw much");
  CHECK(flaw.exit_code == 2);
  CHECK(flaw.output == "tpm: --flaw: 'much'; expected a share such as 10% or 0.1\n");
  CHECK(run_program("accuracy")
            .output.starts_with(
                "tpm: accuracy: no command; expected one of verify, benchmark, stability"));
  const Run require = run_program("paper report --require 200%");
  CHECK(require.exit_code == 2);
  CHECK(require.output == "tpm: --require: '200%'; expected a share above 0 and below 100 %\n");
}
