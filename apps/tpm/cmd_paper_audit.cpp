// tpm paper audit: recomputes what a paper prints.

#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "tpm/files/json.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/show/study_report.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::app {
namespace {

struct AuditOptions {
  std::string claims;
  std::string output;
  bool verbose = false;
};

/// Command that writes the claims with figures into a report; empty for other claims.
std::string next_of_audit(const AuditOptions& options) {
  return options.claims.empty() ? "tpm paper report --folder paper" : "";
}

std::string audit_answer(const AuditReport& report, const AuditOptions& options) {
  if (options.verbose) return audit_text(report);
  ShortAnswer answer = short_answer(report);
  end_answer(answer, "", {}, next_of_audit(options));
  return to_text(answer);
}

int run_command(const Session& session, const AuditOptions& options) {
  const auto path =
      options.claims.empty() ? paper_claims_path() : std::filesystem::path(options.claims);
  const auto csv = csv_beside(options.output, session);
  const AuditReport report = run_audit(read_json(path), path.filename().string());
  Json json = to_json(report);
  add_end(json, {}, {}, next_of_audit(options));
  deliver(session.json() ? answer_text(session, json) : audit_answer(report, options),
          options.output);
  deliver_csv(json_table_csv(json.at("findings"), "/details"), csv);
  return 0;
}

}  // namespace

void add_audit_command(CLI::App& paper, Session& session) {
  CLI::App* command = paper.add_subcommand(
      "audit", "Recompute every claim of a paper from its own equations and numbers");
  const auto options = std::make_shared<AuditOptions>();
  command->add_option("claims", options->claims,
                      "Claims file (default: the paper's, data/paper_claims.json)");
  add_output_option(*command, options->output);
  add_verbose_option(*command, options->verbose, "every claim with numbers, inputs and causes");
  add_format_option(*command, session);
  command->footer(
      "Findings are results, not errors: the exit code is 0 when the audit ran.\n"
      "Example:\n  tpm paper audit --verbose\n  tpm paper audit my_claims.json --format json "
      "--output "
      "audit.json");
  set_run(*command, session, [&session, options] { return run_command(session, *options); });
}

}  // namespace tpm::app
