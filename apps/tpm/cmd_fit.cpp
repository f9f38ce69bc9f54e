#include <fmt/format.h>

#include <memory>

#include "command.hpp"
#include "tpm/core/error.hpp"
#include "tpm/fit/experiment_refit.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/tables.hpp"
#include "tpm/store/json.hpp"

namespace tpm::app {
namespace {

struct FitOptions {
  std::string config;
  std::string output;
  std::string rate;
  std::string hold_out_depth;
  std::string starts;
  std::string seed;
  std::string bootstrap;
  std::string resample;
};

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
  config.bootstrap->resampling = parse_resampling(options.resample, "--resample");
}

FitProblem configured(const FitOptions& options) {
  FitProblem problem = read_fit_problem(options.config);
  FitConfig& config = problem.config;
  if (!options.starts.empty()) config.starts = parse_whole_number(options.starts, "--starts", 1);
  if (!options.seed.empty()) config.seed = parse_whole_number(options.seed, "--seed", 0);
  configure_bootstrap(options, config);
  for (DataChoice& data : config.data) {
    if (!options.rate.empty() && data.protocol.kind == ProtocolChoice::Kind::ramp_hold) {
      data.protocol.rate_m_per_s = parse_quantity(options.rate, Dimension::speed, "--rate");
      data.protocol.rate_provenance = Provenance::assumed;
    }
    if (!options.hold_out_depth.empty()) {
      Selector selector;
      selector.depth_m = parse_quantity(options.hold_out_depth, Dimension::length, "--hold-out");
      data.hold_out.push_back(selector);
    }
  }
  return problem;
}

int fit(const FitOptions& options, const Session& session) {
  const FitResult result = run_fit(configured(options));
  const std::string text = session.json() ? to_text(to_json(result)) : to_terminal_text(result);
  deliver(text, options.output);
  return 0;
}

}  // namespace

void add_fit_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("fit", "Fit model parameters to curves, with intervals and verdicts");
  auto options = std::make_shared<FitOptions>();
  command
      ->add_option("CONFIG", options->config,
                   "JSON configuration (schemas/fit.schema.json), or a problem of tables "
                   "(schemas/fit_tables.schema.json)")
      ->required();
  command->add_option("-o,--output", options->output, "Write here instead of to the terminal");
  command->add_option("--rate", options->rate, "Assume this ramp rate instead, e.g. \"2 mm/s\"");
  command->add_option("--hold-out", options->hold_out_depth,
                      "Predict this depth instead of fitting it, e.g. \"8 mm\"");
  command->add_option("--starts", options->starts, "Number of starts");
  command->add_option("--seed", options->seed, "Seed of the random starts, 0 or more");
  command->add_option("--bootstrap", options->bootstrap,
                      "Refit this many resampled data sets, 20 or more");
  command->add_option("--resample", options->resample,
                      "What is drawn: residuals, blocks or recordings");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm fit configs/liver_relaxation.json\n"
      "  tpm fit configs/liver_relaxation.json --hold-out \"8 mm\" --format json -o fit.json");
  command->callback([options, &session] {
    session.run = [options, &session] { return fit(*options, session); };
  });
}

}  // namespace tpm::app
