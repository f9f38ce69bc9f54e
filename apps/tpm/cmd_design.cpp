// tpm design: experiments to choose from, and what simulated data say of intervals and laws.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "design_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/design/design.hpp"
#include "tpm/fit/show/design_figures.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

int rank_candidates(const DesignOptions& options, const Session& session) {
  const auto sets = static_cast<int>(parse_whole_number(
      options.repetitions.empty() ? "100" : options.repetitions, "--repetitions", 0));
  const std::uint64_t seed = design_seed(options.seed);
  const auto top = static_cast<std::size_t>(
      parse_whole_number(options.top.empty() ? "10" : options.top, "--top", 1));
  will_write_into(options.folder, {"figures.json"});
  const auto csv = csv_beside(options.output, session);
  const DesignResult result = fit::plan(read_design(options.design));
  std::optional<DesignCheck> check;
  if (sets > 0) {
    check = check_design(result.problem, result.ranked.front().experiment, sets, seed);
  }
  const DesignCheck* checked = check ? &*check : nullptr;
  std::vector<std::string> files;
  if (!options.folder.empty()) files = write_figures(options.folder, design_figures(result));
  Json json = to_json(result, checked, top);
  const std::string csv_text = json_table_csv(json.at("ranked"), "/expected/parameters");
  // The page of the figures, or what draws them.
  const std::string next =
      options.folder.empty()
          ? same_command(session, "--folder design")
          : fmt::format(
                "tpm view {}",
                shell_word((std::filesystem::path(options.folder) / "figures.json").string()));
  std::string text;
  if (session.json()) {
    add_end(json, options.folder, files, next);
    text = answer_text(session, std::move(json));
  } else if (options.verbose) {
    text = to_terminal_text(result, checked, top);
    if (!files.empty()) text += written(session, options.folder, files);
  } else {
    ShortAnswer answer = short_answer(result, checked, top);
    end_answer(answer, options.folder, files, next);
    text = to_text(answer);
  }
  deliver(text, options.output);
  deliver_csv(csv_text, csv);
  return 0;
}

/// Has data, and nothing to choose from.
bool is_fit_configuration(const std::string& file) {
  const Json document = read_json(file);
  return document.contains("data") && !document.contains("candidates");
}

/// An option that this kind of input has not.
void refuse(const char* option, bool given, const char* input, const char* expected) {
  if (given) throw Error(ExitCode::usage, option, fmt::format("with {}", input), expected);
}

int design(const DesignOptions& options, const Session& session) {
  const bool laws = !options.laws.empty() || !options.family.empty();
  if (options.design.empty() && !laws) {
    throw Error(ExitCode::usage, "FILE", "not given",
                "a design, a configuration of a fit, or --laws or --family");
  }
  if (!options.design.empty()) {
    constexpr const char* kWithoutFile = "it without a file";
    refuse("--laws", !options.laws.empty(), "a file", kWithoutFile);
    refuse("--family", !options.family.empty(), "a file", kWithoutFile);
    refuse("--noise", !options.noise.empty(), "a file", kWithoutFile);
    refuse("--order", !options.order.empty(), "a file", kWithoutFile);
    refuse("--margins", !options.margins.empty(), "a file", kWithoutFile);
    if (!is_fit_configuration(options.design)) return rank_candidates(options, session);
  }
  const char* input = options.design.empty() ? "laws" : "a configuration of a fit";
  refuse("--top", !options.top.empty(), input, "it with a design");
  refuse("--folder", !options.folder.empty(), input, "it with a design");
  refuse("--verbose", options.verbose, input, "it with a design");
  return options.design.empty() ? check_choice_of_law(options, session)
                                : check_intervals(options, session);
}

}  // namespace

void add_design_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "design",
      "Find the experiment that would identify the parameters; test the intervals of a fit, or the "
      "choice of a law, on simulated data");
  auto options = std::make_shared<DesignOptions>();
  command->add_option("FILE", options->design,
                      "A design (schemas/design.schema.json), whose best experiment is simulated; "
                      "or a configuration of tpm fit, whose start values are the true values; or "
                      "none, with --laws or --family");
  command->add_option(
      "--repetitions", options->repetitions,
      "Number of repetitions: data sets that are simulated and fitted (default: 100 of a design, "
      "2000 of a configuration, 200 of each law); of a design 0 for none, else 10 or more");
  add_seed_option(*command, options->seed, ", or 'clock': the simulations")->capture_default_str();
  add_output_option(*command, options->output);
  add_verbose_option(*command, options->verbose, "of a design, each candidate and the best pair");
  add_format_option(*command, session);
  const auto add_of_design = options_of_group(*command, "Of a design");
  add_of_design("--top", options->top, "How many to list: candidates (default 10)");
  add_of_design("--folder", options->folder, "Folder to write into: figures");
  constexpr const char* kOfLaws = "Without a file";
  command
      ->add_option("--laws", options->laws,
                   "Names of laws: only these generate data; all of the family compete")
      ->delimiter(',')
      ->group(kOfLaws);
  const auto add_of_laws = options_of_group(*command, kOfLaws);
  add_family_option(*command, options->family, kOfLaws);
  add_of_laws("--noise", options->noise,
              "Standard deviation of the force over its peak (default: 0.01)");
  add_of_laws("--order", options->order,
              "Order of the fractional elements that generate (default: 0.4)");
  command
      ->add_option("--margins", options->margins,
                   "Margins of BIC, each judging the same fits (default: that of tpm fit)")
      ->delimiter(',')
      ->group(kOfLaws);
  command->footer(
      "Intervals are those of the profile likelihood, as in tpm fit. Laws are recorded in a ramp "
      "to 5 mm\nat 5 mm/s, held 20 s, contact and offset unknown.\n"
      "Exit code 1 if a coverage differs from its level at the 0.1 % level (exact binomial test), "
      "if a law\nis not returned (nor one within one sigma of it) in 95 % of the repetitions, or "
      "a law with more\nparameters in over 5 %.\n"
      "Example:\n  tpm design configs/design_liver.json --folder out/design\n"
      "  tpm design configs/design_meat.json --repetitions 0 --format json\n"
      "  tpm design configs/coverage_absolute.json --repetitions 2000\n"
      "  tpm design --laws linear-1,power-2 --repetitions 20");
  set_run(*command, session, [options, &session] { return design(*options, session); });
}

}  // namespace tpm::app
