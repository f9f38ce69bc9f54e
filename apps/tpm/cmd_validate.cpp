// tpm validate: a fitted law against recordings that it has not seen.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "plan_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/file_roles.hpp"
#include "tpm/files/instrument.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/other_kind.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/show/credibility_page.hpp"
#include "tpm/fit/show/validation_report.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/verify/session_presses.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

constexpr const char* kSessionEnds = ".tpmrec";

struct ValidateOptions {
  std::string law;  ///< or organ
  std::string session;
  bool plan = false, new_specimen = false;
  PlanChoice planned;
  RecordingOptions recordings;
  std::vector<std::string> quantities;
  std::string requirement, placement = "held", instrument, calibration_instrument, at;
  std::string folder, output;
  std::string credibility, recheck;
  std::vector<std::string> evidence;
  CredibilitySummary summary;
};

/// The block of a file that holds it alone or under "instrument".
Json instrument_block(const std::string& file) {
  const Json json = read_json(file);
  return json.is_object() && json.contains("instrument") ? json.at("instrument") : json;
}

Instrument instrument_of(const Json& block, const LawSpec& spec, const std::string& where) {
  return read_instrument(block, quantity_dimension(spec.response), quantity_dimension(spec.drive),
                         where + ": instrument");
}

std::optional<Instrument> stated_instrument(const std::string& recording, const std::string& option,
                                            const LawSpec& spec) {
  if (!option.empty()) return instrument_of(instrument_block(option), spec, option);
  const auto block = instrument_beside(recording);
  if (!block) return std::nullopt;
  return instrument_of(*block, spec, recording);
}

/// The reduced model that a plan picks for an organ, along a motion.
PickedAnswer picked_answer(const Json& scene, const std::string& where, const PlanChoice& choice,
                           const Protocol& motion, const std::vector<double>& times_s) {
  Json bare = scene;
  bare["protocol"] = {
      {"kind", "ramp_hold"}, {"depth", "1 mm"}, {"rate", "1 mm/s"}, {"hold", "1 s"}};
  ExperimentScene experiment = parse_experiment(bare, where, {});
  experiment.protocol = motion;
  experiment.protocol.set_equilibrium_at_start(false);  // it begins at the surface
  PlanRequest request = plan_request(choice);
  request.relevance = request.changes = false;
  const Plan plan = planned(experiment, std::move(request));
  if (!plan.choice) {
    throw Error(ExitCode::answer_is_no, where, "no model meets the tolerance",
                "a larger --tolerance; tpm plan says why");
  }
  std::vector<double> asked;
  for (const double t : times_s) {
    if (t <= motion.end_s()) asked.push_back(t);
  }
  const Trajectory answer = run_planned(plan, experiment, asked);
  PickedAnswer picked{plan.chosen().name, {}, 0.0};
  picked.value.setConstant(static_cast<Eigen::Index>(times_s.size()),
                           std::numeric_limits<double>::quiet_NaN());
  picked.value.head(answer.response.size()) = answer.response;
  picked.claimed_limit =
      plan.reference.peak * shown_error(plan, plan.chosen().claimed_error).value_or(0.0);
  return picked;
}

/// The law, or the organ that it was put on.
void set_subject(ValidationRequest& request, std::vector<std::string>& digests,
                 const ValidateOptions& options) {
  const Json document = read_json_of(options.law, "law");
  request.law_file = options.law;
  request.law_sha256 = sha256_hex(read_file(options.law));
  if (!is_organ_document(document)) {
    if (options.plan) {
      throw Error(ExitCode::usage, "--planned", "with a law", "the organ that the law was put on");
    }
    request.law = read_law(options.law);
    digests = sample_digests(document);
    return;
  }
  request.organ = std::shared_ptr<const OrganOfLaw>(new OrganOfLaw(read_organ_of_law(options.law)));
  request.law = request.organ->law();
  const Json material =
      document.contains("scene")
          ? document
          : read_json(std::filesystem::path(options.law).parent_path() / "material.json");
  digests = sample_digests(material.at("fitted_law"));
  if (!options.plan) return;
  request.pick = [scene = material.at("scene"), where = options.law, choice = options.planned](
                     const Protocol& motion, const std::vector<double>& times_s) {
    return picked_answer(scene, where, choice, motion, times_s);
  };
}

