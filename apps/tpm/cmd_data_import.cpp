// tpm data import: brings digitised figures, testing-machine exports and JPK force files into the
// project's form.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace fs = std::filesystem;
namespace {

/// The command line as it was typed; options_of() turns it into numbers and checks it.
struct ImportArguments {
  std::vector<std::string> files;
  std::string output, folder;
  bool force = false;
  ImportOptions options;  ///< what needs no reading: names
  ReadingArguments reading;
  std::string contact_force;
  std::string contact_samples = "3";
  std::string x, y, depth, load;
  std::string time_origin = "none";
  std::string provenance, probe_diameter;
};

int parse_count(const std::string& text, int least, const std::string& option) {
  const double value = option_number(text, option);
  constexpr double kMost = 1e6;
  if (value != static_cast<int>(std::min(value, kMost)) || value < least) {
    throw Error(ExitCode::usage, option, fmt::format("'{}' is no such count", printable(text)),
                fmt::format("a whole number from {}", least));
  }
  return static_cast<int>(value);
}

double positive(const std::string& text, Dimension dimension, const std::string& option) {
  const double value = option_quantity(text, dimension, option);
  if (value <= 0.0) throw Error(ExitCode::usage, option, "is not positive", "a value above 0");
  return value;
}

ImportOptions options_of(const ImportArguments& arguments) {
  ImportOptions options = reading_of(arguments.reading);
  options.format = arguments.options.format;
  options.header = arguments.options.header;
  options.dataset = arguments.options.dataset;
  if (!arguments.contact_force.empty()) {
    options.contact_force_N =
        positive(arguments.contact_force, Dimension::force, "--contact-force");
  }
  options.contact_samples = parse_count(arguments.contact_samples, 1, "--contact-samples");
  if (!arguments.x.empty())
    options.x = of_option([&] { return parse_axis(arguments.x, "--x-quantity"); });
  if (!arguments.y.empty())
    options.y = of_option([&] { return parse_axis(arguments.y, "--y-quantity"); });
  if (!arguments.depth.empty()) {
    options.depth_m = positive(arguments.depth, Dimension::length, "--depth");
  }
  if (!arguments.load.empty()) {
    options.load_N = positive(arguments.load, Dimension::force, "--load");
  }
  options.time_origin =
      of_option([&] { return parse_time_origin(arguments.time_origin, "--time-origin"); });
  if (!arguments.provenance.empty()) {
    options.provenance =
        of_option([&] { return parse_provenance(arguments.provenance, "--provenance"); });
  }
  ProbeShape& probe = options.header.probe;
  if (!arguments.probe_diameter.empty()) {
    probe.diameter_m = positive(arguments.probe_diameter, Dimension::length, "--probe-diameter");
  }
  if (probe.diameter_m || !probe.shape.empty()) {
    probe.provenance = options.provenance.value_or(Provenance::measured);
  }
  return options;
}

/// A file name from any text: letters, digits and '_'.
std::string file_stem(std::string_view text) {
  std::string stem;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_';
    if (plain) {
      stem += c;
    } else if (!stem.empty() && stem.back() != '_') {
      stem += '_';
    }
  }
  while (!stem.empty() && stem.back() == '_') stem.pop_back();
  return stem.empty() ? "curve" : stem;
}

/// One curve on its way to the disk.
struct Target {
  std::string source;
  fs::path csv;
  ImportedCurve curve;
};

void name_target(Target& target, const fs::path& stem) {
  CurveHeader& header = target.curve.description.header;
  header.id = stem.filename().string();
  if (header.title.empty()) {
    header.title = target.curve.name.empty() ? header.id : printable(target.curve.name, 200);
  }
  const std::string origin = "imported from " + fs::path(target.source).filename().string();
  header.note += (header.note.empty() ? "" : "; ") + printable(origin, 200);
  target.csv = stem.string() + ".csv";
}

