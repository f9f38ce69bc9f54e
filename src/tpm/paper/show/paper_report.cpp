#include "tpm/paper/show/paper_report.hpp"

#include <fmt/format.h>

#include <utility>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/show/fit_figures.hpp"
#include "tpm/paper/claims/claims.hpp"
#include "tpm/paper/show/sections.hpp"
#include "tpm/paper/show/study_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpm/show/run_record.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

namespace fs = std::filesystem;

/// The two creep experiments of Sec. 4.2, by the names that data/paper_claims.json gives them.
std::vector<PrintedCreep> printed_creep(const ClaimSet& claims) {
  const auto value = [&](std::string_view name) {
    const PrintedSymbol* symbol = claims.symbol(name);
    if (symbol == nullptr) {
      throw bad_input(claims.file, fmt::format("has no symbol '{}'", name),
                      "the printed numbers of Figs. 8 and 9");
    }
    return symbol->si;
  };
  return {{"8", value("load_small"), value("lambda_small"), value("depth_small_end")},
          {"9", value("load_figure9"), value("lambda_large"), value("depth_large_end")}};
}

PaperFigureData figure_data(const FitResult& fit, const ClaimSet& claims) {
  PaperFigureData data;
  data.fitted = from_vector(fitted_element(fit.config, fit.best.natural));
  data.fitted_as = estimate_words(fit);
  data.static_bands = load_points("evren_static");
  data.relaxation = load_points("evren_relaxation");
  data.creep = load_points("amy_creep");
  data.printed_creep = printed_creep(claims);
  data.literature = load_values("literature_values");
  return data;
}

std::vector<Figure> all_figures(const PaperReport& report) {
  std::vector<Figure> figures = paper_figures(report.figure_data);
  figures.push_back(profile_figure(report.fits));
  figures.push_back(validation_error_figure(report.comparisons, report.requirement));
  figures.push_back(sensitivity_figure(report.fits, "eta1", report.figure_data.paper.eta1_Pa_s));
  return figures;
}

void round_numbers(Json& value) {
  if (value.is_number_float()) {
    value = rounded(value.get<double>());
  } else if (value.is_structured()) {
    for (auto& item : value) round_numbers(item);
  }
}

void write_json(const fs::path& path, Json value) {
  round_numbers(value);
  write_file(path, to_text(value));
}

}  // namespace

PaperReport make_paper_report(double requirement) {
  PaperReport report;
  report.requirement = requirement;
  std::map<std::string, double> seconds;
  const fs::path claims_file = paper_claims_path();
  const Json claims = read_json(claims_file);
  const std::string file = claims_file.filename().string();
  report.audit = timed(seconds, "audit", [&] { return run_audit(claims, file); });
  const auto printed = read_printed_tables(claims, file);
  TableRequest request;
  report.tables = timed(seconds, "tables", [&] { return make_tables(request, printed); });
  request.mode = TableMode::consistent;
  report.consistent = make_tables(request, printed);
  const fs::path config = share_dir() / "configs" / "liver_relaxation.json";
  report.fits = timed(seconds, "fits", [&] { return run_fit_study(read_fit_config(config)); });
  report.figure_data = figure_data(report.fits.reference, read_claims(claims, file));
  report.comparisons = timed(seconds, "validation", [&] {
    const PaperFigureData& d = report.figure_data;
    return compare_with_print({d.paper, d.relaxation, d.static_bands, d.creep}, report.fits,
                              requirement);
  });
  report.figures = all_figures(report);
  report.seconds = std::move(seconds);
  return report;
}

Document paper_document(const PaperReport& report) {
  Document document;
  document.title = "The three-parameter liver model with tension, recomputed";
  document.subtitle =
      "Bao et al., A New Hybrid Viscoelastic Soft Tissue Model based on Meshless Method for Haptic "
      "Surgical Simulation, Open Biomed. Eng. J. 2013, 7:116-124, doi 10.2174/1874120701307010116. "
      "Its tables, claims and figures against its own equations and data.";
  add_summary(document, report);
  add_data(document, report);
  add_tables(document, report);
  add_audit(document, report);
  add_fits(document, report);
  add_validation(document, report);
  add_paper_figures(document, report);
  add_validity(document, report);
  add_assumptions(document, report);
  typeset(document);
  return document;
}

void write_paper_report(const PaperReport& report, const fs::path& folder,
                        const std::string& python) {
  write_report(folder, paper_document(report), report.figures, python, report.seconds);
  const TableDocument tables = tables_document(report.tables);
  write_file(folder / "tables.md", render(tables, TableStyle::markdown));
  write_file(folder / "tables.tex", render(tables, TableStyle::latex));
  write_file(folder / "tables.csv", tables_csv(report.tables));
  write_json(folder / "tables.json", to_json(report.tables));
  write_json(folder / "audit.json", to_json(report.audit));
  write_json(folder / "validation.json", to_json(report.comparisons, report.requirement));
  write_json(folder / "fit_relaxation.json", to_json(report.fits.reference));
  write_json(folder / "fit_sensitivity.json", variants_json(report.fits));
  write_json(folder / "fit_held_out.json", held_out_json(report.fits));
}

}  // namespace tpm::paper
