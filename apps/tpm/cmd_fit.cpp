#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "common_options.hpp"
#include "fit_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/file_kind.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpm/fit/petab.hpp"
#include "tpm/fit/predict/fitted_scene.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/show/fit_answer.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpm/fit/show/fit_report.hpp"
#include "tpm/fit/show/function_report.hpp"
#include "tpm/fit/show/recording_report.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// --bootstrap and --resample, over what the configuration says.
void configure_bootstrap(const FitOptions& options, FitConfig& config) {
  if (!options.bootstrap.empty()) {
    if (!config.bootstrap) {
      config.bootstrap = BootstrapOptions{};
      config.bootstrap->seed = config.seed;
      config.bootstrap->level = config.level;
    }
    constexpr std::uint64_t kFewest = 20;
    config.bootstrap->replicates =
        static_cast<int>(parse_whole_number(options.bootstrap, "--bootstrap", kFewest));
  }
  if (options.resample.empty()) return;
  if (!config.bootstrap) {
    throw Error(ExitCode::usage, "--resample", "without a bootstrap", "--bootstrap N");
  }
  config.bootstrap->resampling =
      of_option([&] { return parse_resampling(options.resample, "--resample"); });
}

FitProblem configured(const FitOptions& options) {
  FitProblem problem = read_fit_problem(options.recordings.files.front());
  FitConfig& config = problem.config;
  if (!options.starts.empty()) config.starts = parse_whole_number(options.starts, "--starts", 1);
  if (!options.seed.empty()) config.seed = parse_whole_number(options.seed, "--seed", 0);
  configure_bootstrap(options, config);
  for (DataChoice& data : config.data) {
    if (!options.rate.empty() && data.protocol.kind == ProtocolChoice::Kind::ramp_hold) {
      data.protocol.rate_m_per_s = option_quantity(options.rate, Dimension::speed, "--rate");
      data.protocol.rate_provenance = Provenance::assumed;
    }
    if (!options.hold_out_depth.empty()) {
      Selector selector;
      selector.depth_m = option_quantity(options.hold_out_depth, Dimension::length, "--hold-out");
      data.hold_out.push_back(selector);
    }
  }
  return problem;
}

/// The JSON description of a curve says what kind it is; any other JSON file is a configuration.
bool is_configuration(const std::vector<std::string>& files) {
  if (files.size() != 1 || !files.front().ends_with(".json")) return false;
  const Json document = read_json(files.front());
  if (const auto other = find_other_document(document)) {
    throw bad_input(files.front(), other->what, other->expected);
  }
  return !document.contains("kind");
}

/// The page of what the run has written: a fit, with intervals and verdicts, the law, or its
/// figures.
std::string next_of_law(const std::string& folder, const std::vector<std::string>& files) {
  const auto wrote = [&files](const char* name) {
    return std::ranges::find(files, name) != files.end();
  };
  if (files.empty()) return {};
  if (wrote("selection.json") || wrote("answer.json"))
    return fmt::format("tpm view {}", shell_word(folder));
  if (!wrote("law.json")) return next_of_figures(folder);
  return fmt::format("tpm view {}",
                     shell_word((std::filesystem::path(folder) / "law.json").string()));
}

/// Of a fit with an organ: the organ with its material, and a session that feels it.
void write_scene(const std::filesystem::path& folder, const FitResult& fit,
                 std::vector<std::string>& files) {
  const std::optional<FittedScene> fitted = fitted_scene(fit);
  if (!fitted) return;
  write_file(folder / "scene.json", to_text(fitted->scene));
  write_file(folder / "session.json", to_text(fitted->session));
  files.insert(files.end(), {"scene.json", "session.json"});
}

int fit_configuration(const FitOptions& options, const Session& session) {
  const auto csv = csv_beside(options.output, session);
  if (!options.no_draw)
    will_write_into(options.folder, {"figures.json", "law.json", "answer.json", "fit.html"});
  const FitResult result = fit_and_judge(configured(options));
  std::string text = to_terminal_text(result);
  if (result.adequacy) text = result.adequacy->summary + "\n\n" + text;
  std::vector<std::string> files;
  if (!options.folder.empty() && !options.no_draw) {
    files = write_fit_report(options.folder, result);
    write_scene(options.folder, result, files);
  }
  const std::string& config = options.recordings.files.front();
  text = answer_with_files(
      options, session, to_json(result), std::move(text), short_answer(result), options.folder,
      files,
      files.empty() ? fmt::format("tpm fit {} --folder {}_fit", shell_word(config),
                                  shell_word(std::filesystem::path(config).stem().string()))
                    : next_of_law(options.folder, files));
  deliver(text, options.output);
  deliver_csv(parameters_csv(result), csv);
  return 0;
}

