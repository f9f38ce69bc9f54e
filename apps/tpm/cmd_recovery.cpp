#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "command.hpp"
#include "recording_options.hpp"
#include "tpm/fit/design/recovery.hpp"
#include "tpm/fit/show/fit_csv.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct RecoveryCommandOptions {
  std::vector<std::string> laws;
  std::string family = "classical";
  std::string trials = "200";
  std::string noise = "0.01";
  std::string seed = "0";
  std::string order = "0.4";
  std::vector<std::string> margins;
  std::string output;
};

double parse_noise(const std::string& text) {
  const double noise = option_number(text, "--noise");
  if (noise > 0.0 && noise < 1.0) return noise;
  throw Error(ExitCode::usage, "--noise", fmt::format("'{}'", printable(text)),
              "a part of the peak above 0 and below 1");
}

double parse_order(const std::string& text) {
  const double order = option_number(text, "--order");
  if (order > 0.0 && order < 1.0) return order;
  throw Error(ExitCode::usage, "--order", fmt::format("'{}'", printable(text)),
              "an order of a fractional element above 0 and below 1");
}

Json results_json(const std::vector<RecoveryResult>& results) {
  const auto law = [](const RecoveryResult& result) { return tpm::fit::to_json(result); };
  return Json{{"laws", array_json(results, law)}};
}

int recovery(const RecoveryCommandOptions& options, const Session& session) {
  RecoveryOptions study;
  study.noise = parse_noise(options.noise);
  study.trials = static_cast<int>(parse_whole_number(options.trials, "--trials", 1));
  study.seed = parse_whole_number(options.seed, "--seed", 0);
  for (const std::string& margin : options.margins) {
    study.margins.push_back(option_number(margin, "--margin"));
  }
  study.selection.laws = chosen_laws({}, options.family);
  const double order = parse_order(options.order);
  const auto csv = csv_beside(options.output, session);
  std::vector<RecoveryResult> results;
  for (const LawSpec& law : chosen_laws(options.laws, options.family)) {
    results.push_back(recover(law, visible_parameters(law, order), study));
  }
  deliver(session.json() ? to_text(results_json(results)) : to_terminal_text(results),
          options.output);
  deliver_csv(recovery_csv(results), csv);
  return exit_code(std::ranges::all_of(results, &RecoveryResult::fulfilled));
}

}  // namespace

void add_recovery_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "recovery",
      "Check the selection of a law by simulation: does it return the law behind the "
      "data, and do the intervals contain the true values?");
  auto options = std::make_shared<RecoveryCommandOptions>();
  command
      ->add_option("--laws", options->laws,
                   "Only these laws generate data; all of the family compete")
      ->delimiter(',');
  add_family_option(*command, options->family);
  command->add_option("--trials", options->trials, "Simulated recordings of each law")
      ->capture_default_str();
  command->add_option("--noise", options->noise, "Standard deviation of the force over its peak")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the noise")->capture_default_str();
  command->add_option("--order", options->order, "Order of the fractional elements that generate")
      ->capture_default_str();
  command->add_option("-o,--output", options->output, "Write here instead of to the terminal");
  command
      ->add_option("--margin", options->margins,
                   "Margins of BIC, each judging the same fits (default: that of tpm select)")
      ->delimiter(',');
  add_format_option(*command, session);
  command->footer(
      "Intervals are those of the profile likelihood, as in tpm fit.\n"
      "A ramp to 5 mm at 5 mm/s, held 20 s, contact and offset unknown.\n"
      "Exit code 1 if a law is not returned (nor one within one sigma of it) in 95 % of the "
      "trials,\n"
      "or a law with more parameters in over 5 %.\n"
      "Example:\n  tpm recovery --laws linear-1,power-2 --trials 20");
  set_run(*command, session, [options, &session] { return recovery(*options, session); });
}

}  // namespace tpm::app
