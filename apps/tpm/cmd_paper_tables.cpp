// tpm paper tables: Tables 1-5 of the paper, recomputed, and the same tables for other inputs.

#include <algorithm>
#include <memory>
#include <optional>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "option_kinds.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/paper/show/study_report.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

/// Texts as given; none where the default of TableRequest stands. Numbers are parsed here and not
/// by CLI11, which takes nan and 1e400 for numbers.
struct TableOptions {
  bool as_printed = false;
  bool consistent = false;
  bool verbose = false;
  std::optional<std::string> depths, spacings;
  std::optional<std::string> E, E1, E2, Eprime, eta, A0, l0, rate, hold;
  std::string output;
  std::string format = "text";
};

void set(double& target, const std::optional<std::string>& text, Dimension dimension,
         std::string_view option) {
  if (text) target = option_quantity(*text, dimension, option);
}

/// "2,4,6 mm" or "2 mm, 0.4 cm": the unit after the last number holds for those without one.
std::vector<double> lengths(const std::string& text, std::string_view option) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  for (std::size_t comma = text.find(','); from <= text.size(); comma = text.find(',', from)) {
    const std::size_t end = std::min(comma, text.size());
    parts.emplace_back(trimmed(std::string_view(text).substr(from, end - from)));
    from = end + 1;
  }
  const std::string unit(split_quantity(parts.back()).unit);
  return mapped<double>(parts, [&](const std::string& part) {
    const bool has_unit = !split_quantity(part).unit.empty();
    const std::string full = has_unit || unit.empty() ? part : part + " " + unit;
    return option_quantity(full, Dimension::length, option);
  });
}

TableRequest request_of(const TableOptions& options) {
  if (options.as_printed && options.consistent) {
    throw Error(ExitCode::usage, "--as-printed, --consistent", "both are given", "one of them");
  }
  TableRequest request;
  request.mode = options.consistent ? TableMode::consistent : TableMode::as_printed;
  if (options.depths) request.depths_m = lengths(*options.depths, "--depths");
  if (options.spacings) request.spacings_m = lengths(*options.spacings, "--spacings");
  TpmParameters& p = request.parameters;
  for (double* modulus : {&p.E1_Pa, &p.E2_Pa, &p.Eprime_Pa})
    set(*modulus, options.E, Dimension::stress, "--E");
  set(p.E1_Pa, options.E1, Dimension::stress, "--E1");
  set(p.E2_Pa, options.E2, Dimension::stress, "--E2");
  set(p.Eprime_Pa, options.Eprime, Dimension::stress, "--Eprime");
  set(p.eta1_Pa_s, options.eta, Dimension::viscosity, "--eta");
  set(p.A0_m2, options.A0, Dimension::area, "--A0");
  set(p.l0_m, options.l0, Dimension::length, "--l0");
  set(request.rate_m_per_s, options.rate, Dimension::speed, "--rate");
  set(request.hold_s, options.hold, Dimension::time, "--hold");
  return request;
}

/// A depth far beyond what the paper indents is often a slip of the unit.
void warn_of_depths(const TableRequest& request) {
  constexpr double kValid_m = 10e-3, kRounding_m = 1e-9;
  const double deepest_m = *std::max_element(request.depths_m.begin(), request.depths_m.end());
  if (deepest_m <= kValid_m + kRounding_m) return;
  tell_user("tpm: warning: --depths: {} mm is beyond 10 mm, where the paper's validity ends\n",
            significant(1e3 * deepest_m, 4));
}

constexpr const char* kNextOfTables = "tpm paper audit";

std::string short_text(const TablesResult& result) {
  ShortAnswer answer = short_answer(result);
  end_answer(answer, "", {}, kNextOfTables);
  return to_text(answer);
}

std::string json_text(const TablesResult& result, const Session& session) {
  Json json = to_json(result);
  add_end(json, {}, {}, kNextOfTables);
  return answer_text(session, std::move(json));
}

std::string rendered(const TablesResult& result, const TableOptions& options,
                     const Session& session) {
  const std::string& format = options.format;
  if (format == "text" && !options.verbose) return short_text(result);
  if (format == "json") return json_text(result, session);
  if (format == "csv") return tables_csv(result);
  const TableStyle style = format == "md"      ? TableStyle::markdown
                           : format == "latex" ? TableStyle::latex
                                               : TableStyle::text;
  return render(tables_document(result), style);
}

int run_command(const TableOptions& options, const Session& session) {
  const TableRequest request = request_of(options);
  const auto path = paper_claims_path();
  const std::string name = path.filename().string();
  const auto printed = read_printed_tables(read_json(path), name);
  const std::string text = rendered(make_tables(request, printed), options, session);
  warn_of_depths(request);
  deliver(text, options.output);
  return 0;
}

void add_options(CLI::App& command, TableOptions& options) {
  command.add_flag("--as-printed", options.as_printed,
                   "Tables as printed: a step, Eqs. 15 and 16, t -> infinity (default)");
  command.add_flag("--consistent", options.consistent,
                   "Ramp-and-hold with the true eta1: end of ramp and end of hold");
  command.add_option("--depths", options.depths, "Indentation depths (default \"2,4,6,8 mm\")");
  command.add_option("--spacings", options.spacings,
                     "Sphere spacings x (default \"20,25,30,35 mm\")");
  command.add_option("--E", options.E, "Modulus of all springs: E1, E2 and E' (default 12 kPa)");
  command.add_option("--E1", options.E1, "Spring of the Kelvin-Voigt unit");
  command.add_option("--E2", options.E2, "Series spring");
  command.add_option("--Eprime", options.Eprime, "Modulus of the lateral bonds");
  command.add_option("--eta", options.eta, "Dashpot eta1 (default 5 Pa s)");
  command.add_option("--A0", options.A0, "Area that turns stress into force (default 12.56 mm^2)");
  command.add_option("--l0", options.l0, "Reference length (default 1 mm)");
  command.add_option("--rate", options.rate,
                     "Speed of the ramp, with --consistent (assumed: 4 mm/s)");
  command.add_option("--hold", options.hold, "Time at depth, with --consistent (default 30 s)");
  add_verbose_option(command, options.verbose, "each cell as printed and measured, with verdicts");
  command.add_option("-o,--output", options.output, "File to write (default: the terminal)");
  command.add_option("--format", options.format, "Output format: text, md, csv, latex or json")
      ->check(one_of_words({"text", "md", "csv", "latex", "json"}))
      ->capture_default_str();
}

}  // namespace

void add_tables_command(CLI::App& paper, Session& session) {
  CLI::App* command =
      paper.add_subcommand("tables", "Recompute the paper's tables, cell by cell, with verdicts");
  const auto options = std::make_shared<TableOptions>();
  add_options(*command, *options);
  command->footer(
      "Example:\n  tpm paper tables --depths \"2,4,6,8 mm\" --spacings \"20,25,30,35 mm\" --E \"12 "
      "kPa\"\n"
      "  tpm paper tables --consistent --eta \"2e5 Pa s\" --rate \"2 mm/s\" --format md");
  set_run(*command, session, [options, &session] { return run_command(*options, session); });
}

}  // namespace tpm::app