int fit_recordings(const FitOptions& options, const std::vector<PreparedRecording>& recordings,
                   const Session& session) {
  const auto csv = csv_beside(options.output, session);
  announce_figures(options, recordings.front().name,
                   {"figures.json", "config.json", "selection.json", "law.json", "fit.html"});
  SelectionOptions choices = selection_options(options);
  require_indentation(options, recordings);
  set_reference(options, recordings, choices);
  hold_placement(options.placement, options.recordings, recordings, choices.setup.contact,
                 choices.setup.zero);
  const Selection selection = select_law(recordings, choices);
  const FitResult& best = selection.candidates[selection.recommended].fit;
  std::optional<YoungModuli> moduli;
  if (const auto probe = probe_of(options)) {
    moduli = young_moduli(best, *probe, options.poisson.empty());
  }
  std::string text;
  if (best.adequacy && best.adequacy->is_rejected()) text += best.adequacy->summary + "\n";
  for (const PreparedRecording& r : recordings) {
    if (!r.read_as.empty()) text += fmt::format("{}\n", r.read_as);
    for (const std::string& words : r.phases.summary) text += fmt::format("{}\n", words);
  }
  text += fmt::format("\n{}\n{}", to_terminal_text(selection), to_terminal_text(best));
  Json json = to_json(selection);
  append_moduli(json, text, moduli);
  const std::string folder = figure_folder(options, recordings.front().name);
  std::vector<std::string> files;
  if (!options.no_draw) {
    files = write_recording_report(folder, selection);
    write_moduli(folder, moduli, files);
  }
  ShortAnswer answer = short_answer(selection);
  for (const PreparedRecording& r : recordings) {
    if (!r.read_as.empty()) answer.conclusion.insert(answer.conclusion.begin(), r.read_as);
  }
  if (moduli) add_moduli(answer, *moduli);
  text = answer_with_files(options, session, std::move(json), std::move(text), std::move(answer),
                           folder, files, next_of_law(folder, files));
  deliver(text, options.output);
  deliver_csv(parameters_csv(best), csv);
  return 0;
}

/// A spectrum, a relaxation modulus or a creep compliance, without a configuration.
int fit_function(const FitOptions& options, const MaterialFunction& function,
                 const Session& session) {
  const auto csv = csv_beside(options.output, session);
  announce_figures(options, function.name,
                   {"figures.json", "config.json", "selection.json", "law.json", "fit.html"});
  const Selection selection = select_law(function, selection_options(options));
  const FitResult& best = selection.candidates[selection.recommended].fit;
  std::string text =
      fmt::format("{}{}{}\n{}", function.read_as, function.read_as.empty() ? "" : "\n",
                  to_terminal_text(selection), to_terminal_text(best));
  const std::string folder = figure_folder(options, function.name);
  std::vector<std::string> files;
  if (!options.no_draw) files = write_function_report(folder, function, selection);
  ShortAnswer answer = short_answer(selection);
  if (!function.read_as.empty())
    answer.conclusion.insert(answer.conclusion.begin(), function.read_as);
  text = answer_with_files(options, session, to_json(selection), std::move(text), std::move(answer),
                           folder, files, next_of_law(folder, files));
  deliver(text, options.output);
  deliver_csv(parameters_csv(best), csv);
  return 0;
}

int fit(const FitOptions& options, const Session& session) {
  const std::vector<std::string>& files = options.recordings.files;
  if (options.compare) return compare_folders(options, session);
  if (files.size() == 2 && std::filesystem::is_directory(files[0]) &&
      std::filesystem::is_directory(files[1])) {
    throw Error(ExitCode::usage, "FILE", "two folders", "--compare beside them, or one folder");
  }
  if (is_configuration(files)) {
    const bool chooses = !options.laws.empty() || !options.family.empty() ||
                         !options.margin.empty() || options.no_held_out || options.no_profiles;
    if (!options.reference.empty() || !options.times.empty() || !options.group_by.empty() ||
        !options.placement.contact.empty() || !options.placement.zero.empty() || chooses ||
        probe_of(options)) {
      throw Error(ExitCode::usage,
                  "--laws, --family, --margin, --no-held-out, --no-profiles, --reference, --times, "
                  "--group-by, --contact, --zero, --radius, --cone-angle, --punch-radius",
                  "with a configuration",
                  "them only with recordings; a configuration has its own reference and fixed "
                  "parameters");
    }
    return fit_configuration(options, session);
  }
  if (!options.rate.empty() || !options.hold_out_depth.empty()) {
    throw Error(ExitCode::usage, "--rate, --hold-out", "without a configuration",
                "them only with a CONFIG.json");
  }
  if (files.size() == 1 && std::filesystem::is_directory(files.front())) {
    return fit_folder(options, session);
  }
  if (!options.group_by.empty()) {
    throw Error(ExitCode::usage, "--group-by", "without a folder of recordings",
                "it only with one folder");
  }
  if (files.size() == 1) {
    // A pipe can be read only once.
    const ImportOptions import = import_options(options.recordings);
    MeasuredFile measured = read_measured_file(files.front(), import);
    const auto function = material_function_of(files.front(), import, measured);
    if (function && probe_of(options)) {
      throw Error(ExitCode::usage, "--radius, --cone-angle, --punch-radius",
                  fmt::format("with a {}", function->kind()),
                  "them with a contact force over an indentation depth");
    }
    if (function) return fit_function(options, *function, session);
    return fit_recordings(
        options,
        {prepared(files.front(), std::get<RecordingFile>(std::move(measured)), options.recordings)},
        session);
  }
  std::vector<PreparedRecording> recordings = read_recordings(options.recordings);
  require_distinct_readings(recordings);
  return fit_recordings(options, std::move(recordings), session);
}

}  // namespace

