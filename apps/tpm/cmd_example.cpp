// tpm example: the inputs that come with tpm, listed and copied.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/show/table_document.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kSynthetic = "synthetic";
constexpr std::string_view kPaper = "derived from the paper";

struct Example {
  std::string_view name;
  std::string_view command;  ///< that it is an input of, with the options it needs: "fit"
  std::string_view about;
  std::string_view provenance;
  std::string_view folder;              ///< of share_dir()
  std::vector<std::string_view> files;  ///< copied; the first one is given to the command
};

const std::vector<Example>& examples() {
  static const std::vector<Example> list{
      {"recording",
       "fit",
       "ramp to 4 mm and hold: 60 N/m beside 45 N/m that relax in 2 s, noise 0.2 mN",
       kSynthetic,
       "configs/recording_example",
       {"recording.csv", "recording.json", "make_recording.py"}},
      {"spectrum",
       "fit",
       "a hold and dynamic stiffness of one law, fitted together",
       kSynthetic,
       "configs/oscillation_example",
       {"fit.json", "hold.csv", "hold.json", "spectrum.csv", "spectrum.json"}},
      {"liver-fit",
       "fit",
       "the eight relaxation readings of pig liver, with the paper's element",
       kPaper,
       "configs",
       {"liver_relaxation.json"}},
      {"liver-design",
       "design",
       "which ramp and hold identifies the moduli of pig liver",
       kPaper,
       "configs",
       {"design_liver.json"}},
      {"organ",
       "simulate",
       "a liver of 424 spheres poked with a ball of 2 mm radius",
       kPaper,
       "configs",
       {"liver_poke.json"}},
      {"tumour",
       "simulate",
       "a liver with a stiffer inclusion under the probe",
       kPaper,
       "configs",
       {"liver_tumour.json"}},
      {"servo",
       "plan",
       "which model is accurate enough for a press of 2 mm at 1 kHz",
       kPaper,
       "configs/plan",
       {"servo.json"}},
      {"sweep",
       "sweep",
       "Tables 1 to 4 of the paper: spacing by depth",
       kPaper,
       "configs",
       {"sweep_x_depth.json"}},
      {"session",
       "hil run",
       "the liver of 424 spheres on a simulated Omega.7",
       kPaper,
       "configs",
       {"hil_liver.json"}},
      {"claims",
       "paper audit",
       "the paper's claims, to be edited into those of another paper",
       kPaper,
       "data",
       {"paper_claims.json"}}};
  return list;
}

/// Real recordings may not be passed on with tpm: where their publishers keep them.
struct RealRecording {
  std::string_view about;
  std::string_view source;
};
constexpr RealRecording kReal[] = {
    {"indentation of meat and of silicone, ramp and hold, GPL-3.0",
     "github.com/SarahIaquinta/perineal_indentation, commit 167a964"},
    {"muscle relaxation after ramps of 1 s and 100 s, MIT",
     "github.com/beards-lab/TitinViscoelasticity, commit 6cdda21"}};

std::string next_command(const Example& example, const fs::path& folder) {
  const fs::path file =
      folder.empty() ? fs::path(example.files.front()) : folder / example.files.front();
  return fmt::format("tpm {} {}", example.command, shell_word(file.string()));
}