bool is_session(const std::string& file) {
  return file.ends_with(kSessionEnds);
}

void add_presses(ValidationRequest& request, const std::string& file) {
  SessionPresses presses = session_presses(read_recording(file), sha256_hex(read_file(file)));
  for (SessionPress& press : presses.made) {
    request.recordings.push_back(std::move(press.recording));
    request.presses.push_back(std::move(press.motion));
    request.instruments.emplace_back();
  }
  std::ranges::move(presses.left_out, std::back_inserter(request.remarks));
}

/// Recordings, or the presses of sessions: not both, for a press has no zero to be found.
void set_recordings(ValidationRequest& request, const ValidateOptions& options) {
  const std::vector<std::string>& files = options.recordings.files;
  const auto sessions = std::ranges::count_if(files, is_session);
  if (sessions == 0) {
    request.recordings = read_recordings(options.recordings);
    for (const std::string& file : files) {
      request.instruments.push_back(stated_instrument(file, options.instrument, request.law.spec));
    }
    return;
  }
  if (sessions != std::ssize(files)) {
    throw Error(ExitCode::usage, "RECORDING", "sessions beside recordings",
                "one kind; --session FILE adds what a session's rendering changes");
  }
  if (!options.session.empty()) {
    throw Error(ExitCode::usage, "--session", "beside a session that is compared",
                "recordings of a material");
  }
  for (const std::string& file : files) add_presses(request, file);
}

/// Adds the error of a session's rendering, from the subject along the hand's own motion.
void add_rendering(ValidationRequest& request, const ValidateOptions& options) {
  if (options.session.empty()) return;
  ValidationRequest presses = request;
  presses.recordings.clear();
  presses.instruments.clear();
  presses.requirement.reset();
  presses.at.reset();
  presses.calibration = {};
  presses.new_specimen = false;
  add_presses(presses, options.session);
  request.session = options.session;
  const Validation rendered = validate(presses);
  request.rendering = rendering_errors(rendered);
  request.remarks = presses.remarks;
  for (const RecordingComparison& r : rendered.recordings) {
    if (r.part.whole()) continue;
    request.remarks.push_back(
        {"part_of_press", fmt::format("{}: {}", r.name, part_words(r, presses.law.spec))});
  }
}

ValidationRequest validation_request(const ValidateOptions& options) {
  ValidationRequest request;
  std::vector<std::string> digests;
  set_subject(request, digests, options);
  const LawSpec& spec = request.law.spec;
  if (!options.requirement.empty()) {
    request.requirement =
        of_option([&] { return parse_requirement(options.requirement, "--require"); });
  }
  request.placement =
      of_option([&] { return parse_placement_rule(options.placement, "--placement"); });
  for (const std::string& text : options.quantities) {
    request.quantities.push_back(
        of_option([&] { return parse_quantity_of_interest(text, spec.drive, "--quantity"); }));
  }
  request.new_specimen = options.new_specimen;
  request.contact_by_threshold = !options.recordings.contact_response.empty();
  if (!options.at.empty()) request.at = options.at;
  set_recordings(request, options);
  // The files of the calibration may have other columns, or were fitted over another stretch.
  RecordingOptions without = options.recordings;
  without.reading = {};
  const auto with = [](const RecordingOptions& reading) {
    return [&reading](const std::string& file) {
      return prepared(file, read_recording_file(file, import_options(reading)), reading);
    };
  };
  request.calibration = find_calibration(request.law, options.law, digests,
                                         {with(options.recordings), with(without)});
  if (!options.calibration_instrument.empty()) {
    request.calibration.instrument = instrument_of(instrument_block(options.calibration_instrument),
                                                   spec, options.calibration_instrument);
  }
  add_rendering(request, options);
  return request;
}

