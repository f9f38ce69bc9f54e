// Declared in fit_options.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <regex>

#include "fit_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/groups/group_comparison.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/show/comparison_report.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// Sets the specimen of each recording: the match of a name pattern's group, or the file's entry
/// under a key.
void set_specimens(const FitOptions& options, std::vector<PreparedRecording>& recordings) {
  const std::string& by = options.group_by;
  if (by.empty()) return;
  if (by.find('(') == std::string::npos) {
    for (PreparedRecording& r : recordings) {
      r.specimen = recording_label(r.name, by, import_options(options.recordings));
    }
    return;
  }
  std::regex pattern;
  try {
    pattern = std::regex(by);
  } catch (const std::regex_error&) {
    throw Error(ExitCode::usage, "--group-by", fmt::format("'{}' is no pattern", printable(by)),
                "a regular expression such as \"(liver[0-9]+)_\"");
  }
  if (pattern.mark_count() != 1) {
    throw Error(ExitCode::usage, "--group-by",
                fmt::format("{} groups in '{}'", pattern.mark_count(), printable(by)), "one");
  }
  for (PreparedRecording& r : recordings) {
    const std::string name = std::filesystem::path(r.name).filename().string();
    std::smatch match;
    if (!std::regex_search(name, match, pattern) || match[1].length() == 0) {
      throw Error(ExitCode::usage, "--group-by",
                  fmt::format("'{}' is not matched by '{}'", name, printable(by)),
                  "a pattern that every file name matches");
    }
    r.specimen = match[1].str();
  }
}

/// Recordings in a folder, in alphabetical order.
std::vector<std::string> recordings_in(const std::filesystem::path& folder) {
  if (std::filesystem::exists(folder / "selection.json")) {
    throw bad_input(
        folder.string(), "this folder was written by tpm fit",
        fmt::format("a folder of recordings; tpm fit {} fits again, tpm view {} shows it",
                    shell_word((folder / "config.json").string()), shell_word(folder.string())));
  }
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    constexpr std::array kEndings{".csv", ".txt", ".tsv", ".jpk-force"};
    const bool known = std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
    if (entry.is_regular_file() && known) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    throw bad_input(folder.string(), "no recording",
                    "files that end in .csv, .txt, .tsv or .jpk-force");
  }
  return files;
}

/// "healthy" of "data/healthy/".
std::string folder_name(const std::string& folder) {
  std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path.filename().string();
}

RecordingGroup group_in(const FitOptions& options, const std::string& folder) {
  RecordingOptions input = options.recordings;
  input.files = recordings_in(folder);
  RecordingGroup group{folder_name(folder), read_recordings(input)};
  require_indentation(options, group.recordings);
  set_specimens(options, group.recordings);
  return group;
}

/// Throws Error(usage) if the inputs are not two folders, naming the one that is none.
void require_two_folders(const std::vector<std::string>& inputs) {
  constexpr const char* kExpected =
      "two folders of recordings, such as: tpm fit healthy/ fibrotic/ --compare";
  if (inputs.size() != 2) {
    throw Error(ExitCode::usage, "--compare",
                fmt::format("with {} input{}", inputs.size(), inputs.size() == 1 ? "" : "s"),
                kExpected);
  }
  for (const std::string& input : inputs) {
    if (std::filesystem::is_directory(input)) continue;
    const bool file = std::filesystem::exists(input);
    throw Error(ExitCode::usage, "--compare",
                fmt::format("'{}' {}", printable(input), file ? "is a file" : "is no folder"),
                kExpected);
  }
}

}  // namespace

int fit_folder(const FitOptions& options, const Session& session) {
  const auto csv = csv_beside(options.output, session);
  announce_figures(options, options.recordings.files.front(), {"figures.json", "specimens.json"});
  RecordingOptions input = options.recordings;
  input.files = recordings_in(options.recordings.files.front());
  SelectionOptions selection = selection_options(options);
  const std::optional<LawSpec> law = only_law(selection);
  std::vector<PreparedRecording> recordings = read_recordings(input);
  require_indentation(options, recordings);
  set_reference(options, recordings, selection);
  hold_placement(options.placement, options.recordings, recordings, selection.setup.contact,
                 selection.setup.zero);
  set_specimens(options, recordings);
  const SpecimenStudy study = study_specimens(recordings, law, selection);
  std::optional<YoungModuli> moduli;
  if (const auto probe = probe_of(options)) {
    moduli = pooled_moduli(study, *probe, options.poisson.empty());
  }
  Json json = to_json(study);
  std::string text = to_terminal_text(study);
  append_moduli(json, text, moduli);
  const std::string folder = figure_folder(options, options.recordings.files.front());
  std::vector<std::string> files;
  if (!options.no_draw) {
    files = write_specimen_report(folder, study, probe_of(options));
    write_moduli(folder, moduli, files);
  }
  ShortAnswer answer = short_answer(study);
  if (moduli) add_moduli(answer, *moduli);
  text = answer_with_files(options, session, std::move(json), std::move(text), std::move(answer),
                           folder, files, files.empty() ? "" : next_of_figures(folder));
  deliver(text, options.output);
  deliver_csv(pooled_csv(study), csv);
  return 0;
}

int compare_folders(const FitOptions& options, const Session& session) {
  const std::vector<std::string>& folders = options.recordings.files;
  require_two_folders(folders);
  const auto csv = csv_beside(options.output, session);
  RecordingGroup first = group_in(options, folders[0]);
  RecordingGroup second = group_in(options, folders[1]);
  if (first.name == second.name) {  // "1/liver" and "2/liver"
    first.name = folders[0];
    second.name = folders[1];
  }
  const std::string folder =
      options.folder.empty()
          ? fmt::format("{}_against_{}", folder_name(folders[1]), folder_name(folders[0]))
          : options.folder;
  if (!options.no_draw) will_write_into(folder, {"figures.json", "comparison.json"});
  SelectionOptions selection = selection_options(options);
  const std::optional<LawSpec> law = only_law(selection);
  set_reference(options, first.recordings, selection);
  hold_placement(options.placement, options.recordings, first.recordings, selection.setup.contact,
                 selection.setup.zero);
  hold_placement(options.placement, options.recordings, second.recordings, selection.setup.contact,
                 selection.setup.zero);
  const std::optional<ContactGeometry> probe = probe_of(options);
  const GroupComparison comparison = compare_groups(first, second, law, selection, probe);
  std::vector<std::string> files;
  if (!options.no_draw) files = write_comparison_report(folder, comparison, probe);
  const std::string text = answer_with_files(
      options, session, to_json(comparison), to_terminal_text(comparison), short_answer(comparison),
      folder, files, files.empty() ? "" : next_of_figures(folder));
  deliver(text, options.output);
  deliver_csv(comparison_csv(comparison), csv);
  return 0;
}

}  // namespace tpm::app
