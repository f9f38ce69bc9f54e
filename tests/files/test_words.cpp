// The words that tpm answers to: commands and options that are misspelt, exit codes of option
// values, keys that are misspelt, "$schema" in every file that has a schema, causes of errors.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/haptics/session/session_keys.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/sweep/sweep_keys.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::files {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

/// What stands in a file, nothing too.
std::string contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Answer {
  int exit_code;
  std::string output, error;
};

Answer answer_to(const std::string& arguments) {
  const test::TempFolder folder;
  const std::string output = folder / "output", error = folder / "error";
  const int status = std::system(
      ("'" TPM_TEST_PROGRAM "' " + arguments + " > '" + output + "' 2> '" + error + "'").c_str());
  REQUIRE(WIFEXITED(status));
  return {WEXITSTATUS(status), contents(output), contents(error)};
}

}  // namespace

TEST_CASE("the nearest word has the fewest letters added, left out, changed or swapped") {
  const std::vector<std::string> known{"fit", "view", "title", "tissues", "material", "hold_out"};
  CHECK(nearest_word("fti", known) == "fit");
  CHECK(nearest_word("ft", known) == "fit");
  CHECK(nearest_word("titel", known) == "title");
  CHECK(nearest_word("Title", known) == "title");
  CHECK(nearest_word("materal", known) == "material");
  CHECK(nearest_word("hold-out", known) == "hold_out");
  CHECK(nearest_word("mat", known) == "material");  // its beginning
  CHECK(nearest_word("", known).empty());
  CHECK(nearest_word("x", known).empty());
  CHECK(nearest_word("simulate", known).empty());
  CHECK(nearest_word(std::string(100'000, 'a'), known).empty());
  CHECK(nearest_word("fit", {}).empty());
}

TEST_CASE("tpm says its version and its help in the ways that programs do") {
  const std::string version = "tpm " + std::string(tpm::version()) + "\n";
  for (const char* arguments : {"--version", "-V", "version"}) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CHECK(answer.exit_code == 0);
    CHECK(answer.output == version);
  }
  const std::string help = answer_to("--help").output;
  CHECK_THAT(help, Contains("Usage") && Contains("simulate"));
  for (const char* arguments : {"", "help"}) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CHECK(answer.exit_code == 0);
    CHECK(answer.output == help);
  }
  CHECK(answer_to("help hil run").output == answer_to("hil run --help").output);
  CHECK_THAT(answer_to("help fit").output, Contains("--bootstrap"));
}

TEST_CASE("a wrong word is named, with the nearest right one and the help to read") {
  const auto check = [](const char* arguments, const char* wrong, const char* right,
                        const char* help) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CHECK(answer.exit_code == 2);
    CHECK(answer.output.empty());
    CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 1);
    CHECK_THAT(answer.error,
               StartsWith("tpm: ") && Contains(wrong) && Contains(right) && Contains(help));
  };
  check("fti", "no command 'fti'", "did you mean 'fit'?", "tpm fit --help");
  check("fti --help", "no command 'fti'", "did you mean 'fit'?", "tpm fit --help");
  check("help fti", "no command 'fti'", "did you mean 'fit'?", "tpm fit --help");
  check("hil rnu", "hil: no command 'rnu'", "did you mean 'run'?", "tpm hil run --help");
  check("hil rnu x.json", "hil: no command 'rnu'", "did you mean 'run'?", "tpm hil --help");
  check("fit --hlep", "fit: no option '--hlep'", "did you mean '--help'?", "tpm fit --help");
  check("fit --frmat=json x.csv", "no option '--frmat'", "'--format'", "tpm fit --help");
  check("hil run --devcie virtual x.json", "hil run: no option '--devcie'", "'--device'",
        "tpm hil run --help");
  check("sweep polt x.h5", "sweep: no command 'polt'", "'plot'", "tpm sweep --help");
  check("--verison", "no option '--verison'", "'--version'", "tpm --help");
  check("qqqqqqq", "no command 'qqqqqqq'", "expected one of example, data", "see tpm --help");
  check("hil", "hil: no command", "expected one of", "see tpm hil --help");
  check("fit --qqqqqqq", "no option '--qqqqqqq'", "see", "tpm fit --help");
  check("paper tables 5", "paper tables: '5' is one argument too many", "",
        "see tpm paper tables --help");
  // The name of a command that stands below another one.
  check("benchmark --help", "no command 'benchmark'", "did you mean 'tpm accuracy benchmark'?",
        "See tpm --help");
  check("tables --depths 2", "no command 'tables'", "did you mean 'tpm paper tables'?",
        "See tpm --help");
  check("report", "no command 'report'", "did you mean 'tpm hil report' or 'tpm paper report'?",
        "See tpm --help");
  // The name of what is an option here.
  check("select r.csv", "no command 'select'", "did you mean 'tpm fit --verbose'?",
        "See tpm --help");
  check("spectrum l.json", "no command 'spectrum'", "did you mean 'tpm predict LAW --frequencies'?",
        "See tpm --help");
  check("recovery", "no command 'recovery'", "did you mean 'tpm design --laws LAWS --repetitions'?",
        "See tpm --help");
  check("coverage c.json", "no command 'coverage'",
        "did you mean 'tpm design CONFIG --repetitions'?", "See tpm --help");
  check("fit", "fit: ", "required", "see tpm fit --help");
  check("fit --format jsn x.csv", "fit: ", "--format", "see tpm fit --help");
}