/// Options that a credibility page needs to repeat the command.
Json invocation_of(const ValidateOptions& o) {
  Json invocation{{"law", o.law},
                  {"recordings", o.recordings.files},
                  {"reading", o.recordings.reading.texts},
                  {"units", o.recordings.reading.units},
                  {"contact_force", o.recordings.contact_response},
                  {"quantities", o.quantities},
                  {"require", o.requirement},
                  {"placement", o.placement},
                  {"instrument", o.instrument},
                  {"calibration_instrument", o.calibration_instrument},
                  {"at", o.at},
                  {"session", o.session},
                  {"evidence", o.evidence},
                  {"plan", o.plan ? o.planned.tolerance : std::string()}};
  if (o.new_specimen) invocation["new_specimen"] = true;
  return invocation;
}

ValidateOptions options_of(const Json& record, const std::string& page) {
  try {
    const Json& i = record.at("invocation");
    ValidateOptions o;
    o.law = i.at("law");
    o.recordings.files = i.at("recordings").get<std::vector<std::string>>();
    o.recordings.reading.texts = i.at("reading").get<std::map<std::string, std::string>>();
    o.recordings.reading.units = i.at("units").get<std::vector<std::string>>();
    o.recordings.contact_response = i.at("contact_force");
    o.quantities = i.at("quantities").get<std::vector<std::string>>();
    o.requirement = i.at("require");
    o.placement = i.at("placement");
    o.instrument = i.at("instrument");
    o.calibration_instrument = i.at("calibration_instrument");
    o.at = i.at("at");
    o.session = i.value("session", "");
    o.new_specimen = i.value("new_specimen", false);
    o.evidence = i.at("evidence").get<std::vector<std::string>>();
    const std::string tolerance = i.value("plan", "");
    o.plan = !tolerance.empty();
    if (o.plan) o.planned.tolerance = tolerance;
    const Json& summary = record.at("summary");
    o.summary = {summary.at("question"), summary.at("context"), summary.at("risk")};
    return o;
  } catch (const Json::exception&) {
    throw bad_input(page, "its record is damaged",
                    "a page that tpm validate --credibility has written");
  }
}

/// Each file can be read: known before a validation is computed.
std::vector<CredibilityEvidence> evidence_of(const ValidateOptions& options) {
  std::vector<CredibilityEvidence> evidence;
  for (const std::string& text : options.evidence) {
    evidence.push_back(of_option([&] { return parse_evidence(text, "--evidence"); }));
    (void)read_file(evidence.back().file);
  }
  return evidence;
}

Json record_of(const ValidateOptions& options, const ValidationRequest& request,
               const Validation& validation) {
  std::vector<std::string> others;
  for (const std::string& file :
       {options.session, options.instrument, options.calibration_instrument}) {
    if (!file.empty()) others.push_back(file);
  }
  for (const std::string& file : options.recordings.files) {
    std::filesystem::path description = file;
    description.replace_extension(".json");
    if (description != file && instrument_beside(file)) others.push_back(description.string());
  }
  const std::filesystem::path material =
      std::filesystem::path(options.law).parent_path() / "material.json";
  if (request.organ && material != options.law && std::filesystem::exists(material)) {
    others.push_back(material.string());
  }
  return credibility_record(request, validation, options.summary, invocation_of(options),
                            evidence_of(options), others);
}

/// The page itself stays: no command writes over what it reads.
int recheck(const std::string& page, const std::string& output, const Session& session) {
  std::filesystem::path marked = page;
  marked.replace_filename(marked.stem().string() + "_rechecked" + marked.extension().string());
  if (!output.empty()) marked = output;
  will_write({marked});
  const Json before = read_credibility_record(page);
  const ValidateOptions options = options_of(before, page);
  const ValidationRequest request = validation_request(options);
  const Json now = record_of(options, request, validate(request));
  std::vector<CredibilityChange> changes = changes_of(before, now);
  if (!shows_its_record(page, before)) {
    changes.push_back({"the page itself", "as its record prints it",
                       "otherwise: edited, or printed by another version"});
  }
  write_file(marked, credibility_page(before, changes));
  if (session.json()) {
    Json list = array_json(changes, [](const CredibilityChange& c) {
      return Json{{"place", c.place}, {"before", c.before}, {"now", c.now}};
    });
    Json json{{"page", page}, {"marked", marked.string()}, {"changes", std::move(list)}};
    add_end(json, {}, {marked.string()}, {});
    write_output(answer_text(session, std::move(json), {{"page_unchanged", changes.empty()}}));
  } else {
    std::string text = fmt::format("{}: {} of its values changed\n", page, changes.size());
    for (const CredibilityChange& c : changes) {
      text += fmt::format("{}: was {}, now {}\n", c.place, c.before, c.now);
    }
    write_output(text + fmt::format("written: {}\n", marked.string()));
  }
  return exit_code(changes.empty());
}

