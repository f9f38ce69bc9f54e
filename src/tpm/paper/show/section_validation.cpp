// Declared in tpm/paper/show/sections.hpp.
// The section on validation: the paper's model against the printed data in the words of V&V 20.
#include <fmt/format.h>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/show/sections.hpp"

namespace tpm::paper {
namespace {

std::string shown(double si, const PrintedComparison& c, int digits) {
  return significant(si / c.unit.to_si, digits);
}

std::string range_of(double low, double high, const PrintedComparison& c) {
  return c.is_range() ? fmt::format("{} to {}", shown(low, c, 3), shown(high, c, 3))
                      : shown(low, c, 3);
}

std::string share_text(double share) {
  return fmt::format("{} %", significant(100.0 * share, share >= 1.0 ? 3 : 2));
}

Tone tone_of_model_verdict(ModelVerdict verdict) {
  if (verdict == ModelVerdict::adequate) return Tone::good;
  return verdict == ModelVerdict::not_adequate ? Tone::bad : Tone::fair;
}

/// Only what the other columns and the list above them do not say: of a calibration residual, and
/// of a range that is wider than the requirement, they say it.
std::string remark_of(const PrintedComparison& c) {
  if (c.verdict == ModelVerdict::residual) return "-";
  return c.remark.starts_with(kOnlyARange) ? "D" : c.remark;
}

Table comparisons_table(const std::vector<PrintedComparison>& all, const std::string& experiment) {
  Table table{"",
              {{"parameters"},
               {"quantity"},
               {"S", true},
               {"D", true},
               {"E", true},
               {"u_input", true},
               {"u_D, digits", true},
               {"U", true},
               {"verdict"},
               {"not adequate below R", true},
               {"adequate from R", true},
               {"what would change it"}}};
  for (const PrintedComparison& c : all) {
    if (c.experiment != experiment) continue;
    table.rows.push_back({{c.parameters},
                          {fmt::format("{}, {}", c.quantity, c.unit.symbol)},
                          {shown(c.simulated, c, 3)},
                          {range_of(c.low, c.high, c)},
                          {range_of(c.simulated - c.high, c.simulated - c.low, c)},
                          {c.u_input > 0.0 ? shown(c.u_input, c, 2) : "not stated"},
                          {shown(c.u_D, c, 2)},
                          {shown(c.e.expanded(), c, 2)},
                          {std::string(verdict_words(c.verdict)), tone_of_model_verdict(c.verdict)},
                          {c.not_adequate_below > 0.0 ? share_text(c.not_adequate_below) : "-"},
                          {share_text(c.adequate_from)},
                          {remark_of(c)}});
  }
  return table;
}

struct VerdictCounts {
  int adequate = 0, not_adequate = 0, undetermined = 0, residual = 0;
};

VerdictCounts counts_of(const std::vector<PrintedComparison>& all, bool printed) {
  VerdictCounts counts;
  for (const PrintedComparison& c : all) {
    if (c.printed_parameters != printed) continue;
    counts.adequate += c.verdict == ModelVerdict::adequate ? 1 : 0;
    counts.not_adequate += c.verdict == ModelVerdict::not_adequate ? 1 : 0;
    counts.undetermined += c.verdict == ModelVerdict::undetermined ? 1 : 0;
    counts.residual += c.verdict == ModelVerdict::residual ? 1 : 0;
  }
  return counts;
}

std::string counted(const char* whose, const VerdictCounts& counts) {
  std::string text = fmt::format("{} parameters: adequate {}, not adequate {}, undetermined {}",
                                 whose, counts.adequate, counts.not_adequate, counts.undetermined);
  if (counts.residual > 0) {
    text += fmt::format(", calibration residual without a verdict {}", counts.residual);
  }
  return text;
}

/// E of one kind of comparison in percent of D, [E - U, E + U], beside its depth or load.
/// @param shift of the bars, so that those of one depth stand side by side
Series errors_of(const std::vector<PrintedComparison>& all, const std::string& parameters,
                 const std::string& label, const std::string& quantity_start, double shift) {
  Series series;
  series.kind = Series::Kind::bracket;
  series.label = label;
  series.provenance = "model";
  for (const PrintedComparison& c : all) {
    if (c.parameters != parameters || !c.quantity.starts_with(quantity_start)) continue;
    const double at = c.imposed * (c.experiment == "creep" ? 1.0 : 1e3);
    const double U = c.e.expanded();
    series.add_range(at + shift, 100.0 * (c.simulated - c.high - U) / c.high,
                     100.0 * (c.simulated - c.low + U) / c.low);
  }
  return series;
}

/// One panel of the figure.
struct ErrorPanel {
  const char* title;
  const char* start;  ///< of the names of its quantities
  const char* axis;
  const char* unit;
  double first, last, apart;  ///< on the axis: the requirement's ends, and from bar to bar
  std::vector<std::pair<const char*, const char*>> kinds;  ///< parameters and label
};

}  // namespace

Figure validation_error_figure(const std::vector<PrintedComparison>& all, double requirement) {
  const char* const printed = "printed parameters";
  const char* const fitted = "fitted parameters";
  const std::vector<std::pair<const char*, const char*>> relaxing{
      {"printed, step", printed},
      {"printed, ramp of 4 mm/s", "printed parameters, ramp of 4 mm/s"},
      {"fitted to the other depths", fitted}};
  const std::vector<std::pair<const char*, const char*>> steady{{"printed", printed},
                                                                {"fitted to relaxation", fitted}};
  Figure figure{"validation_error", "Model error against the requirement",
                "What is known of the model error, [E - U, E + U] in percent of D, for every D "
                "that the print allows. Adequate: the whole bar lies between the dashed lines. Not "
                "adequate: the whole bar lies outside."};
  for (const ErrorPanel& shown :
       {ErrorPanel{"Relaxation, peak", "peak force", "depth", "mm", 1.0, 9.0, 0.45, relaxing},
        ErrorPanel{"Relaxation, 30 s", "force after", "depth", "mm", 1.0, 9.0, 0.45, relaxing},
        ErrorPanel{"Static force", "equilibrium", "depth", "mm", 1.0, 9.0, 0.6, steady},
        ErrorPanel{"Creep, 300 s", "depth after", "load", "N", 0.1, 1.1, 0.1, steady}}) {
    Panel panel;
    panel.title = shown.title;
    panel.x = {shown.axis, shown.unit};
    panel.y = {"model error / D", "%"};
    double shift = -0.5 * shown.apart * static_cast<double>(shown.kinds.size() - 1);
    for (const auto& [parameters, label] : shown.kinds) {
      panel.series.push_back(errors_of(all, parameters, label, shown.start, shift));
      shift += shown.apart;
    }
    for (const double percent : {100.0 * requirement, -100.0 * requirement}) {
      panel.series.push_back(
          line("requirement", {shown.first, shown.last}, {percent, percent}, "assumed"));
    }
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

std::string validation_sentence(const PaperReport& report) {
  return fmt::format("Validation against the printed data at R = {}: {}; {}.",
                     share_text(report.requirement),
                     counted("printed", counts_of(report.comparisons, true)),
                     counted("fitted", counts_of(report.comparisons, false)));
}

void add_validation(Document& document, const PaperReport& report) {
  document.heading(2, "Validation");
  document.paragraph(fmt::format(
      "In the words of ASME V&V 20: S is simulated, D is measured, E = S - D, u_val² = u_num² + "
      "u_input² + u_D², and the model error lies in [E - U, E + U] with 95 %, U = k u_val. The "
      "paper calls its results close and states no requirement, so R = {} of D is ours "
      "(`tpm paper report --require`). Adequate: |E| + U ≤ R. Not adequate: |E| - U > R. Two "
      "columns say what any other requirement would give.",
      share_text(report.requirement)));
  document.bullets(
      {{"D of a range is every number in it: 'adequate' and 'not adequate' hold for all of them. A "
        "range over three animals or over a band of curves has no mean and no distribution here, "
        "so a number inside it is not confirmed by it; only a number well outside is refuted. "
        "Where the last column says 'D', the range "
        "alone is wider than the requirement: the readings behind it would decide."},
       {"u_D holds the printed digits alone. The scatter of the readings, the force cell, the zero "
        "and, for relaxation, the animal are not stated; the last column says how large that "
        "unstated part must be to change the verdict."},
       {"The paper chose x = 30 mm by comparing its relaxation data with four spacings, so with "
        "printed parameters a small E there is a calibration residual and no validation. A large "
        "one counts all the more."},
       {"The printed parameters are stated without uncertainty and count as known. u_input of the "
        "fitted ones follows from the scatter of the readings about the fit and, for static force "
        "and creep, from the ramp rates and kinds of noise that the fit may assume. A parameter "
        "on its bound (the spacing) counts as known."},
       {"u_num is rounding: all S are closed forms (u_num < 1e-8 of S)."},
       {"The ramp of 4 mm/s, times that count from its end, and 300 s for the range of the creep "
        "are assumed. A verdict holds under these assumptions. Relaxation is predicted by the fit "
        "that left that depth out; a comparison with fitted numbers would be a calibration "
        "residual."}});
  document.picture(caption_of(report, "validation_error"));
  for (const auto& [experiment, title] : {std::pair("relaxation", "Relaxation (Tables 1 to 4)"),
                                          std::pair("static", "Static force (Table 5)"),
                                          std::pair("creep", "Creep (Figs. 8 and 9)")}) {
    document.heading(3, title);
    document.table(comparisons_table(report.comparisons, experiment));
  }
  document.paragraph(
      "Applicability: relaxation was fitted at 2 to 8 mm and 30 s. The creep data reach 11.9 mm "
      "and 300 s, outside both, under a 6 mm punch instead of the 4 mm sphere, and ex vivo instead "
      "of in the abdomen: there a model error is mixed with a difference of experiments.");
}

}  // namespace tpm::paper