/// The name --output of one curve, or the curve's own in --folder.
fs::path stem_of(const ImportArguments& arguments, const std::string& source,
                 const std::string& curve_name, std::size_t index, std::size_t of) {
  if (!arguments.output.empty()) {
    if (arguments.files.size() > 1 || of > 1) {
      throw Error(ExitCode::usage, "--output", "is one file for several curves", "--folder");
    }
    const fs::path single = arguments.output;
    const bool ending = single.extension() == ".csv" || single.extension() == ".json";
    return ending ? fs::path(single).replace_extension() : single;
  }
  std::string name = file_stem(fs::path(source).stem().string());
  if (of > 1) name += fmt::format("_{}_{}", index + 1, file_stem(curve_name));
  return fs::path(arguments.folder) / name;
}

std::vector<Target> plan(const ImportArguments& arguments, const ImportOptions& options) {
  std::vector<Target> targets;
  std::set<fs::path> taken;
  for (const std::string& file : arguments.files) {
    std::vector<ImportedCurve> curves = import_curves(file, options);
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const fs::path stem = stem_of(arguments, file, curves[i].name, i, curves.size());
      targets.push_back({file, {}, std::move(curves[i])});
      name_target(targets.back(), stem);
      if (!taken.insert(targets.back().csv).second) {
        throw bad_input(file, fmt::format("a second curve for {}", targets.back().csv.string()),
                        "files of different names");
      }
    }
  }
  return targets;
}

void require_free(const std::vector<Target>& targets) {
  for (const Target& target : targets) {
    for (const fs::path& path : {target.csv, fs::path(target.csv).replace_extension(".json")}) {
      if (fs::exists(path)) {
        throw Error(ExitCode::usage, path.string(), "the file exists",
                    "another name, or --overwrite");
      }
    }
  }
}

/// A fit of the first recording or spectrum; of other curves the curve. The command that writes
/// them, if nothing was written.
std::string next_of_import(const std::vector<Target>& targets, bool written,
                           const Session& session) {
  if (!written) return same_command(session, "--folder imported");
  const auto fitted = std::ranges::find_if(targets, [](const Target& target) {
    const std::string& kind = target.curve.description.kind;
    return kind == "recording" || kind == "spectrum";
  });
  return fitted != targets.end() ? "tpm fit " + shell_word(fitted->csv.string())
                                 : "tpm data show " + shell_word(targets.front().csv.string());
}

void print_text(const std::vector<Target>& targets, bool written, const std::string& next) {
  for (const Target& target : targets) {
    say("{} -> {}\n", target.source,
        written ? target.csv.string() : "nothing written: no --output or --folder");
    for (const ImportFinding& finding : target.curve.findings) {
      say("  {}: {}\n", finding.what, finding.value);
    }
  }
  say("{}", next_line(next));
}

void print_json(const Session& session, const std::vector<Target>& targets, bool written,
                const std::string& next) {
  const Json report = array_json(targets, [&](const Target& target) {
    Json understood = Json::object();
    for (const ImportFinding& finding : target.curve.findings)
      understood[finding.what] = finding.value;
    return Json{{"source", target.source},
                {"csv", written ? Json(target.csv.string()) : Json(nullptr)},
                {"id", target.curve.description.header.id},
                {"understood", understood}};
  });
  std::vector<std::string> files;
  for (const Target& target : targets) {
    if (!written) break;
    files.push_back(target.csv.string());
    files.push_back(fs::path(target.csv).replace_extension(".json").string());
  }
  Json json{{"curves", report}};
  add_end(json, {}, files, next);
  say("{}", answer_text(session, std::move(json)));
}

void write_curves(const std::vector<Target>& targets) {
  for (const Target& target : targets) {
    const Json description = description_json(target.curve.description);
    (void)checked(description, curve_kind(), target.csv.string());
    write_file(target.csv, target.curve.csv);
    write_file(fs::path(target.csv).replace_extension(".json"), to_text(description));
  }
}

/// Nothing is written before every file was understood, and nothing at all without --output or
/// --folder.
int import_files(const Session& session, const ImportArguments& arguments) {
  const bool write = !arguments.output.empty() || !arguments.folder.empty();
  const std::vector<Target> targets = plan(arguments, options_of(arguments));
  for (const Target& target : targets) {
    if (write) will_write({target.csv, fs::path(target.csv).replace_extension(".json")});
  }
  if (write && !arguments.force) require_free(targets);
  if (write) write_curves(targets);
  const std::string next = next_of_import(targets, write, session);
  session.json() ? print_json(session, targets, write, next) : print_text(targets, write, next);
  return 0;
}

