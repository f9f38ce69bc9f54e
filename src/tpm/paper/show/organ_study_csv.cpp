// Declared in tpm/paper/show/organ_study_report.hpp.

#include "tpm/base/text.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/paper/show/organ_study_report.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;
using Cells = std::vector<std::string>;

std::string text_of(double value) {
  constexpr int kDigits = 5;
  return significant(value, kDigits);
}

Cells joined(Cells a, const Cells& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Which curve a line belongs to.
const Cells kCurveColumns{"material", "tissue", "experiment", "depth_m", "rate_m_per_s", "load_N"};

Cells curve_cells(const OrganStudy& study, const StudyCurves& set, const StudyCurve& curve) {
  const StudyCondition& c = study.config.conditions[curve.condition];
  const bool ramp = c.kind == Kind::ramp_hold;
  return {set.material,
          study.config.tissues[curve.tissue].name,
          std::string(protocol_kind_name(c.kind)),
          ramp ? text_of(c.depth_m) : "",
          ramp ? text_of(c.rate_m_per_s) : "",
          c.kind == Kind::creep ? text_of(c.load_N) : ""};
}

const Cells kPointColumns{"at_depth_m", "at_time_s", "force_N", "response_depth_m"};

Cells point_cells(Kind kind, double x, double response) {
  const bool over_depth = kind == Kind::static_;
  const bool depth = kind == Kind::creep;
  return {over_depth ? text_of(x) : "", over_depth ? "" : text_of(x),
          depth ? "" : text_of(response), depth ? text_of(response) : ""};
}

}  // namespace

std::string readings_csv(const OrganStudy& study) {
  std::string text =
      csv_line(joined(joined(kCurveColumns, kPointColumns), {"reading", "against_first"}));
  for (const StudyCurves& set : study.curves) {
    for (const StudyCurve& curve : set.curves) {
      const Kind kind = study.config.conditions[curve.condition].kind;
      for (const StudyReading& r : curve.readings) {
        const Cells cells =
            joined(curve_cells(study, set, curve), point_cells(kind, r.x, r.response));
        text +=
            csv_line(joined(cells, {r.label, r.against_first ? text_of(*r.against_first) : ""}));
      }
    }
  }
  return text;
}

std::string curves_csv(const OrganStudy& study) {
  std::string text = csv_line(joined(kCurveColumns, kPointColumns));
  for (const StudyCurves& set : study.curves) {
    for (const StudyCurve& curve : set.curves) {
      const Kind kind = study.config.conditions[curve.condition].kind;
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        text += csv_line(joined(curve_cells(study, set, curve),
                                point_cells(kind, curve.x[i], curve.response[i])));
      }
    }
  }
  return text;
}

std::string fits_csv(const OrganStudy& study) {
  std::string text = csv_line({"fit", "tissue", "parameter", "SI_unit", "estimate_SI", "lower_SI",
                               "upper_SI", "verdict", "chi_square", "values", "bands"});
  for (const TissueFit& made : study.fits) {
    if (!made.result) continue;
    const FitResult& fit = *made.result;
    for (const ParameterResult& p : fit.parameters) {
      text += csv_line({study.config.fits[made.fit].name, study.config.tissues[made.tissue].name,
                        p.parameter.name, std::string(si_symbol(p.parameter.unit.dimension)),
                        text_of(p.estimate), p.lower ? text_of(*p.lower) : "",
                        p.upper ? text_of(*p.upper) : "", verdict_text(p), text_of(fit.chi_square),
                        std::to_string(fit.value_count), std::to_string(fit.band_count)});
    }
  }
  return text;
}

}  // namespace tpm::paper
