// tpm schema: the keys of the files that tpm reads.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "command.hpp"
#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/likelihood/fit_keys.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpm/haptics/session/recording_keys.hpp"
#include "tpm/haptics/session/session_keys.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/paper/claims/claims.hpp"
#include "tpm/paper/organ_study.hpp"
#include "tpm/sweep/sweep_keys.hpp"

namespace tpm::app {
namespace {

struct SchemaOptions {
  std::string name, output;
  bool example = false, keys = false;
};

/// The kinds of files whose keys are declared in the library.
std::vector<const FileKind*> declared_kinds() {
  return {&benchmark_kind(),
          &claims_kind(),
          &curve_kind(),
          &design_kind(),
          &device_kind(),
          &fit_kind(),
          &fit_tables_kind(),
          &law_kind(),
          &session_kind(),
          &recording_closing_kind(),
          &recording_header_kind(),
          &organ_study_kind(),
          &protocol_kind(),
          &scene_kind(),
          &sweep_kind()};
}

constexpr std::string_view kEnding = ".schema.json";

std::filesystem::path schema_file(const std::string& name) {
  return share_dir() / "schemas" / fmt::format("{}{}", name, kEnding);
}

/// The names of all schemas, sorted.
std::vector<std::string> schema_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(share_dir() / "schemas")) {
    const std::string file = entry.path().filename().string();
    if (file.ends_with(kEnding)) names.push_back(file.substr(0, file.size() - kEnding.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

const FileKind* find_declared(const std::string& name) {
  const auto all = declared_kinds();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const FileKind* kind) { return kind->name == name; });
  return found == all.end() ? nullptr : *found;
}

void require_known(const std::string& name) {
  const std::vector<std::string> known = schema_names();
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  throw Error(
      ExitCode::usage, "NAME",
      fmt::format("no kind of file is called '{}'{}", printable(name), did_you_mean(name, known)),
      fmt::format("one of {}", fmt::join(known, ", ")));
}

std::string list_of_kinds() {
  std::string text;
  for (const std::string& name : schema_names()) {
    const FileKind* kind = find_declared(name);
    const std::string title =
        kind != nullptr ? kind->title : read_json(schema_file(name)).value("title", "");
    text += fmt::format("{:<18} {}\n", name, title);
  }
  return text;
}

constexpr std::string_view kHeading =
    "# Keys of files\n\n"
    "Written by `tpm schema --keys`; a test compares. Quantities are texts of a number and a unit, "
    "such as\n"
    "`\"20 mm\"`; their ranges stand in SI units. What a file may hold is also in `schemas/`, for\n"
    "[editors](data_formats.md).\n\n";

std::string page_of_keys(const std::string& name) {
  std::string page(name.empty() ? kHeading : "");
  for (const FileKind* kind : declared_kinds()) {
    if (name.empty() || kind->name == name) page += keys_section(*kind);
  }
  while (page.ends_with("\n\n")) page.pop_back();
  return page;
}

std::string answer(const SchemaOptions& options) {
  if (!options.name.empty()) require_known(options.name);
  const FileKind* kind = find_declared(options.name);
  const bool more = options.example || options.keys;
  if (more && !options.name.empty() && kind == nullptr) {
    throw Error(ExitCode::usage, options.example ? "--example" : "--keys",
                fmt::format("of '{}'", options.name),
                fmt::format("one of {}, or the schema alone",
                            listed(declared_kinds(), [](const FileKind* k) { return k->name; })));
  }
  if (options.keys) return page_of_keys(options.name);
  if (options.name.empty()) {
    if (options.example) throw Error(ExitCode::usage, "NAME", "is missing", "a kind of file");
    return list_of_kinds();
  }
  if (options.example) return to_text(example_of(*kind));
  return kind != nullptr ? to_text(json_schema(*kind)) : read_file(schema_file(options.name));
}

}  // namespace

void add_schema_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("schema", "Print the keys of a kind of file as JSON Schema");
  const auto options = std::make_shared<SchemaOptions>();
  command->add_option("NAME", options->name, "Kind of file, such as scene; default: list them");
  command->add_option("-o,--output", options->output, "File to write (default: the terminal)");
  auto* example =
      command->add_flag("--example", options->example, "Print a small file of the kind");
  command->add_flag("--keys", options->keys, "Print tables of all keys (Markdown)")
      ->excludes(example);
  command->footer(
      "An editor completes and checks a file that names its schema in \"$schema\".\n"
      "Example:\n  tpm schema scene\n  tpm schema scene --example > scene.json");
  set_run(*command, session, [options] {
    deliver(answer(*options), options->output);
    return 0;
  });
}

}  // namespace tpm::app
