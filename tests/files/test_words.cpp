// The words that tpm answers to: commands and options that are misspelt, exit codes of option
// values, keys that are misspelt, "$schema" in every file that has a schema, causes of errors.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
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
#include "tpm/files/instrument.hpp"
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
  // An option that another command has, the nearest ones first.
  check("hil run --loop-rate 4000 x.json", "hil run: no option '--loop-rate'",
        "did you mean 'tpm hil check --loop-rate' or 'tpm hil identify --loop-rate'?",
        "tpm hil run --help");
  check("hil verify --loop-rtae=1 x", "hil verify: no option '--loop-rtae'", "see",
        "tpm hil verify --help");
  check("paper tables --bootstrap 5", "paper tables: no option '--bootstrap'",
        "did you mean 'tpm fit --bootstrap'", "tpm paper tables --help");
  // Two commands of another group are about something else.
  check("network build --list", "tpm: network build: no option", "'--list'; see",
        "tpm network build --help");
  // A command that replaces what it was told to write needs no other one's permission.
  check("network build --overwrite -o x.h5", "network build: no option '--overwrite'",
        "the file that -o names is replaced without it", "tpm network build --help");
  for (const char* line :
       {"network build --overwrite", "network check --overwrite", "network build --folder x"}) {
    CAPTURE(line);
    CHECK_THAT(answer_to(line).error, Contains("no option") && !Contains("did you mean"));
  }
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

namespace {

/// `word` with two of its letters swapped that differ, the last of them that do.
std::string misspelt(std::string word) {
  for (std::size_t i = word.size() - 1; i > 1; --i) {
    if (word[i] == word[i - 1]) continue;
    std::swap(word[i], word[i - 1]);
    break;
  }
  return word;
}

/// Calls `check` with the words of each command and each of its options.
template <typename Check>
void each_option(const Json& command, const std::string& words, const Check& check) {
  for (const Json& option : command.at("options")) check(words, option);
  if (!command.contains("commands")) return;
  for (const Json& below : command.at("commands")) {
    each_option(below, words + " " + below.at("name").get<std::string>(), check);
  }
}

}  // namespace

TEST_CASE("every option whose value is a word names the nearest one to a misspelt one") {
  // Words of options that read them while the command line is read, and are not shown as a list.
  const std::map<std::string, std::string> longest{{"--resample", "recordings"},
                                                   {"--time-origin", "load_applied"},
                                                   {"--provenance", "digitized"},
                                                   {"tpm predict --placement", "surface"},
                                                   {"tpm validate --placement", "fitted"}};
  // Kinds of segments are those of the file.
  const std::set<std::string> left_out{"--segments"};
  const Json usage = parse_json(answer_to("--json-usage").output, "usage");
  int checked_options = 0;
  each_option(usage, "tpm", [&](const std::string& words, const Json& option) {
    const std::string name = option.at("names").back();
    const std::string kind = option.value("kind", std::string());
    if ((kind != "WORD" && !option.contains("values")) || left_out.contains(name)) return;
    CAPTURE(words, name);
    std::string word;
    if (option.contains("values")) {
      for (const Json& value : option.at("values")) {
        const auto text = value.get<std::string>();
        if (text.size() > word.size()) word = text;
      }
    } else {
      const auto own = longest.find(words + " " + name);
      const auto found = own != longest.end() ? own : longest.find(name);
      REQUIRE(found != longest.end());
      word = found->second;
    }
    const std::string command = words.size() > 4 ? words.substr(4) + " " : "";
    const Answer answer = answer_to(command + name + " " + misspelt(word));
    CHECK(answer.exit_code == 2);
    CHECK_THAT(answer.error, Contains(name) && Contains("(did you mean '" + word + "'?)"));
    ++checked_options;
  });
  CHECK(checked_options > 40);
}

