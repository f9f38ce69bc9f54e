// Declared in tpmkit/fit.hpp.
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/petab.hpp"
#include "tpm/fit/select/file_remarks.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/fit.hpp"

namespace tpm::fit {
namespace {

std::vector<FittedParameter> fitted_parameters(const FitResult& fit) {
  std::vector<FittedParameter> list;
  for (const ParameterResult& p : fit.parameters) {
    list.push_back({.name = p.parameter.name,
                    .unit = si_unit(p.parameter),
                    .estimate = p.estimate,
                    .standard_error = p.standard_error,
                    .lower = p.lower,
                    .upper = p.upper,
                    .verdict = p.verdict,
                    .nuisance = p.nuisance,
                    .only_if_described = p.only_if_described,
                    .not_separable = p.not_separable,
                    .with_drift = p.with_drift,
                    .unconfirmed = p.unconfirmed,
                    .summary = p.summary});
  }
  return list;
}

FitSummary summary_of(const FitResult& fit) {
  FitSummary summary;
  if (!no_law_because(fit.config)) summary.law = fitted_law(fit);
  summary.chi_square = fit.chi_square;
  summary.degrees_of_freedom = fit.degrees_of_freedom;
  summary.starts_run = fit.starts_run;
  summary.starts_failed = fit.starts_failed;
  summary.starts_agreeing = fit.starts_agreeing;
  summary.parameters = fitted_parameters(fit);
  summary.adequacy = fit.adequacy;
  summary.remarks = fit.remarks;
  summary.text = to_terminal_text(fit);
  summary.json = to_text(to_json(fit));
  return summary;
}

void require_no_placement(const FitRequest& request) {
  if (!request.contact && !request.contact_force_N && !request.zero && !request.from_s &&
      !request.until_s) {
    return;
  }
  throw Error(ExitCode::usage, "contact, contact_force, zero, from, until", "with a configuration",
              "them only with recordings; a configuration says its own");
}

std::vector<PreparedRecording> prepared_recordings(const std::vector<std::filesystem::path>& files,
                                                   const FitRequest& request) {
  if (request.contact && request.contact_force_N) {
    throw Error(ExitCode::usage, "contact", "beside contact_force", "one of them");
  }
  ImportOptions import;
  import.from_s = request.from_s;
  import.until_s = request.until_s;
  PhaseOptions phases;
  phases.contact_response = request.contact_force_N;
  std::vector<PreparedRecording> recordings;
  for (const std::filesystem::path& file : files) {
    RecordingFile read = read_recording_file(file, import);
    require_time_and_drive(read, file.string());
    recordings.push_back(prepare_recording(file.string(), std::move(read.recording), phases));
    recordings.back().import = import;
    warn_of_rows_left_out(recordings.back(), read.findings);
    take_instrument(recordings.back(), file);
  }
  require_distinct_readings(recordings);
  if (request.contact) require_contact_within(*request.contact, recordings, "contact");
  return recordings;
}

}  // namespace

FitSummary fit_configuration(const std::filesystem::path& file, const FitRequest& request) {
  require_no_placement(request);
  FitProblem problem = read_fit_problem(file);
  if (request.starts) problem.config.starts = *request.starts;
  if (request.seed) problem.config.seed = *request.seed;
  problem.config.interrupted = request.interrupted;
  return summary_of(fit_and_judge(problem));
}

FitSummary fit_recordings(const std::vector<std::filesystem::path>& files,
                          const FitRequest& request) {
  const std::vector<PreparedRecording> recordings = prepared_recordings(files, request);
  SelectionOptions options;
  options.setup.contact = request.contact;
  options.setup.zero = request.zero;
  if (!request.law.empty()) options.laws = {parse_law_name(request.law, "law")};
  options.only_listed = !request.law.empty();
  if (request.starts) options.setup.starts = *request.starts;
  if (request.seed) options.setup.seed = *request.seed;
  options.setup.interrupted = request.interrupted;
  const Selection selection = select_law(recordings, options);
  FitSummary summary = summary_of(selection.candidates[selection.recommended].fit);
  if (selection.preferred) {
    const Candidate& best = selection.candidates[*selection.preferred];
    summary.preferred =
        PreferredLaw{law_name(best.law), selection.candidates[selection.recommended].delta_bic,
                     best.reason, fitted_parameters(best.fit)};
  }
  summary.remarks.insert(summary.remarks.begin(), selection.remarks.begin(),
                         selection.remarks.end());
  summary.text = to_terminal_text(selection) + "\n" + summary.text;
  summary.json = to_text(to_json(selection));
  return summary;
}

}  // namespace tpm::fit
