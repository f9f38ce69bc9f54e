// Declared in tpm/paper/organ_study.hpp.
// A study of the paper's experiments as JSON.

#include "tpm/base/text.hpp"
#include "tpm/paper/organ_study.hpp"

namespace tpm::paper {
namespace {

using Kind = ProtocolChoice::Kind;

constexpr int kStudyDigits = 5;

double number(double value) {
  return rounded(value, kStudyDigits);
}

Json parameters_json(const TpmVector& p) {
  return {{"E1_Pa", number(p[kE1])},
          {"E2_Pa", number(p[kE2])},
          {"Eprime_Pa", number(p[kEprime])},
          {"eta1_Pa_s", number(p[kEta1])},
          {"spacing_m", number(p[kSpacing])},
          {"A0_m2", number(p[kA0])},
          {"l0_m", number(p[kL0])}};
}

Json materials_json(const OrganStudy& study) {
  Json list = Json::array();
  for (std::size_t i = 0; i < study.config.materials.size(); ++i) {
    const StudyMaterial& m = study.config.materials[i];
    Json j{{"name", m.name},
           {"fit", study.config.fits[m.fit].name},
           {"tissue", study.config.tissues.front().name}};
    j["fixed"] = Json::array();
    for (const auto& [name, value] : m.fixed.values) j["fixed"].push_back(name);
    j["parameters"] = parameters_json(study.curves[i].parameters.value());
    list.push_back(std::move(j));
  }
  return list;
}

Json fits_json(const OrganStudy& study) {
  return array_json(study.fits, [&](const TissueFit& made) {
    Json j{{"fit", study.config.fits[made.fit].name},
           {"tissue", study.config.tissues[made.tissue].name}};
    j["failure"] = made.failure.empty() ? Json(nullptr) : Json(made.failure);
    j["result"] = made.result ? to_json(*made.result) : Json(nullptr);
    return j;
  });
}

/// The imposed condition, under keys with units.
Json condition_json(const StudyCondition& c) {
  Json j{{"experiment", protocol_kind_name(c.kind)}};
  if (c.kind == Kind::creep) {
    j["load_N"] = number(c.load_N);
  } else {
    j["depth_m"] = number(c.depth_m);
  }
  if (c.kind == Kind::ramp_hold) j["rate_m_per_s"] = number(c.rate_m_per_s);
  if (c.kind != Kind::static_) j["duration_s"] = number(c.duration_s);
  return j;
}

Json curve_json(const OrganStudy& study, const StudyCurve& curve) {
  const StudyCondition& c = study.config.conditions[curve.condition];
  Json j = condition_json(c);
  j["tissue"] = study.config.tissues[curve.tissue].name;
  j["failure"] = curve.failure.empty() ? Json(nullptr) : Json(curve.failure);
  j["readings"] = array_json(curve.readings, [&](const StudyReading& r) {
    Json reading{{"label", r.label}};
    reading.update(point_json(c, r.x, r.response));
    if (r.against_first) reading["against_first"] = rounded(*r.against_first, 4);
    return reading;
  });
  return j;
}

Json curves_json(const OrganStudy& study) {
  return array_json(study.curves, [&](const StudyCurves& set) {
    Json j{{"material", set.material}, {"answers", Json::array()}};
    for (const StudyCurve& curve : set.curves) {
      j["answers"].push_back(curve_json(study, curve));
    }
    return j;
  });
}

}  // namespace

Json point_json(const StudyCondition& condition, double x, double response) {
  return {{condition.kind == Kind::static_ ? "depth_m" : "time_s", number(x)},
          {condition.kind == Kind::creep ? "depth_m" : "force_N", number(response)}};
}

Json to_json(const OrganStudy& study) {
  Json tissues = array_json(study.config.tissues, [](const StudyTissue& t) {
    return Json{{"name", t.name}, {"scene", t.scene.empty() ? Json(nullptr) : Json(t.scene)}};
  });
  Json j{{"title", study.config.title}, {"tissues", std::move(tissues)}};
  j["materials"] = materials_json(study);
  j["fits"] = fits_json(study);
  j["curves"] = curves_json(study);
  return j;
}

}  // namespace tpm::paper