/// A requirement, or where the law or organ is used; if it is not adequate, a law of these
/// recordings.
std::string next_of_validation(const ValidateOptions& options, const Validation& validation) {
  const std::string subject = shell_word(options.law);
  const std::string compared = shell_word(options.recordings.files.front());
  switch (validation.verdict) {
    case ModelVerdict::residual:  // a requirement of these recordings would test nothing
    case ModelVerdict::adequate:
      break;
    default:
      if (validation.requirement.empty()) {
        return fmt::format("tpm validate {} {} --require 10%", subject, compared);
      }
      return is_session(options.recordings.files.front()) ? "tpm hil verify " + compared
                                                          : "tpm fit " + compared;
  }
  if (is_organ_document(read_json_of(options.law, "law"))) return "tpm plan " + subject;
  return is_session(options.recordings.files.front())
             ? "tpm view " + compared
             : fmt::format("tpm budget {} {}", subject, compared);
}

std::string validation_text(const ValidateOptions& options, const Session& session,
                            const Validation& validation, const std::vector<std::string>& files) {
  std::string text = to_terminal_text(validation);
  if (!options.folder.empty()) text += written(session, options.folder, files);
  if (!options.credibility.empty()) text += fmt::format("written: {}\n", options.credibility);
  return text + next_line(next_of_validation(options, validation));
}

std::string validation_json(const ValidateOptions& options, const Session& session,
                            const Validation& validation, const std::vector<std::string>& files) {
  Json json = to_json(validation);
  add_end(json, options.folder, files, next_of_validation(options, validation));
  if (!options.credibility.empty()) json["files"].push_back(options.credibility);
  // Where nothing is required, nothing is tested.
  std::vector<Verdict> verdicts;
  if (!validation.requirement.empty()) {
    verdicts.push_back({"model_adequate", validation.answers_yes()});
  }
  return answer_text(session, std::move(json), verdicts);
}

int run_validate(const ValidateOptions& options, const Session& session) {
  if (!options.recheck.empty()) {
    if (!options.law.empty() || !options.credibility.empty() || !options.folder.empty()) {
      throw Error(ExitCode::usage, "--recheck", "beside what is to be compared",
                  "the page alone: it names law, recordings and options");
    }
    return recheck(options.recheck, options.output, session);
  }
  if (options.law.empty() || options.recordings.files.empty()) {
    throw Error(ExitCode::usage, "validate",
                options.law.empty() ? "no law and no recording"
                                    : fmt::format("'{}' and no recording", options.law),
                "LAW RECORDING..., or --recheck FILE");
  }
  if (!options.credibility.empty()) will_write({options.credibility});
  will_write_into(options.folder, {"validation.csv", "validation.json", "figures.json"});
  const auto csv = csv_beside(options.output, session);
  (void)evidence_of(options);
  const ValidationRequest request = validation_request(options);
  const Validation validation = validate(request);
  std::string page;
  if (!options.credibility.empty()) {
    page = credibility_page(record_of(options, request, validation));
  }
  std::vector<std::string> files;
  if (!options.folder.empty()) {
    files = write_validation_report(options.folder, request, validation);
  }
  if (!options.credibility.empty()) write_file(options.credibility, page);
  deliver(session.json() ? validation_json(options, session, validation, files)
                         : validation_text(options, session, validation, files),
          options.output);
  deliver_csv(to_csv(validation), csv);
  return exit_code(validation.answers_yes());
}

}  // namespace