void add_text_options(CLI::App& command, ImportArguments& a) {
  const std::vector<std::string> formats = import_formats();
  command
      .add_option("--input-format", a.options.format,
                  fmt::format("Format of the file: {}", fmt::join(formats, ", ")))
      ->check(one_of_words(formats));
}

void add_machine_options(CLI::App& command, ImportArguments& a) {
  const char* group = "Testing machines and force curves";
  add_reading_options(command, a.reading, group);
  const auto add = options_of_group(command, group);
  add("--contact-force", a.contact_force,
      "Force at which contact begins, such as \"0.05 N\": start time and depth there");
  add("--contact-samples", a.contact_samples, "Samples in a row that must reach it (3)");
}

void add_figure_options(CLI::App& command, ImportArguments& a) {
  const auto add = options_of_group(command, "Digitised figures");
  add("--x-quantity", a.x, "What the x axis shows, such as time:s or indentation_depth:mm");
  add("--y-quantity", a.y, "What the y axis shows, such as contact_force:N");
  add("--dataset", a.options.dataset, "Only the dataset of this name");
  add("--depth", a.depth, "Depth of the indentation: of a relaxation curve, such as \"4 mm\"");
  add("--load", a.load, "Imposed load of a creep curve, such as \"0.98 N\"");
  add("--time-origin", a.time_origin,
      "Event from which times count: end_of_ramp or load_applied; with --depth or --load")
      ->each(reads_word(parse_time_origin, "--time-origin"));
}

void add_description_options(CLI::App& command, ImportArguments& a) {
  const auto add = options_of_group(command, "Description");
  add("--provenance", a.provenance,
      "Provenance of the numbers (default: measured for machines, digitized for figures)")
      ->each(reads_word(parse_provenance, "--provenance"));
  add("--title", a.options.header.title, "One line that says what the curve is");
  add("--citation", a.options.header.citation, "Publication: authors, journal, year, pages");
  add("--doi", a.options.header.doi, "DOI of the publication, without https://doi.org/");
  add("--specimen", a.options.header.specimen, "What was tested");
  add("--probe-shape", a.options.header.probe.shape,
      "Shape of the probe: hemisphere, sphere, flat punch or cone");
  add("--probe-diameter", a.probe_diameter, "Diameter of the probe, such as \"4 mm\"");
  add("--note", a.options.header.note, "Note for the reader of the curve");
}

}  // namespace

void add_data_import_command(CLI::App& data, Session& session) {
  CLI::App* command = data.add_subcommand(
      "import", "Import digitised figures, machine exports and JPK force files");
  auto arguments = std::make_shared<ImportArguments>();
  command->add_option("files", arguments->files, "Files to import; sheets as several files")
      ->required();
  command->add_option(
      "-o,--output", arguments->output,
      "File to write (.csv, a description goes beside it); of several curves --folder. Without "
      "either the files are only read, and what was understood is printed");
  add_folder_option(*command, arguments->folder, ": of several curves")->excludes("--output");
  command->add_flag("--overwrite", arguments->force, "Replace files that exist");
  add_text_options(*command, *arguments);
  add_machine_options(*command, *arguments);
  add_figure_options(*command, *arguments);
  add_description_options(*command, *arguments);
  add_format_option(*command, session);
  command->footer(
      "Examples:\n"
      "  tpm data import export.csv -o mine/liver --contact-force \"0.05 N\"\n"
      "  tpm data import fig7.json -o mine/fig7 --x-quantity time:s --y-quantity contact_force:N "
      "--depth \"4 mm\" "
      "\\\n"
      "      --time-origin end_of_ramp\n"
      "  tpm data import cell.jpk-force -o mine/cell --segments extend,pause "
      "--probe-shape sphere \\\n"
      "      --probe-diameter \"10 um\"\n"
      "JSON: curves, objects with source, csv (null if not written), id and understood\n"
      "(what was found in the file); files, next");
  set_run(*command, session, [&session, arguments] { return import_files(session, *arguments); });
}

}  // namespace tpm::app
