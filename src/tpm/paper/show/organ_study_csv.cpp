// Declared in tpm/paper/show/organ_study_report.hpp.
#include "tpm/paper/show/organ_study_report.hpp"
#include "tpm/show/json_table_csv.hpp"

namespace tpm::paper {
namespace {

/// The answers of the study's JSON, each with its material.
Json answer_rows(const OrganStudy& study) {
  const Json all = to_json(study);
  Json rows = Json::array();
  for (const Json& set : all.at("curves")) {
    for (const Json& answer : set.at("answers")) {
      Json& row = rows.emplace_back(Json{{"material", set.at("material")}});
      row.update(answer);
    }
  }
  return rows;
}

}  // namespace

std::string readings_csv(const OrganStudy& study) {
  return json_table_csv(answer_rows(study), "/readings", {"material", "experiment"});
}

std::string curves_csv(const OrganStudy& study) {
  Json rows = answer_rows(study);
  auto row = rows.begin();
  for (const StudyCurves& set : study.curves) {
    for (const StudyCurve& curve : set.curves) {
      row->erase("readings");
      Json& points = (*row++)["points"] = Json::array();
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        points.push_back(
            point_json(study.config.conditions[curve.condition], curve.x[i], curve.response[i]));
      }
    }
  }
  return json_table_csv(rows, "/points", {"material", "experiment"});
}

std::string fits_csv(const OrganStudy& study) {
  const Json all = to_json(study);
  Json rows = Json::array();
  for (const Json& made : all.at("fits")) {
    const Json& fit = made.at("result");
    for (const Json& parameter : fit.is_null() ? Json::array() : fit.at("parameters")) {
      Json& row = rows.emplace_back(Json{{"fit", made.at("fit")}, {"tissue", made.at("tissue")}});
      row.update(parameter);
      for (const char* key : {"chi_square", "values_fitted", "bands_fitted"})
        row[key] = fit.at(key);
    }
  }
  return json_table_csv(rows, {}, {"fit", "tissue", "name", "SI_unit"});
}

}  // namespace tpm::paper