TEST_CASE("names of laws, parameters, columns and variables are answered with the nearest one") {
  const test::TempFolder folder;
  const std::string law = folder / "law.json", recording = folder / "r.csv";
  write_file(law, R"({"law": "linear-1", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.004, "parameters": {"k_inf_N_per_m": 10,
"k1_N_per_m": 10, "tau1_s": 1}, "provenance": "assumed"})");
  std::string rows = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i < 20; ++i) rows += fmt::format("{},{},{}\n", 0.1 * i, 0.1 * i, 0.01 * i);
  write_file(recording, rows);
  write_file(folder / "wrong.json", R"({"law": "linear-1", "drive": "indentation_depth",
"response": "contact_force", "reference_m": 0.004, "parameters": {"k_inf_N_per_m": 10,
"k1_N_per_m": 10, "tua1_s": 1}, "provenance": "assumed"})");
  write_file(folder / "instrument.json",
             R"({"instrument": {"id": "x", "froce": "1 mN", "depth": "1 um"}})");
  write_file(folder / "sweep.json", R"({"model": "single_contact",
"indentation": {"kind": "step_hold"}, "axes": [{"parameter": "dpeth", "values": ["2 mm"]}],
"outputs": ["peak_force"]})");
  write_file(folder / "outputs.json", R"({"model": "single_contact",
"indentation": {"kind": "step_hold"}, "axes": [{"parameter": "depth", "values": ["2 mm"]}],
"outputs": ["peak_froce"]})");
  write_file(folder / "scene.json", R"({"organ": {"kind": "liver", "count": 60},
"formulation": {"kind": "newtork"}, "protocol": {"kind": "step_hold", "depth": "2 mm", "hold": "1 s"}})");
  const auto check = [](const std::string& arguments, const std::string& right) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CHECK((answer.exit_code == 2 || answer.exit_code == 3));
    CHECK(std::count(answer.error.begin(), answer.error.end(), '\n') == 1);
    CHECK_THAT(answer.error, Contains("did you mean '" + right + "'?"));
  };
  const auto quoted = [](const std::string& file) { return "'" + file + "'"; };
  check("laws linaer-1", "linear-1");
  check("laws linear-1-elstic", "linear-1-elastic");
  check("laws Power-2", "power-2");
  check("laws hertz-fznere", "hertz-fzener");
  check("design --laws linaer-1 --noise 0.001", "linear-1");
  check("fit --laws linear-2,hertz-1-relaxign " + quoted(recording), "hertz-1-relaxing");
  check("fit --time tiem " + quoted(recording), "time");
  check("fit --drive-quantity indentation_dpeth " + quoted(recording), "indentation_depth");
  check("export --to abaqsu " + quoted(law), "abaqus");
  check("export --to mjfc " + quoted(law), "mjcf");
  check("export --to json " + quoted(folder / "wrong.json"), "tau1_s");
  check("validate " + quoted(law) + " " + quoted(recording) + " --quantity haf-time", "half-time");
  check("validate " + quoted(law) + " " + quoted(recording) + " --instrument " +
            quoted(folder / "instrument.json"),
        "force");
  check("hil run --device omga7 x.json", "omega7");
  check("schema scnee", "scene");
  check("example spectrm", "spectrum");
  check("sweep " + quoted(folder / "sweep.json") + " -o " + quoted(folder / "s.h5"), "depth");
  check("sweep " + quoted(folder / "outputs.json") + " -o " + quoted(folder / "s.h5"),
        "peak_force");
  check("simulate " + quoted(folder / "scene.json") + " -o " + quoted(folder / "s.h5"), "network");
}

TEST_CASE("a recording has a name of 255 bytes, though none is left for a description beside it") {
  const test::TempFolder folder;
  const std::string file = folder / (std::string(251, 'n') + ".csv");
  std::string rows = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i < 60; ++i) {
    const double depth = i < 20 ? 0.1 * i : 2.0;
    rows += fmt::format("{},{},{}\n", 0.1 * i, depth, 0.01 * depth + 1e-5 * (i % 3));
  }
  write_file(file, rows);
  CHECK_FALSE(instrument_beside(file));
  const Answer answer = answer_to("fit --no-draw --laws linear '" + file + "'");
  CAPTURE(answer.error);
  CHECK(answer.exit_code == 0);
}

TEST_CASE("a path in a message, and in a command that it says to type, is never cut") {
  const test::TempFolder folder;
  const std::string deep = folder / (std::string(120, 'd') + " e");  // a shell wants it quoted
  std::filesystem::create_directory(deep);
  const std::string a = deep + "/a.csv", b = deep + "/b.csv";
  std::string rows = "time [s],depth [mm],force [N]\n";
  for (int i = 0; i < 60; ++i) {
    const double depth = i < 20 ? 0.1 * i : 2.0;
    rows += fmt::format("{},{},{}\n", 0.1 * i, depth, 0.01 * depth + 1e-5 * (i % 3));
  }
  write_file(a, rows);
  write_file(b, rows);
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"validate '" + a + "' '" + b + "'", "tpm fit '" + a + "' --folder fitted writes"},
           {"predict '" + a + "' '" + b + "'", "tpm fit '" + a + "' --folder fitted writes"},
           {"budget '" + a + "'", "tpm fit '" + a + "' --folder fitted writes"},
           {"validate '" + a + "'", "'" + a + "' and no recording"},
           {"fit --no-draw '" + a + "' '" + a + "'", "'" + a + "' is given twice"},
           {"fit --no-draw '" + deep + "'", "has the readings of '" + a + "'"},
           {"fit --no-draw --contact '9 mm' '" + a + "'", "largest depth of '" + a + "', 2 mm"},
           {"data show '" + deep + "/none'", "tpm: " + deep + "/none: is neither"}}) {
    CAPTURE(arguments);
    const Answer answer = answer_to(arguments);
    CHECK(answer.exit_code != 0);
    CHECK_THAT(answer.error, Contains(words));
  }
  write_file(deep + "/law.json", "{}");
  CHECK_THAT(answer_to("predict '" + deep + "' '" + a + "'").error,
             Contains("the file in it: " + deep + "/law.json"));
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
