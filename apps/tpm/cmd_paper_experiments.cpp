// tpm paper experiments: the paper's experiments on the star and on organs, fitted and compared.

#include <chrono>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/require_exists.hpp"
#include "tpm/files/writable.hpp"
#include "tpm/paper/show/organ_study_report.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::app {
namespace {

struct ExperimentsOptions {
  std::string config;
  std::string folder = "out/experiments";
};

int experiments(const ExperimentsOptions& options, const Session& session) {
  const std::string python = find_drawing_python();  // before minutes of work, not after
  const std::filesystem::path path = options.config.empty()
                                         ? share_dir() / "configs" / "organ_experiments.json"
                                         : std::filesystem::path(options.config);
  require_exists(path);  // no folder is left for nothing
  require_writable_folder(options.folder);
  will_write_into(options.folder,
                  {"report.md", "report.html", "experiments.json", "readings.csv", "fits.csv",
                   "curves.csv", "figures.json", "report.run.json"},
                  session.folder_naming());
  const OrganStudyConfig config = read_organ_study(path);
  const auto start = std::chrono::steady_clock::now();
  const OrganStudy study = run_organ_study(config);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  write_organ_study(study, options.folder, python, took.count());
  const std::vector<std::string> files{"report.html",
                                       "report.md",
                                       "experiments.json",
                                       "readings.csv",
                                       "fits.csv",
                                       "curves.csv",
                                       python.empty() ? "figures.json" : "figures"};
  const std::string next = next_of_pictures(options.folder);
  if (session.json()) {
    Json json = to_json(study);
    add_end(json, options.folder, files, next);
    say("{}", answer_text(session, std::move(json)));
    return 0;
  }
  for (const std::string& sentence : cost_sentences(study)) say("- {}\n", sentence);
  say("written to {}: {}\n{}", options.folder, fmt::join(files, ", "), next_line(next));
  return 0;
}

}  // namespace

void add_experiments_command(CLI::App& paper, Session& session) {
  CLI::App* command = paper.add_subcommand(
      "experiments", "The paper's experiments on the star and on organs: fits, curves, one report");
  auto options = std::make_shared<ExperimentsOptions>();
  command->add_option("CONFIG", options->config,
                      "Tissues, data and experiments (schemas/organ_experiments.schema.json; "
                      "default: configs/organ_experiments.json)");
  add_folder_option(*command, options->folder)->capture_default_str();
  add_format_option(*command, session);
  command->footer("Example:\n  tpm paper experiments --folder out/experiments");
  set_run(*command, session, [options, &session] { return experiments(*options, session); });
}

}  // namespace tpm::app
