// Declared in tpm/fit/validate/validation.hpp.

#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpm/show/json_table_csv.hpp"

namespace tpm::fit {
namespace {

Json remark_list(const std::optional<Remark>& remark) {
  return remark ? remarks_json(std::span(&*remark, 1)) : Json::array();
}

void put_error(Json& j, const ErrorWithUncertainty& e) {
  j["E"] = rounded(e.error);
  j["u_val"] = rounded(e.u_val);
  if (std::isfinite(e.degrees)) j["degrees_of_freedom"] = rounded(e.degrees);
  j["k"] = rounded(e.coverage);
  j["U"] = rounded(e.expanded());
}

Json quantity_json(const QuantityComparison& q) {
  Json j{{"quantity", q.name},
         {"unit", q.unit.symbol},
         {"S", rounded(q.simulated)},
         {"D", rounded(q.measured)}};
  put_error(j, q.e);
  j["u_num"] = rounded(q.u_num);
  j["u_input"] = rounded(q.u_input);
  j["u_D"] = rounded(q.u_D);
  j["parts"] = array_json(q.parts, [](const UncertaintyPart& part) {
    return Json{{"name", part.name}, {"u", rounded(part.u)}};
  });
  j["numerical"] = array_json(q.numerical, [](const UncertaintyPart& part) {
    return Json{{"name", part.name}, {"u", rounded(part.u)}};
  });
  if (q.limit) j["R"] = rounded(*q.limit);
  j["verdict"] = verdict_key(q.verdict);
  j["p_value"] = rounded(q.p_value);
  j["rejected_by_holm"] = q.rejected;
  j["remarks"] = remark_list(q.remark);
  return j;
}

Json applicability_json(const Applicability& a) {
  Json j{{"depth_SI", rounded(a.depth)},
         {"duration_s", rounded(a.duration_s)},
         {"rate_SI_per_s", rounded(a.rate)}};
  if (a.fitted_depth) j["calibration_depth_SI"] = rounded(*a.fitted_depth);
  if (a.fitted_duration_s) j["calibration_duration_s"] = rounded(*a.fitted_duration_s);
  if (a.slowest) j["calibration_slowest_SI_per_s"] = rounded(*a.slowest);
  if (a.fastest) j["calibration_fastest_SI_per_s"] = rounded(*a.fastest);
  j["outside"] = remarks_json(a.outside);
  j["unknown"] = a.unknown;
  return j;
}

Json recording_json(const RecordingComparison& r, const Applicability& a, const LawSpec& law) {
  Json j{{"recording", r.name}, {"sha256", r.sha256}, {"fitted", r.calibration}};
  if (r.creep) j["load_imposed"] = true;
  if (!r.pick.empty()) j["pick"] = r.pick;
  if (!r.fillings.empty()) j["u_num_of_spheres"] = r.fillings;
  Json part{{"from_s", rounded(r.part.from_s)},
            {"corner_s", rounded(r.part.corner_s)},
            {"to_s", rounded(r.part.to_s)},
            {"depth_SI", rounded(r.part.depth)},
            {"depth_of_all_SI", rounded(r.part.depth_of_all)},
            {"hold_s", rounded(r.part.hold_s)},
            {"loaded_s", rounded(r.part.loaded_s)},
            {"left_out_s", rounded(r.part.left_out_s)},
            {"whole", r.part.whole()},
            {"summary", part_words(r, law)}};
  if (r.part.hold_asked_s) {
    part["hold_asked_s"] = rounded(*r.part.hold_asked_s);
  }
  j["compared"] = std::move(part);
  j["quantities"] = array_json(r.quantities, quantity_json);
  j["not_compared"] = remarks_json(r.without);
  Json joint{{"rank", r.joint.rank}};
  if (r.joint.rank > 0) {
    joint["T_squared"] = rounded(r.joint.t_squared);
    joint["F"] = rounded(r.joint.f);
    joint["p_value"] = rounded(r.joint.p_value);
    if (std::isfinite(r.joint.degrees)) joint["degrees_of_freedom"] = rounded(r.joint.degrees);
  }
  joint["dependent"] = r.joint.dependent;
  if (!r.joint.unknown.empty()) joint["without"] = r.joint.unknown;
  j["together"] = joint;
  j["curve"] = {{"samples", r.curve.samples},
                {"mean_square_E", rounded(r.curve.mean_square_error)},
                {"mean_square_u", rounded(r.curve.mean_square_u)},
                {"chi_squared", rounded(r.curve.chi_squared)}};
  const ValidationPlacement& p = r.placement;
  Json placement{{"contact", rounded(p.contact)},   {"contact_u", rounded(p.contact_u)},
                 {"contact_from", p.contact_words}, {"zero", rounded(p.zero)},
                 {"zero_u", rounded(p.zero_u)},     {"zero_readings", p.zero_readings}};
  if (p.drift) {
    placement["zero_drift_per_s"] = rounded(p.drift->per_s);
    placement["zero_drift_u_per_s"] = rounded(p.drift->u_per_s);
  }
  if (p.onset) placement["onset"] = rounded(*p.onset);
  if (p.onset_u) placement["onset_u"] = rounded(*p.onset_u);
  if (p.contact_moved) placement["contact_moved_in_u"] = rounded(*p.contact_moved);
  if (p.zero_moved) placement["zero_moved_in_u"] = rounded(*p.zero_moved);
  j["placement"] = placement;
  j["scatter"] = {{"sigma", rounded(r.scatter.sigma)},
                  {"phi", rounded(r.scatter.phi)},
                  {"degrees_of_freedom", rounded(r.scatter.degrees)},
                  {"from", r.scatter.told_by}};
  if (!r.rises.empty()) {
    j["unseen_rises"] = array_json(r.rises, [](const UnseenRise& rise) {
      return Json{{"begin_s", rounded(rise.begin_s)},
                  {"end_s", rounded(rise.end_s)},
                  {"delay_s", rounded(rise.expected().delay_s)},
                  {"u_s", rounded(rise.u_s())}};
    });
  }
  if (r.instrument) j["instrument"] = r.instrument->stated;
  j["same_instrument"] = r.same_instrument;
  if (!r.probe.empty()) j["probe"] = r.probe;
  j["applicability"] = applicability_json(a);
  j["verdict"] = verdict_key(r.verdict);
  return j;
}

Json pooled_json(const PooledQuantity& p) {
  Json j{{"quantity", p.name},
         {"unit", p.relative ? "1" : p.unit.symbol},
         {"recordings", p.recordings},
         {"share_of_S", p.relative}};
  if (!p.relative) {
    j["S"] = rounded(p.simulated);
    j["D"] = rounded(p.measured);
  }
  put_error(j, p.e);
  j["u_shared"] = rounded(p.u_shared);
  j["sd_between"] = rounded(p.between);
  if (p.limit) j["R"] = rounded(*p.limit);
  if (p.limit_at) j["R_at"] = *p.limit_at;
  j["verdict"] = verdict_key(p.verdict);
  j["p_value"] = rounded(p.p_value);
  j["rejected_by_holm"] = p.rejected;
  j["remarks"] = remark_list(p.remark);
  if (p.area) {
    Json area{{"area", rounded(p.area->area)},
              {"mean_of_draws", rounded(p.area->null_mean)},
              {"upper_95_of_draws", rounded(p.area->null_95)},
              {"p_value", rounded(p.area->p_value)}};
    if (p.area->lower) area["lower"] = rounded(*p.area->lower);
    if (p.area->upper) area["upper"] = rounded(*p.area->upper);
    if (p.area_at) area["at"] = *p.area_at;
    j["area_metric"] = area;
  }
  return j;
}

}  // namespace

Json to_json(const Validation& v) {
  Json j{{"law_file", v.law_file},
         {"law_sha256", v.law_sha256},
         {"law", law_name(v.spec)},
         {"subject", v.subject}};
  j["calibration"] = array_json(v.calibration, [](const CalibrationData::File& f) {
    Json file{{"name", f.name}, {"sha256", f.sha256}, {"found", f.recording.has_value()}};
    if (!f.samples_sha256.empty()) file["samples_sha256"] = f.samples_sha256;
    return file;
  });
  if (!v.session.empty()) {
    j["session"] = v.session;
    j["rendering"] = array_json(v.rendering, [&v](const RenderingError& e) {
      return Json{{"quantity", quantity_words(e.quantity, v.spec.drive, v.spec.response)},
                  {"mean", rounded(e.mean)},
                  {"limit", rounded(e.limit)},
                  {"presses", e.presses}};
    });
  }
  j["requirement"] = v.requirement.empty() ? Json("none") : Json(v.requirement);
  j["placement"] = placement_rule_name(v.placement);
  j["u_input_from"] = v.u_input_from;
  if (v.new_specimen) {
    j["new_specimen"] = array_json(v.specimens, [&v](const SpecimenSpread& s) {
      const LawSpec& law = v.spec;
      return Json{{"quantity", s.creep ? quantity_words(s.quantity, law.response, law.drive)
                                       : quantity_words(s.quantity, law.drive, law.response)},
                  {"load_imposed", s.creep},
                  {"recordings", s.recordings},
                  {"tau_share_of_S", rounded(s.tau())},
                  {"tau_share_of_S_at_most", rounded(s.tau_at_most())},
                  {"degrees_of_freedom", s.degrees()}};
    });
  }
  j["recordings"] = Json::array();
  for (std::size_t i = 0; i < v.recordings.size(); ++i) {
    j["recordings"].push_back(recording_json(v.recordings[i], v.applicability[i], v.spec));
  }
  if (!v.pooled.empty()) j["pooled"] = array_json(v.pooled, pooled_json);
  if (!v.alone.empty()) j["in_one_only"] = array_json(v.alone, quantity_json);
  j["remarks"] = remarks_json(v.remarks);
  j["verdict"] = verdict_key(v.verdict);
  j["summary"] = conclusion_words(v);
  return j;
}

std::string to_csv(const Validation& v) {
  const Json all = to_json(v);
  Json rows = Json::array();
  const auto add = [&rows](const Json& recording, const Json& quantity) {
    Json& row = rows.emplace_back(Json{{"recording", recording}});
    for (const auto& [key, value] : quantity.items()) {
      if (key != "remarks") row[key] = value;
      if (key == "remarks" && !value.empty()) row["remark"] = value.front().at("text");
    }
  };
  const auto add_verdict = [&](const Json& recording, const Json& verdict) {
    add(recording, Json{{"quantity", "all quantities"}, {"verdict", verdict}});
  };
  for (const Json& r : all.at("recordings")) {
    for (const Json& quantity : r.at("quantities")) add(r.at("recording"), quantity);
    add_verdict(r.at("recording"), r.at("verdict"));
  }
  for (Json quantity : all.value("pooled", Json::array())) {
    quantity.erase("recordings");
    add("mean", quantity);
  }
  if (v.recordings.size() > 1) add_verdict("mean", all.at("verdict"));
  return json_table_csv(rows);
}

}  // namespace tpm::fit