void add_validate_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("validate",
                                         "Compare a law, organ, plan's pick or session with "
                                         "recordings that it has not seen: the model "
                                         "error and its uncertainty (ASME V&V 20)");
  auto options = std::make_shared<ValidateOptions>();
  add_law_or_scene(*command, options->law);
  command->add_option("RECORDING", options->recordings.files,
                      "Recordings that the law was not fitted to, one or more; or sessions of tpm "
                      "hil run (.tpmrec): the force that was rendered along the hand's motion");
  CLI::Option* plan = command->add_flag(
      "--planned", options->plan,
      "Use the cheapest model that tpm plan finds, for the organ: its answer is S");
  command
      ->add_option("--tolerance", options->planned.tolerance,
                   "Largest error of the model, with --planned: in parts of the peak force, or jnd")
      ->capture_default_str()
      ->needs(plan);
  command->add_option("--session", options->session,
                      "A session (.tpmrec) whose rendering is part of S: what a hand felt, against "
                      "recordings of the material");
  command
      ->add_option(
          "--require", options->requirement,
          "Largest model error that is acceptable: a share of the measured value such as 10%, an "
          "amount such as \"20 mN\", or jnd (what a hand can tell, as in tpm plan)")
      ->each(reads_word(parse_requirement, "--require"));
  command
      ->add_option(
          "--quantity", options->quantities,
          "Quantity to compare: peak, end, ratio, half-time, rate, work, a time such as \"5 s\" "
          "or a depth such as \"2 mm\" (may be repeated; default: those that the "
          "recording has)")
      ->allow_extra_args(false);
  command
      ->add_option("--placement", options->placement,
                   "Contact and zero: held (found before contact and at the onset), onset "
                   "(the onset even where the depth starts at 0) or fitted to the recording")
      ->each(reads_word(parse_placement_rule, "--placement"))
      ->capture_default_str();
  command->add_option("--instrument", options->instrument,
                      "JSON file with the block \"instrument\" of the recordings, where no "
                      "description beside them has it");
  command->add_option("--calibration-instrument", options->calibration_instrument,
                      "Instrument of the recordings that the law was fitted to, as --instrument");
  command->add_flag("--new-specimen", options->new_specimen,
                    "The recordings are of new specimens: the spread between the recordings of "
                    "the calibration, each of another specimen, is in u_input");
  command->add_option("--at-recording", options->at,
                      "Recording to whose protocol the pooled area metric is carried, where "
                      "protocols differ");
  CLI::Option* credibility =
      command->add_option("--credibility", options->credibility,
                          "Page to write (HTML), with the evidence under the headings of V&V 40");
  command
      ->add_option("--evidence", options->evidence,
                   "Evidence for the page of --credibility: CATEGORY=FILE, such as \"code "
                   "verification=checks.json\" (may be "
                   "repeated); the file is named with its SHA-256")
      ->allow_extra_args(false)
      ->needs(credibility);
  command->add_option("--question", options->summary.question, "Question of interest, of that page")
      ->needs(credibility);
  command->add_option("--context", options->summary.context, "Context of use, of that page")
      ->needs(credibility);
  command->add_option("--risk", options->summary.risk, "Model risk, of that page")
      ->needs(credibility);
  command->add_option("--recheck", options->recheck,
                      "Compute a page of --credibility again and write beside it one "
                      "(_rechecked) that marks what changed; exit code 1 if anything did");
  add_folder_option(*command, options->folder, ": validation.csv, validation.json and the figures");
  add_output_option(*command, options->output);
  add_recording_options(*command, options->recordings);
  add_format_option(*command, session);
  command->footer(
      "Exit code 1 if --require is given and the law is not shown to be adequate.\n"
      "Example:\n  tpm fit recording.csv --folder fitted\n"
      "  tpm validate fitted/law.json other.csv --require 10% --folder validated");
  set_run(*command, session, [options, &session] { return run_validate(*options, session); });
}

}  // namespace tpm::app
