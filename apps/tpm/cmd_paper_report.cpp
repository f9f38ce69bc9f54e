
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/paper/show/paper_report.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::app {
namespace {

int report(const std::string& folder, double requirement, const Session& session) {
  will_write_into(folder,
                  {"report.html", "report.md", "audit.json", "validation.json", "figures.json"},
                  session.folder_naming());
  const std::string python = find_drawing_python();  // before minutes of work, not after
  const PaperReport paper = make_paper_report(requirement);
  write_paper_report(paper, folder, python);
  for (const std::string& sentence : summary_sentences(paper)) say("- {}\n", sentence);
  say("written to {}: report.html, report.md, tables.*, audit.json, fit_*.json, validation.json, "
      "{}\n{}",
      folder, python.empty() ? "figures.json" : "figures", next_line(next_of_pictures(folder)));
  return 0;
}

}  // namespace

void add_report_command(CLI::App& paper, Session& session) {
  CLI::App* command = paper.add_subcommand(
      "report", "Recompute the paper: tables, audit, fits and figures in one report");
  auto folder = std::make_shared<std::string>("out/paper");
  add_folder_option(*command, *folder)->capture_default_str();
  auto requirement = std::make_shared<std::string>("10%");
  command
      ->add_option("--require", *requirement,
                   "Largest model error that is acceptable: a share of the measured value (the "
                   "section on validation)")
      ->capture_default_str();
  command->footer(
      "Example:\n  tpm paper report --folder out/paper\n  tpm paper report --require 20%");
  set_run(*command, session, [folder, requirement, &session] {
    const double share = parse_share(*requirement, "--require");
    if (!(share > 0.0 && share < 1.0)) {
      throw Error(ExitCode::usage, "--require", fmt::format("'{}'", printable(*requirement)),
                  "a share above 0 and below 100 %");
    }
    return report(*folder, share, session);
  });
}

}  // namespace tpm::app