void add_fit_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("fit", "Fit model parameters to curves, with intervals and verdicts");
  auto options = std::make_shared<FitOptions>();
  command
      ->add_option("FILE", options->recordings.files,
                   "A configuration (schemas/fit.schema.json), a problem of tables "
                   "(schemas/fit_tables.schema.json), recordings to be fitted together, a spectrum "
                   "(G', G''; |G*| and delta), a relaxation modulus G(t) or compliance J(t), or "
                   "a folder of recordings to be fitted one by one and pooled")
      ->required();
  constexpr const char* kChoice = "The choice of a law for recordings";
  command
      ->add_option(
          "--laws", options->laws,
          "Names of laws: fit this one, e.g. power-2, or choose among these, e.g. linear-1,power-2 "
          "(default: the simplest of the family that the recordings support)")
      ->delimiter(',')
      ->group(kChoice);
  const auto add_choice = options_of_group(*command, kChoice);
  add_family_option(*command, options->family, kChoice);
  add_choice("--margin", options->margin,
             "BIC that a larger law must gain to be preferred (default: 3)");
  command
      ->add_flag("--no-held-out", options->no_held_out,
                 "Leave out the predictions of held-out data")
      ->group(kChoice);
  command
      ->add_flag(
          "--no-profiles", options->no_profiles,
          "Leave out the likelihood profiles of the chosen law: its intervals are linearised")
      ->group(kChoice);
  command->add_option("--times", options->times,
                      "Relaxation times that are not fitted: \"0.1 s, 1 s, 10 s\", or \"1 ms : "
                      "1000 s : 13\" for 13 at equal ratios (law linear-13 unless --laws says)");
  CLI::Option* folder = add_folder_option(
      *command, options->folder,
      ": figures and files (default: NAME_fit for recordings, none for a configuration)");
  add_verbose_option(*command, options->verbose, "every law tried, starts, readings");
  command->add_flag("--no-draw", options->no_draw, "Write no figures and no files")
      ->excludes(folder);
  add_recording_options(*command, options->recordings);
  add_placement_options(*command, options->placement);
  command->add_option("-o,--output", options->output, "File to write (default: the terminal)");
  const auto add_of_configuration = options_of_group(*command, "Of a configuration");
  add_of_configuration(
      "--rate", options->rate,
      "Speed of the ramp, assumed instead of that of the configuration, e.g. \"2 mm/s\"");
  add_of_configuration("--hold-out", options->hold_out_depth,
                       "Depth that is predicted instead of fitted, e.g. \"8 mm\"");
  add_of_configuration("--bootstrap", options->bootstrap,
                       "Refit this many resampled data sets, 20 or more");
  add_of_configuration("--resample", options->resample,
                       "What is resampled: residuals, blocks or recordings")
      ->each(reads_word(parse_resampling, "--resample"));
  command->add_option("--starts", options->starts,
                      "Number of starts (default: that of the configuration, else 50)");
  add_seed_option(*command, options->seed,
                  ": the starts (default: that of the configuration, else 0)");
  command->add_option("--reference", options->reference,
                      "Depth that coefficients refer to: as secants, e.g. \"4 mm\"; of recordings "
                      "(default: the largest; of a folder the largest that all reach)");
  command->add_option("--group-by", options->group_by,
                      "How the specimens of a folder are told apart: a pattern of the file names "
                      "with one group, e.g. \"(liver[0-9]+)_\", or a column or key of the files");
  command->add_flag("--compare", options->compare,
                    "Compare two folders: ratio of each parameter, and of Young's moduli, with "
                    "interval and test");
  add_format_option(*command, session);
  const auto add_probe = options_of_group(*command, "Young's modulus of an indentation, in Pa");
  add_probe("--radius", options->radius,
            "Radius of the sphere that was pressed in, for Young's modulus (Hertz), e.g. \"2 mm\"");
  add_probe("--cone-angle", options->cone_angle,
            "Angle between axis and surface of a cone, e.g. \"45 deg\" (Sneddon)");
  add_probe("--punch-radius", options->punch_radius, "Radius of a flat punch (Sneddon)");
  add_probe("--poisson", options->poisson, "Poisson's ratio, 0 to 0.5 (default 0.49, assumed)");
  command->footer(
      "Example:\n  tpm fit configs/liver_relaxation.json\n"
      "  tpm fit meat.csv\n  tpm fit slow.csv fast.csv --laws linear-1,linear-2,power-2 --verbose\n"
      "  tpm fit liver.csv --radius \"2 mm\" --poisson 0.5\n  tpm fit "
      "folder_of_recordings --laws power-2\n"
      "  tpm fit healthy/ fibrotic/ --compare --radius \"2 mm\"\n"
      "  tpm fit configs/liver_relaxation.json --hold-out \"8 mm\" --format json -o fit.json");
  set_run(*command, session, [options, &session] { return fit(*options, session); });
}

}  // namespace tpm::app
