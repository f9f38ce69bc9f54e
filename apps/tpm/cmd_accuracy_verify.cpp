// tpm accuracy verify: what the program computes beside what is known otherwise.
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/accuracy/show/verification_report.hpp"
#include "tpm/files/writable.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct VerificationChoice {
  std::vector<std::string> groups;
  std::string folder;
  std::string flaw;
  bool list = false, verbose = false;
};

int list_groups(const Session& session) {
  Json json = Json::array();
  for (const VerificationGroup& group : verification_groups()) {
    json.push_back({{"name", group.name}, {"summary", group.summary}});
    if (!session.json()) say("{:<13} {}\n", group.name, group.summary);
  }
  if (session.json()) say("{}", answer_text(session, Json{{"groups", std::move(json)}}));
  return 0;
}

int verify_program(const VerificationChoice& choice, const Session& session) {
  if (choice.list) return list_groups(session);
  const double flaw = choice.flaw.empty() ? 0.0 : parse_share(choice.flaw, "--flaw");
  const std::vector<VerificationGroup> groups = chosen_groups(choice.groups);
  if (!choice.folder.empty()) require_writable_folder(choice.folder);
  const auto start = std::chrono::steady_clock::now();
  std::size_t count = 0;
  for (const VerificationGroup& group : groups) count += group.checks().size();
  Progress progress("verifying", count);
  const VerificationRun verification = run_verification(groups, flaw, [&] { progress.advance(); });
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  if (!choice.folder.empty()) write_verification(verification, choice.folder, took.count());
  std::vector<std::string> files;
  std::string next = same_command(session, "--folder verification");
  if (!choice.folder.empty()) {
    files = {"report.html", "report.md", "verification.json", "verification.csv"};
    next.clear();
  }
  if (session.json()) {
    Json json = to_json(verification);
    add_end(json, choice.folder, files, next);
    say("{}", answer_text(session, std::move(json), {{"checks_hold", verification.failed() == 0}}));
  } else {
    for (const VerificationLine& line :
         choice.verbose ? verification_lines(verification) : brief_lines(verification)) {
      line.failed ? write_alarming(line.text) : write_output(line.text);
    }
    say("{}{}", files.empty() ? "\n" : written(session, choice.folder, files),
        choice.verbose ? next_line(next) : end_line(next) + "\n");
  }
  return exit_code(verification.failed() == 0);
}

}  // namespace

void add_verify_command(CLI::App& accuracy, Session& session) {
  CLI::App* command = accuracy.add_subcommand(
      "verify",
      "Orders of convergence, certified problems, closed forms, energy: does tpm compute what it "
      "must?");
  auto choice = std::make_shared<VerificationChoice>();
  command->add_option("GROUP", choice->groups, "Groups of checks (default: all; see --list)");
  add_folder_option(*command, choice->folder);
  command->add_option("--flaw", choice->flaw,
                      "Make one coefficient of everything that is verified wrong by this share, "
                      "such as 1%, to see that the checks fail");
  command->add_flag("--list", choice->list, "List what can be named, and do nothing: the groups");
  add_verbose_option(*command, choice->verbose, "every check, with its reference");
  add_format_option(*command, session);
  command->footer(
      "Exit code 1 if a check fails; its lines are red on a terminal.\nExamples:\n"
      "  tpm accuracy verify\n"
      "  tpm accuracy verify regression --format json\n"
      "  tpm accuracy verify --folder verification\n"
      "  tpm accuracy verify closed-forms --flaw 1%");
  set_run(*command, session, [choice, &session] { return verify_program(*choice, session); });
}

}  // namespace tpm::app
