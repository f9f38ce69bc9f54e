// Declared in tpm/fit/validate/validation.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "tpm/base/lists.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/validate/brief_text.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::fit {
namespace {

using Rank = BriefText::Rank;

std::string number(double value, const Unit& unit, int digits = 3) {
  return significant(value / unit.to_si, digits);
}

/// "-9.37 +- 1.48 mN"
std::string error_text(const ErrorWithUncertainty& e, const Unit& unit) {
  return with_unit(fmt::format("{} +- {}", number(e.error, unit), number(e.expanded(), unit)),
                   unit);
}

std::string cell_words(ModelVerdict verdict) {
  if (verdict == ModelVerdict::not_seen) return "no model error seen";
  return std::string(verdict_words(verdict));
}

Unit unit_of(const QuantityComparison& q) {
  return scaled_unit(q.unit, std::max(std::abs(q.measured), q.e.expanded()));
}

Unit unit_of(const PooledQuantity& p) {
  if (p.relative) return {"%", Dimension::dimensionless, 0.01};
  return scaled_unit(p.unit, std::max(std::abs(p.measured), p.e.expanded()));
}

std::string titled(const std::string& name, const Unit& unit) {
  return unit.symbol.empty() ? name : fmt::format("{}, {}", name, unit.symbol);
}

std::vector<std::string> budget_row(const QuantityComparison& q) {
  const Unit unit = unit_of(q);
  const auto two = [&](double u) { return number(u, unit, 2); };
  return {titled(q.name, unit),
          number(q.simulated, unit, 4),
          number(q.measured, unit, 4),
          number(q.e.error, unit),
          number(q.e.expanded(), unit),
          significant(q.u_num / unit.to_si, 1),
          two(q.u_input),
          two(q.u_D),
          significant(q.e.coverage, 3),
          q.limit ? two(*q.limit) : "-",
          cell_words(q.verdict)};
}

/// A row each, below two lines of titles; an empty line follows.
void add_table(BriefText& text, TableSection section, Rank rank, std::string_view rows) {
  section.right_aligned.assign(section.columns.size(), true);
  section.right_aligned.front() = section.right_aligned.back() = false;
  TableDocument document;
  document.sections.push_back(std::move(section));
  std::string table = render(document, TableStyle::text);
  while (!table.empty() && table.front() == '\n') table.erase(0, 1);
  text.add_table(table, rank, rows);
}

std::string joint_text(const JointTest& joint) {
  if (joint.rank == 0) {
    return joint.unknown.empty() ? "not possible: too few degrees of freedom"
                                 : "not possible: of no quantity is the whole uncertainty known";
  }
  std::string text = fmt::format(
      "T^2 = {}, rank {}, p = {} (F with {} and {} degrees of freedom)",
      significant(joint.t_squared, 3), joint.rank, significant(joint.p_value, 2), joint.rank,
      std::isfinite(joint.degrees) ? significant(joint.degrees, 3) : "infinitely many");
  if (!joint.dependent.empty()) {
    text += fmt::format("; {} follows from these", fmt::join(joint.dependent, ", "));
  }
  if (!joint.unknown.empty()) {
    text += fmt::format("; without {}", fmt::join(joint.unknown, ", "));
  }
  return text;
}

std::string curve_text(const CurveComparison& c, const Unit& unit) {
  const double model = c.mean_square_error - c.mean_square_u;
  const std::string size =
      model > 0.0 ? with_unit(number(std::sqrt(model), unit, 2), unit) : std::string("nothing");
  std::string text = fmt::format("rms E {}, expected {}: {} beyond the uncertainty",
                                 number(std::sqrt(c.mean_square_error), unit),
                                 with_unit(number(std::sqrt(c.mean_square_u), unit), unit), size);
  if (c.chi_squared > 0.0) {
    text += fmt::format("; chi^2 {} over {} samples", significant(c.chi_squared, 3), c.samples);
  }
  return text;
}

std::string placement_text(const RecordingComparison& r, const Unit& unit, Dimension drive) {
  const ValidationPlacement& p = r.placement;
  const Unit shown = scaled_unit({std::string(si_symbol(drive)), drive, 1.0},
                                 std::max(std::abs(p.contact), p.contact_u));
  std::string text = fmt::format(
      "contact {}{}: {}", with_unit(number(p.contact, shown), shown),
      p.contact_u > 0.0 ? fmt::format(", u {}", with_unit(number(p.contact_u, shown, 2), shown))
                        : "",
      p.contact_words);
  if (p.zero_known) return text + "; the force there is 0";
  if (p.zero_readings == 0) {
    if (r.creep) return text + "; nothing before the load tells the reading without one";
    return text + (p.rest_in_contact
                       ? "; contact lies above the surface at rest, so the rest tells no zero of "
                         "the force"
                       : "; nothing before contact tells the zero of the force");
  }
  text += fmt::format("; zero {}, u {}, from {} readings", with_unit(number(p.zero, unit), unit),
                      with_unit(number(p.zero_u, unit, 2), unit), p.zero_readings);
  if (p.drift) {
    text += fmt::format("; its drift of {}/s, u {}/s, taken out",
                        with_unit(number(p.drift->per_s, unit), unit),
                        with_unit(number(p.drift->u_per_s, unit, 2), unit));
  }
  if (p.zero_moved) {
    text += fmt::format("; the fit moved the zero by {} of its u", significant(*p.zero_moved, 2));
  }
  if (p.contact_moved) {
    text += fmt::format(", contact by {}", significant(*p.contact_moved, 2));
  }
  return text;
}

std::string scatter_text(const ReadingScatter& s, const Unit& unit) {
  return fmt::format(
      "{} (standard deviation), correlation of neighbours {}, {} degrees of freedom, from {}",
      with_unit(number(s.sigma, unit, 3), unit), significant(s.phi, 2), significant(s.degrees, 3),
      s.told_by);
}

std::string rendering_text(const Validation& v) {
  std::string text = fmt::format("{}: S is times", v.session);
  for (const RenderingError& e : v.rendering) {
    text += fmt::format("{} {} ({}, {} {})", &e == &v.rendering.front() ? "" : ",",
                        significant(1.0 + e.mean, 6),
                        quantity_words(e.quantity, v.spec.drive, v.spec.response), e.presses,
                        e.presses == 1 ? "press" : "presses");
  }
  return text;
}

std::string rises_text(const RecordingComparison& r) {
  const UnseenRise& first = r.rises.front();
  const std::size_t more = r.rises.size() - 1;
  return fmt::format(
      "when the {} changed between the samples at {} and {} s{} is not known: in u_D",
      r.creep ? "load" : "drive", significant(first.begin_s, 6), significant(first.end_s, 6),
      more > 0 ? fmt::format(" and in {} more such intervals", more) : "");
}

std::string instrument_text(const RecordingComparison& r) {
  if (!r.instrument) return "not stated: its errors are not in u_D";
  if (!r.same_instrument)
    return fmt::format("{}, not known to be that of the calibration", r.instrument->id);
  return fmt::format(
      "{}, that of the calibration: a scale error that both share cannot be seen here",
      r.instrument->id);
}

/// Both, with what is known of the probes.
std::string instrument_and_probe_text(const RecordingComparison& r) {
  return instrument_text(r) + (r.probe.empty() ? "" : "; " + r.probe);
}

std::string applicability_text(const Applicability& a) {
  std::string text = a.outside.empty() ? std::string("inside the calibration")
                                       : fmt::format("outside the calibration: {}",
                                                     fmt::join(remark_texts(a.outside), "; "));
  if (!a.unknown.empty()) {
    text += fmt::format(" (not known: {})", fmt::join(a.unknown, ", "));
  }
  return text;
}

Unit response_unit(const RecordingComparison& r) {
  for (const QuantityComparison& q : r.quantities) {
    if (q.quantity.kind == QuantityKind::peak || q.quantity.kind == QuantityKind::end_of_hold) {
      return unit_of(q);
    }
  }
  return r.quantities.front().unit;
}

/// "a, b, c", or the first of them and how many more there are.
std::string first_names(std::vector<std::string> names) {
  if (constexpr std::size_t kMost = 6; names.size() > kMost) {
    const std::size_t more = names.size() - kMost + 1;
    names.resize(kMost - 1);
    names.push_back(fmt::format("{} more", more));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Names of the recordings, of presses of one session without its file: "session.tpmrec: ".
struct RecordingNames {
  std::string file;
  std::vector<std::string> names;
};

RecordingNames names_of(const Validation& v) {
  const std::string& session = v.recordings.front().session;
  const bool shared =
      v.recordings.size() > 1 && !session.empty() &&
      std::ranges::all_of(v.recordings, [&](const auto& r) { return r.session == session; });
  if (!shared) return {{}, mapped<std::string>(v.recordings, &RecordingComparison::name)};
  return {session + ": ", mapped<std::string>(v.recordings, &RecordingComparison::press)};
}

void add_header(BriefText& text, const Validation& v) {
  text.add(fmt::format("{}: {}\n", v.law_file, v.subject), Rank::always);
  const std::string fitted =
      v.calibration.empty()
          ? std::string("files that the law does not name")
          : first_names(mapped<std::string>(v.calibration, &CalibrationData::File::name));
  const bool residual = v.verdict == ModelVerdict::residual;
  const RecordingNames names = names_of(v);
  text.add_words(fmt::format(
      "{} with {}{}{}, fitted to {}; {}",
      residual         ? "compared (calibration residual, no validation)"
      : v.of_session() ? "compared (rendered forces, no validation)"
                       : "validated",
      v.new_specimen ? "new specimens: " : "", names.file, first_names(names.names), fitted,
      v.requirement.empty() ? std::string("no requirement")
                            : fmt::format("requirement: {}", v.requirement)));
  text.add("\n", Rank::always);
}

void add_remarks(BriefText& text, const RecordingComparison& r) {
  for (const auto& remark : each_once(r.quantities, &QuantityComparison::remark)) {
    if (!remark) continue;
    std::vector<std::string> names;  // several may say the same
    for (const QuantityComparison& q : r.quantities) {
      if (q.remark == remark) names.push_back(q.name);
    }
    text.add_line(remark->code == kMustShrink ? "must shrink" : "undetermined",
                  fmt::format("{}: {}", fmt::join(names, ", "), remark->text), Rank::remark);
  }
  for (const Remark& remark : r.without) {
    text.add_line("not compared", remark.text, Rank::remark);
  }
}

/// Said of a press that a hand was asked for, and of what is only a part.
bool part_is_said(const RecordingComparison& r) {
  return r.part.hold_asked_s || !r.part.whole();
}

void add_recording(BriefText& text, const Validation& v, std::size_t index) {
  const RecordingComparison& r = v.recordings[index];
  TableSection section;
  section.columns = {"quantity", "S",   "D", "E", "U",      "u_num",
                     "u_input",  "u_D", "k", "R", "verdict"};
  for (const QuantityComparison& q : r.quantities) section.rows.push_back(budget_row(q));
  add_table(text, std::move(section), Rank::quantity, "quantities");
  add_remarks(text, r);
  const Unit unit = response_unit(r);
  if (part_is_said(r)) text.add_line("compared", part_words(r, v.spec), Rank::context);
  text.add_line("together", joint_text(r.joint), Rank::detail);
  text.add_line(
      "whole curve",
      curve_text(r.curve, unit) + (v.new_specimen ? " (without the spread between specimens)" : ""),
      Rank::detail);
  if (!r.pick.empty()) {
    text.add_line("S from",
                  r.pick + ", which a plan picked; its claimed error is in u_num as a limit",
                  Rank::context);
  }
  text.add_line(
      "placement",
      placement_text(r, unit, quantity_dimension(r.creep ? v.spec.response : v.spec.drive)),
      Rank::context);
  text.add_line("scatter", scatter_text(r.scatter, unit), Rank::detail);
  if (!r.rises.empty()) text.add_line("motion", rises_text(r), Rank::detail);
  text.add_line("instrument", instrument_and_probe_text(r), Rank::detail);
  text.add_line("applicability", applicability_text(v.applicability[index]), Rank::context);
}

std::string area_text(const PooledQuantity& p) {
  if (!p.area) return "-";
  const Unit unit = p.relative && !p.area_at ? Unit{"", Dimension::dimensionless, 1.0}
                    : p.area_at              ? scaled_unit(p.unit, std::abs(p.measured))
                                             : unit_of(p);
  std::string text =
      fmt::format("{} (of draws {}, 95 % {})", number(p.area->area, unit, 3),
                  number(p.area->null_mean, unit, 3), number(p.area->null_95, unit, 3));
  if (p.relative && !p.area_at) text += " u";
  if (p.area_at) text += fmt::format(" {}", unit.symbol);
  return text;
}

void add_pooled(BriefText& text, const Validation& v) {
  TableSection section;
  section.columns = {"mean over recordings", "n",      "S", "D", "E", "U", "shared u", "R",
                     "area metric",          "verdict"};
  for (const PooledQuantity& p : v.pooled) {
    const Unit unit = unit_of(p);
    section.rows.push_back({titled(p.name, unit), std::to_string(p.recordings),
                            p.relative ? "-" : number(p.simulated, unit, 4),
                            p.relative ? "-" : number(p.measured, unit, 4), number(p.e.error, unit),
                            number(p.e.expanded(), unit), number(p.u_shared, unit, 2),
                            p.limit ? number(*p.limit, unit, 2) : "-", area_text(p),
                            cell_words(p.verdict)});
  }
  add_table(text, std::move(section), Rank::quantity, "quantities");
  bool remarked = false;
  for (const PooledQuantity& p : v.pooled) {
    if (!p.remark) continue;
    text.add_line(p.unknown ? "undetermined" : "must shrink",
                  fmt::format("{}: {}", p.name, p.remark->text), Rank::remark);
    remarked = true;
  }
  if (remarked) text.add("\n", Rank::always);
}

/// Of several recordings.
std::string applicability_text(const Validation& v, const std::vector<std::string>& names) {
  std::vector<std::size_t> places(v.recordings.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  const auto said = [&](std::size_t i) { return applicability_text(v.applicability[i]); };
  const std::vector<std::string> each = each_once(places, said);
  if (each.size() == 1) return each.front();
  // Recordings of one protocol say the same.
  const auto outside_of = [&](std::size_t i) {
    return fmt::format("{}", fmt::join(remark_texts(v.applicability[i].outside), "; "));
  };
  std::vector<std::string> outside;
  bool some_inside = false;
  for (const std::string& words : each_once(places, outside_of)) {
    some_inside = some_inside || words.empty();
    if (words.empty()) continue;
    std::vector<std::string> who;
    for (const std::size_t i : places) {
      if (outside_of(i) == words) who.push_back(names[i]);
    }
    outside.push_back(fmt::format("{} ({})", first_names(who), words));
  }
  std::string text = outside.empty()
                         ? std::string("inside the calibration")
                         : fmt::format("outside the calibration: {}{}", fmt::join(outside, "; "),
                                       some_inside ? "; the others inside" : "");
  std::vector<std::string> unknown;
  for (const Applicability& a : v.applicability) {
    unknown.insert(unknown.end(), a.unknown.begin(), a.unknown.end());
  }
  if (unknown.empty()) return text;
  const auto itself = [](const std::string& word) { return word; };
  return text + fmt::format(" (not known of all: {})", fmt::join(each_once(unknown, itself), ", "));
}

/// A row each, of those of relaxation or of creep: these have no quantity in common.
void add_rows_of(BriefText& text, const Validation& v, const std::vector<std::string>& names,
                 bool creep) {
  std::vector<RecordingComparison> recordings;
  TableSection section;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (v.recordings[i].creep != creep) continue;
    recordings.push_back(v.recordings[i]);
    section.rows.push_back({names[i]});
  }
  if (recordings.empty()) return;
  section.columns = {"recording"};
  const std::vector<QuantityComparison> quantities = each_quantity(recordings);
  for (const QuantityComparison& q : quantities) section.columns.push_back(q.name);
  section.columns.push_back("verdict");
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    std::vector<std::string>& row = section.rows[i];
    for (const QuantityComparison& q : quantities) {
      const QuantityComparison* own = same_quantity(recordings[i], q);
      row.push_back(own == nullptr ? "-" : error_text(own->e, unit_of(*own)));
    }
    row.push_back(cell_words(recordings[i].verdict));
  }
  add_table(text, std::move(section), Rank::recording, "recordings");
}

void add_each_recording(BriefText& text, const Validation& v) {
  const std::vector<std::string> names = names_of(v).names;
  for (const bool creep : {false, true}) add_rows_of(text, v, names, creep);
  for (const QuantityComparison& q : v.alone) {
    text.add_line(
        "in one only",
        fmt::format("{} {}: {}", q.name, error_text(q.e, unit_of(q)), cell_words(q.verdict)),
        Rank::context);
  }
  bool whole_said = false;
  for (const RecordingComparison& r : v.recordings) {
    whole_said = whole_said || (r.part.whole() && part_is_said(r));
    if (r.part.whole()) continue;
    const auto place = static_cast<std::size_t>(&r - v.recordings.data());
    text.add_line("compared", fmt::format("{}: {}", names[place], part_words(r, v.spec)),
                  Rank::context);
  }
  if (whole_said) {
    const bool all =
        std::ranges::all_of(v.recordings, [](const auto& r) { return r.part.whole(); });
    text.add_line("compared", all ? "the whole of each press" : "the whole of all other presses",
                  Rank::context);
  }
  text.add_line("applicability", applicability_text(v, names), Rank::context);
}

}  // namespace

std::string conclusion_words(const Validation& v) {
  if (v.verdict == ModelVerdict::residual) {
    return "calibration residual: the law was fitted to these data, so this validates nothing";
  }
  std::vector<std::string> named, alone, without;
  const auto add = [&](const std::string& name, const ErrorWithUncertainty& e, const Unit& unit,
                       bool rejected, ModelVerdict verdict) {
    if (verdict == ModelVerdict::no_requirement) without.push_back(name);
    const bool wanted =
        v.verdict == ModelVerdict::undetermined ? verdict == ModelVerdict::undetermined : rejected;
    const bool beyond = verdict == ModelVerdict::not_adequate || verdict == ModelVerdict::seen;
    if (beyond && !rejected) alone.push_back(name);
    if (wanted) named.push_back(fmt::format("{} {}", name, error_text(e, unit)));
  };
  for (const PooledQuantity& p : v.pooled) add(p.name, p.e, unit_of(p), p.rejected, p.verdict);
  for (const QuantityComparison& q : v.alone) add(q.name, q.e, unit_of(q), q.rejected, q.verdict);
  if (v.pooled.empty() && v.alone.empty()) {
    for (const RecordingComparison& r : v.recordings) {
      if (r.calibration) continue;
      for (const QuantityComparison& q : r.quantities) {
        add(q.name, q.e, unit_of(q), q.rejected, q.verdict);
      }
    }
  }
  const bool outside =
      std::ranges::any_of(v.applicability, [](const auto& a) { return !a.outside.empty(); });
  const auto unasked = fmt::format("{}", fmt::join(each_once(without, std::identity{}), ", "));
  const std::string list = fmt::format("{}", fmt::join(named, ", "));
  const std::string before_holm =
      alone.empty()
          ? ""
          : fmt::format("; beyond it before Holm's correction only: {}", fmt::join(alone, ", "));
  const std::string of = v.of_session() ? "of the rendering: " : "";
  switch (v.verdict) {
    case ModelVerdict::adequate:
      return fmt::format("{}adequate for {}{}{}", of, v.requirement,
                         unasked.empty() ? "" : "; nothing is required of " + unasked,
                         outside ? "; outside the calibration" : "");
    case ModelVerdict::not_adequate:
      return fmt::format("{}not adequate for {}: model error {}", of, v.requirement, list);
    case ModelVerdict::undetermined:
      return list.empty()
                 ? fmt::format("{}undetermined for {}: beyond it before Holm's correction only", of,
                               v.requirement)
                 : fmt::format("{}undetermined{}: {}{}", of,
                               v.requirement.empty() ? "" : " for " + v.requirement, list,
                               before_holm);
    case ModelVerdict::seen:
      return fmt::format("{}a model error of E +- U: {}", of, list);
    case ModelVerdict::no_requirement:
      return "the requirement has the unit of no quantity that was compared";
    default:
      break;
  }
  return of + std::string(verdict_words(ModelVerdict::not_seen)) + before_holm;
}

std::string to_terminal_text(const Validation& v) {
  BriefText text;
  add_header(text, v);
  if (v.recordings.size() == 1) {
    add_recording(text, v, 0);
  } else {
    if (!v.pooled.empty()) add_pooled(text, v);
    add_each_recording(text, v);
  }
  if (!v.session.empty()) text.add_line("rendered by", rendering_text(v), Rank::context);
  for (const std::string& words :
       each_once(v.recordings, [](const RecordingComparison& r) { return r.fillings; })) {
    if (!words.empty()) text.add_line("u_num", words, Rank::detail);
  }
  text.add_line("u_input", "from " + v.u_input_from, Rank::detail);
  for (const Remark& remark : v.remarks) text.add_line("note", remark.text, Rank::context);
  text.add_line("verdict", conclusion_words(v), Rank::always);
  return text.text();
}

}  // namespace tpm::fit
