// tpm data: list, show, check and pack. The importer is in cmd_data_import.cpp.

#include <filesystem>
#include <memory>
#include <optional>

#include "answer.hpp"
#include "command.hpp"
#include "data_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/description.hpp"
#include "tpm/files/import/pack.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpm/show/table_document.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

bool is_packed(const std::string& path) {
  const auto ending = fs::path(path).extension();
  return ending == ".h5" || ending == ".hdf5";
}

/// The curves of one argument: one for an id or a CSV file, several for an HDF5 file.
std::vector<Curve> load_all(const std::string& argument) {
  if (is_packed(argument)) return unpack_curves(argument);
  return {load_curve(argument)};
}

int list(const Session& session) {
  const auto curves = list_curves();
  const std::string next =
      curves.empty() ? std::string() : "tpm data show " + shell_word(curves.front().id);
  if (session.json()) {
    const auto words = [](const CurveSummary& c) {
      return Json{{"id", c.id}, {"kind", c.kind}, {"rows", c.size}, {"title", c.title}};
    };
    Json json{{"curves", array_json(curves, words)}};
    add_end(json, {}, {}, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  std::vector<std::vector<std::string>> table{{"id", "kind", "rows", "title"}};
  for (const CurveSummary& curve : curves) {
    table.push_back({curve.id, curve.kind, std::to_string(curve.size), curve.title});
  }
  say("{}{}", aligned(table), next_line(next));
  return 0;
}

/// The description beside a curve; none for an id or an HDF5 file.
std::optional<CurveDescription> description_beside(const std::string& argument) {
  const fs::path path = argument;
  if (path.extension() != ".csv" && path.extension() != ".json") return std::nullopt;
  return read_description(fs::path(path).replace_extension(".json"));
}

int show(const Session& session, const std::string& argument, bool all_rows) {
  const auto curves = load_all(argument);
  const auto described = description_beside(argument);
  const bool in_segments = described && !described->segments.empty();
  if (session.json()) {
    Json json = array_json(curves, curve_json);
    if (in_segments) json.front()["segments"] = description_json(*described).at("segments");
    say("{}", answer_text(session, Json{{"curves", json}}));
    return 0;
  }
  for (std::size_t i = 0; i < curves.size(); ++i) {
    say("{}{}", i == 0 ? "" : "\n", curve_text(curves[i], all_rows));
  }
  if (in_segments) say("\nsegments: {}\n", segments_words(described->segments));
  return 0;
}

/// Every file is checked and every failure reported, one line each. A file that is not there is
/// bad input, not one that fails.
int check(const Session& session, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    if (fs::path(file).has_extension()) require_exists(file);
  }
  Json report = Json::array();
  bool sound = true;
  for (const std::string& file : files) {
    try {
      std::size_t rows = 0;
      for (const Curve& curve : load_all(file)) rows += curve_size(curve);
      report.push_back({{"file", file}, {"ok", true}, {"rows", rows}});
      if (!session.json()) say("{}: ok, {} rows\n", file, rows);
    } catch (const Error& error) {
      sound = false;
      report.push_back({{"file", file}, {"ok", false}, {"error", error.what()}});
      if (!session.json()) tell_user("tpm: {}\n", error.what());
    }
  }
  if (session.json())
    say("{}", answer_text(session, Json{{"curves", report}}, {{"curves_sound", sound}}));
  return exit_code(sound);
}

int pack(const Session& session, const std::vector<std::string>& arguments,
         const std::string& output, bool force) {
  if (!force && fs::exists(output)) {
    throw Error(ExitCode::usage, "-o " + output, "the file exists",
                "another --output, or --overwrite");
  }
  std::vector<Curve> curves;
  for (const std::string& argument : arguments) {
    for (Curve& curve : load_all(argument)) curves.push_back(std::move(curve));
  }
  pack_curves(output, curves);
  const std::string next = "tpm data show " + shell_word(output);
  if (session.json()) {
    Json json{{"file", output}, {"curves", curves.size()}};
    add_end(json, {}, {output}, next);
    say("{}", answer_text(session, std::move(json)));
  } else {
    say("{}: {} curves\n{}", output, curves.size(), next_line(next));
  }
  return 0;
}

void add_list(CLI::App& data, Session& session) {
  CLI::App* command = data.add_subcommand("list", "List the curves that come with tpm");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm data list\n"
      "JSON: curves, objects with id, kind (points, recording, spectrum, values), rows, title");
  set_run(*command, session, [&session] { return list(session); });
}

void add_show(CLI::App& data, Session& session) {
  CLI::App* command = data.add_subcommand("show", "Print a curve with its provenance");
  auto argument = std::make_shared<std::string>();
  auto all_rows = std::make_shared<bool>(false);
  command->add_option("curve", *argument, "Id, or .csv, .json or .h5 file")->required();
  command->add_flag("--verbose", *all_rows, "Print everything: every sample of a recording");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm data show evren_relaxation\n"
      "JSON: curves, objects in SI with id, kind, title, citation, doi, specimen, probe, note, "
      "sha256 and\n"
      "  points: observable, time_origin, time_provenance, data with label, depth_m, load_N,\n"
      "          time_s, force_N or depth_m (band: force_lower_N, force_upper_N), provenance\n"
      "  recording: provenance, samples with time_s, depth_m, force_N, force_sd_N as lists; "
      "segments\n"
      "          with kind, control, samples if an instrument ran it in segments\n"
      "  spectrum: provenance, readings with frequency_Hz, storage_Pa, loss_Pa (or storage_N/m,\n"
      "          loss_N/m; storage_sd_Pa, loss_sd_Pa) as lists\n"
      "  values: values with name, quantity, unit_SI, value, lower, upper, provenance\n"
      "An .h5 file gives a list of such objects.");
  set_run(*command, session,
          [&session, argument, all_rows] { return show(session, *argument, *all_rows); });
}

void add_check(CLI::App& data, Session& session) {
  CLI::App* command = data.add_subcommand("check", "Check curve files; exit code 1 if one fails");
  auto files = std::make_shared<std::vector<std::string>>();
  command->add_option("files", *files, "Ids, or .csv, .json or .h5 files")->required();
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm data check mine/*.csv\n"
      "JSON: curves, objects with file, ok, rows or error");
  set_run(*command, session, [&session, files] { return check(session, *files); });
}

void add_pack(CLI::App& data, Session& session) {
  struct Options {
    std::vector<std::string> curves;
    std::string output;
    bool force = false;
  };
  CLI::App* command = data.add_subcommand("pack", "Write curves into one HDF5 file");
  auto options = std::make_shared<Options>();
  command->add_option("curves", options->curves, "Ids, or .csv, .json or .h5 files")->required();
  command->add_option("-o,--output", options->output, "File to write (HDF5, .h5)")->required();
  command->add_flag("--overwrite", options->force, "Replace files that exist");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm data pack evren_relaxation evren_static -o curves.h5\n"
      "JSON: file, curves (how many), files, next");
  set_run(*command, session, [&session, options] {
    return pack(session, options->curves, options->output, options->force);
  });
}

}  // namespace

void add_data_command(CLI::App& app, Session& session) {
  CLI::App* data = app.add_subcommand("data", "List, show, check, import and pack measured curves");
  data->require_subcommand(1);
  data->footer("Example:\n  tpm data show evren_relaxation");
  add_list(*data, session);
  add_show(*data, session);
  add_check(*data, session);
  add_data_import_command(*data, session);
  add_pack(*data, session);
}

}  // namespace tpm::app