int list_examples(const Session& session) {
  const std::string next = fmt::format("tpm example {}", examples().front().name);
  if (session.json()) {
    Json all = Json::array();
    for (const Example& e : examples()) {
      all.push_back({{"name", e.name},
                     {"command", fmt::format("tpm {}", e.command)},
                     {"about", e.about},
                     {"provenance", e.provenance},
                     {"files", e.files}});
    }
    Json real = Json::array();
    for (const RealRecording& r : kReal) real.push_back({{"about", r.about}, {"source", r.source}});
    Json json{{"examples", all}, {"real_recordings", real}};
    add_end(json, {}, {}, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  std::vector<std::vector<std::string>> table{{"name", "for", "provenance", "what"}};
  for (const Example& e : examples()) {
    table.push_back({std::string(e.name), fmt::format("tpm {}", e.command),
                     std::string(e.provenance), std::string(e.about)});
  }
  std::string text = aligned(table);
  text += "\nReal recordings do not come with tpm. Published ones:\n";
  for (const RealRecording& r : kReal) text += fmt::format("  {}: {}\n", r.about, r.source);
  say("{}\n{}", text, next_line(next));
  return 0;
}

const Example& find_example(const std::string& name) {
  const auto& all = examples();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Example& e) { return e.name == name; });
  if (found != all.end()) return *found;
  std::vector<std::string> names;
  for (const Example& e : all) names.emplace_back(e.name);
  throw Error(ExitCode::usage, "NAME",
              fmt::format("no example '{}'{}", printable(name), did_you_mean(name, names)),
              fmt::format("one of {}", fmt::join(names, ", ")));
}

/// Nothing is copied unless everything can be: a file that stands there with other content is the
/// user's own.
int copy(const Example& example, const std::string& folder, const Session& session) {
  const fs::path from = share_dir() / example.folder;
  std::vector<std::pair<fs::path, std::string>> missing;
  std::vector<std::string> copied;
  for (const std::string_view name : example.files) {
    const fs::path to = fs::path(folder) / name;
    std::string bytes = read_file(from / name);
    std::error_code ec;
    copied.push_back(to.string());
    if (!fs::exists(fs::symlink_status(to, ec))) {
      missing.emplace_back(to, std::move(bytes));
    } else if (!session.force && (fs::is_directory(to, ec) || read_file(to) != bytes)) {
      throw Error(ExitCode::usage, to.string(), "is there already and differs from the example",
                  "another --folder, or --overwrite");
    } else if (session.force) {
      missing.emplace_back(to, std::move(bytes));
    }
  }
  for (const auto& [to, bytes] : missing) write_file(to, bytes);
  if (session.json()) {
    say("{}", answer_text(session, Json{{"name", example.name},
                                        {"provenance", example.provenance},
                                        {"files", copied},
                                        {"next", next_command(example, folder)}}));
    return 0;
  }
  say("{} [{}]: {}\nwrote {}\nnext: {}\n", example.name, example.provenance, example.about,
      fmt::join(copied, ", "), next_command(example, folder));
  return 0;
}

/// The arguments of the chosen command that are no options.
std::vector<std::string> arguments_of(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      if (!option->get_positional()) continue;
      words.insert(words.end(), option->results().begin(), option->results().end());
    }
    for (std::string& word : arguments_of(*command)) words.push_back(std::move(word));
  }
  return words;
}

}  // namespace

Error with_example(const CLI::App& app, const Error& error) {
  for (const std::string& word : arguments_of(app)) {
    const auto example = std::ranges::find(examples(), word, &Example::name);
    std::error_code ec;
    if (example == examples().end() || fs::exists(word, ec)) continue;
    if (!std::string_view(error.what()).starts_with(word + ":")) continue;
    return {error.code(), word, "is the name of an example, and no such file is here",
            fmt::format("its files: tpm example {}, then {}", word, next_command(*example, {}))};
  }
  return error;
}

void add_example_command(CLI::App& app, Session& session) {
  struct Options {
    std::string name, folder;
  };
  CLI::App* command =
      app.add_subcommand("example", "List the inputs that come with tpm, or copy one");
  auto options = std::make_shared<Options>();
  command->add_option("NAME", options->name, "Which one; without it all are listed");
  add_folder_option(*command, options->folder, " (default: this one)");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm example recording\n  tpm example organ --folder trial\n"
      "JSON: examples with name, command, about, provenance, files; real_recordings with about,\n"
      "source. Of a copy: name, provenance, files, next");
  set_run(*command, session, [options, &session] {
    if (!options->name.empty()) return copy(find_example(options->name), options->folder, session);
    if (options->folder.empty()) return list_examples(session);
    throw Error(ExitCode::usage, "--folder", "without a NAME",
                "the name of an example: tpm example");
  });
}

}  // namespace tpm::app
