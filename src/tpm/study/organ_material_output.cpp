// What a law put on an organ says: JSON, terminal, CSV.
#include <fmt/format.h>

#include "tpm/core/text.hpp"
#include "tpm/study/organ_material.hpp"

namespace tpm {
namespace {

constexpr int kMaterialDigits = 8;

Json mismatch_json(const ForceMismatch& m) {
  return {{"largest_over_peak", rounded(m.largest, kMaterialDigits)},
          {"rms_over_peak", rounded(m.rms, kMaterialDigits)},
          {"largest_at_s", rounded(m.at_s, kMaterialDigits)},
          {"largest_at_depth_m", rounded(m.depth_m, kMaterialDigits)},
          {"largest_at_rate_m_per_s", rounded(m.rate_m_per_s, kMaterialDigits)}};
}

std::string mismatch_words(const char* what, const ForceMismatch& m) {
  return fmt::format("  {:<26} {:>9} {:>9}   at {} s, {} mm, {} mm/s\n", what,
                     significant(100.0 * m.largest, 3), significant(100.0 * m.rms, 3),
                     significant(m.at_s, 4), significant(1e3 * m.depth_m, 3),
                     significant(1e3 * m.rate_m_per_s, 3));
}

std::string parameter_key(const FitParameter& p) {
  if (p.name.starts_with("tau")) return p.name + "_s";
  return p.name + (p.name == "stiffening" ? "_m" : "_Pa");
}

}  // namespace

Json to_json(const OrganMaterial& m) {
  Json json{{"law", m.law}, {"motion", m.motion}, {"peak_N", rounded(m.peak_N, kMaterialDigits)}};
  Json parameters = Json::object();
  Json order = Json::array();
  for (const OrganMaterialParameter& p : m.parameters) {
    Json entry{{"value", rounded(p.value, kMaterialDigits)},
               {"start", rounded(p.start, kMaterialDigits)},
               {"at_bound", p.at_bound}};
    if (p.lower) {
      entry["lower"] = rounded(*p.lower, kMaterialDigits);
      entry["upper"] = rounded(*p.upper, kMaterialDigits);
    }
    parameters[parameter_key(p.parameter)] = std::move(entry);
    order.push_back(parameter_key(p.parameter));
  }
  json["parameters"] = std::move(parameters);
  if (m.covariance.size() > 0) {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < m.covariance.rows(); ++i) {
      Json row = Json::array();
      for (Eigen::Index k = 0; k < m.covariance.cols(); ++k) row.push_back(m.covariance(i, k));
      rows.push_back(std::move(row));
    }
    json["uncertainty"] = {{"parameters", std::move(order)},
                           {"coordinate", "log"},
                           {"covariance", std::move(rows)},
                           {"level", m.level},
                           {"quantile", rounded(m.quantile, kMaterialDigits)}};
  }
  json["correspondence_less_law"] = mismatch_json(m.start);
  json["organ_less_law"] = mismatch_json(m.organ);
  json["organ_less_law_on_the_way_in"] = mismatch_json(m.ramp);
  json["organ_less_law_held"] = mismatch_json(m.hold);
  if (m.law_to_recording) {
    json["law_less_recording"] = mismatch_json(*m.law_to_recording);
    json["organ_less_recording"] = mismatch_json(*m.organ_to_recording);
  }
  json["flags"] = m.flags;
  json["scene"] = m.scene;
  return json;
}

std::string to_terminal_text(const OrganMaterial& m) {
  std::string text = fmt::format("{} put on an organ {}, peak {} N\n\n", m.law, m.motion,
                                 significant(m.peak_N, 4));
  text +=
      fmt::format("  {:<12} {:>12} {:>12}   {}\n", "bonds", "start", "fitted",
                  m.quantile > 0.0 ? fmt::format("{} % interval", significant(100.0 * m.level, 3))
                                   : std::string("no interval"));
  for (const OrganMaterialParameter& p : m.parameters) {
    const Unit& unit = p.parameter.unit;
    const auto shown = [&](double v) { return significant(v / unit.to_si, 4); };
    text +=
        fmt::format("  {:<12} {:>12} {:>12}   ", p.parameter.name, shown(p.start), shown(p.value));
    if (p.lower) text += fmt::format("{} .. {} ", shown(*p.lower), shown(*p.upper));
    text += unit.symbol;
    text += p.at_bound ? " (at a bound)\n" : "\n";
  }
  text += fmt::format("\n  {:<26} {:>9} {:>9}\n", "in % of the peak", "largest", "rms");
  text += mismatch_words("correspondence less law", m.start);
  text += mismatch_words("fitted organ less law", m.organ);
  text += mismatch_words("  on the way in", m.ramp);
  text += mismatch_words("  held", m.hold);
  if (m.law_to_recording) {
    text += mismatch_words("law less recording", *m.law_to_recording);
    text += mismatch_words("organ less recording", *m.organ_to_recording);
  }
  text += fmt::format(
      "\nthe organ cannot reproduce {} % of the law's peak ({} % rms); it is worst at {} mm and {} "
      "mm/s\n",
      significant(100.0 * m.organ.largest, 3), significant(100.0 * m.organ.rms, 3),
      significant(1e3 * m.organ.depth_m, 3), significant(1e3 * m.organ.rate_m_per_s, 3));
  for (const std::string& flag : m.flags) text += "! " + flag + "\n";
  return text;
}

std::string to_csv(const OrganMaterial& m) {
  std::string text = "time_s,depth_m,law_N,correspondence_N,organ_N";
  if (!m.measured_N.empty()) text += ",measured_N";
  text += "\n";
  constexpr int kDigits = 9;
  for (std::size_t i = 0; i < m.time_s.size(); ++i) {
    text += significant(m.time_s[i], kDigits);
    for (const auto* column : {&m.depth_m, &m.law_N, &m.correspondence_N, &m.organ_N}) {
      text += "," + significant((*column)[i], kDigits);
    }
    if (!m.measured_N.empty()) text += "," + significant(m.measured_N[i], kDigits);
    text += "\n";
  }
  return text;
}

}  // namespace tpm