TEST_CASE("a bad value of an option is a fault of the command line, whatever the command") {
  const test::TempFolder folder;
  write_file(folder / "law.json", R"({"law": "linear", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.004, "parameters": {"k_inf_N_per_m": 10},
"provenance": "assumed"})");
  const std::string law = folder / "law.json";
  const std::string sweep = TPM_TEST_SOURCE_DIR "/configs/sweep_x_depth.json";
  for (const std::string& arguments : std::vector<std::string>{
           "paper tables --depths '2 N'", "paper tables --eta 5mm", "paper tables --rate 1e400",
           "predict '" + law + "' --depth '4 N' --rate '1 mm/s' --hold '1 s'",
           "predict '" + law + "' --depth '4 mm' --rate '1 mm/s' --hold '1 s' --level x",
           "predict '" + law + "' --depth '4 mm' --rate '1 mm/s' --hold '1 s' --placement x",
           "predict '" + law + "' --depth '4 mm' --rate '1 mm/s' --hold '1e200 s'",
           "hil check --duration '4 mm'", "hil check --loop-rate 5s",
           "predict '" + law + "' --frequencies 1s", "export '" + law + "' --to nastran",
           "export '" + law + "' --to json --radius '2 s'", "network build --spheres 1",
           "network build --filling no -o '" + (folder / "n.h5") + "'",
           "design --laws linear-1 --noise x", "laws linera",
           "sweep '" + sweep + "' --workers 1000000000", "sweep '" + sweep + "' --workers 1e9",
           "budget '" + law + "' --loop-rate '1 m' --depth '4 mm' --rate '1 mm/s' --hold '1 s'"}) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CAPTURE(answer.error);
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.error, StartsWith("tpm: "));
  }
}

TEST_CASE(
    "\"$schema\" may stand at the top of every file that has a schema, and is not passed on") {
  const auto with_schema = [](std::string_view text) {
    Json json = parse_json(text, "f");
    json["$schema"] = "../schemas/x.schema.json";
    return json;
  };
  const Json law = with_schema(R"({"law": "linear", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.004, "parameters": {"k_inf_N_per_m": 10},
"provenance": "assumed"})");
  CHECK(law_from_json(law, "f").values.front() == 10.0);
  CHECK_FALSE(checked(law, law_kind(), "f").contains("$schema"));
  for (const auto& [kind, file] : {std::pair{&sweep::sweep_kind(), "configs/sweep_x_depth.json"},
                                   {&haptics::session_kind(), "configs/hil_law.json"}}) {
    CAPTURE(file);
    const auto path = std::filesystem::path(TPM_TEST_SOURCE_DIR) / file;
    const Json json = with_schema(read_file(path));
    CHECK(checked(json, *kind, "f") == checked(read_json(path), *kind, "f"));
  }
  for (const FileKind* kind :
       {&curve_kind(), &fit::design_kind(), &fit::fit_kind(), &fit::fit_tables_kind(),
        &haptics::session_kind(), &law_kind(), &organ::protocol_kind(), &organ::scene_kind(),
        &sweep::sweep_kind()}) {
    CAPTURE(kind->name);
    const Json only{{"$schema", "x"}};
    CHECK_THAT(test::refusal_of([&] { (void)checked(only, *kind, "f"); }),
               !Contains("unknown key"));
    const Json wrong{{"$schema", 1}};
    CHECK_THAT(test::refusal_of([&] { (void)checked(wrong, *kind, "f"); }),
               Contains("f: key /$schema: is of the wrong type"));
  }
}

TEST_CASE("a misspelt key is refused with the nearest key of its place") {
  const auto refusal = [](std::string_view text) {
    return test::refusal_of(
        [&] { (void)checked(parse_json(text, "f"), organ::scene_kind(), "f"); });
  };
  CHECK_THAT(
      refusal(R"({"organ": {"kind": "star"}, "materal": {}})"),
      StartsWith("f: key /materal: unknown key (did you mean 'material'?); expected one of"));
  CHECK_THAT(refusal(R"({"organ": {"kidn": "star"}})"),
             StartsWith("f: key /organ/kidn: unknown key (did you mean 'kind'?); expected one of"));
  CHECK_THAT(refusal(R"({"organ": {"kind": "star"}, "qqqqqqq": 1})"),
             StartsWith("f: key /qqqqqqq: unknown key; expected one of"));
  CHECK_THAT(refusal(R"({"organ": {"kind": "star"}, "qqqqqqq": 1})"), !Contains("$schema"));
}

TEST_CASE("an error keeps its cause, whatever is put in front of it") {
  const Error error(ExitCode::numerical, ErrorCause::buckled, "network", "the shell snaps");
  CHECK(error.within("scene.json").cause() == ErrorCause::buckled);
  CHECK(error.with_code(ExitCode::usage).cause() == ErrorCause::buckled);
  CHECK(error.with_code(ExitCode::usage).code() == ExitCode::usage);
  CHECK(bad_input("f", "says that the tissue buckles").cause() == ErrorCause::unspecified);
}

}  // namespace tpm::files
