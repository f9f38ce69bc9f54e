// What a law put on an organ writes and says: scene, session, JSON, terminal, CSV.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/core/text.hpp"
#include "tpm/law/law_json.hpp"
#include "tpm/study/organ_bonds.hpp"
#include "tpm/study/organ_material_parts.hpp"

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

Json matrix_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) row.push_back(matrix(i, k));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string quantity(double value, const char* unit) {
  constexpr int kDigits = 10;
  return fmt::format("{} {}", shortest(rounded(value, kDigits)), unit);
}

ForceMismatch mismatch(const OrganMaterial& m, const std::vector<double>& force,
                       const std::vector<double>& target, const Protocol& motion,
                       const std::vector<bool>& asked = {}) {
  ForceMismatch r;
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    if (!asked.empty() && !asked[i]) continue;
    const double part = (force[i] - target[i]) / m.peak_N;
    squares += part * part;
    ++count;
    if (std::abs(part) <= r.largest) continue;
    r.largest = std::abs(part);
    r.at_s = m.time_s[i];
    r.depth_m = m.depth_m[i];
    const double h = 1e-6 * (motion.end_s() - motion.start_s());
    const double before = std::max(r.at_s - h, motion.start_s());
    r.rate_m_per_s = (m.depth_m[i] - value_at(motion, before)) / std::max(r.at_s - before, h);
  }
  r.rms = count > 0 ? std::sqrt(squares / count) : 0.0;
  return r;
}

/// The motion as a block of a scene, where the scene says nothing: a ramp and a hold.
Json ramp_block(const OrganMaterial& m, double rate_m_per_s) {
  const double deepest = *std::max_element(m.depth_m.begin(), m.depth_m.end());
  const double ramp_s = deepest / rate_m_per_s;
  const double hold_s = std::max(m.time_s.back() - m.time_s.front() - ramp_s, 1.0);
  constexpr int kDigits = 4;
  const auto text = [](double value, const char* unit) {
    return fmt::format("{} {}", significant(value, kDigits), unit);
  };
  return {{"kind", "ramp_hold"},
          {"depth", text(1e3 * deepest, "mm")},
          {"rate", text(1e3 * rate_m_per_s, "mm/s")},
          {"hold", text(hold_s, "s")}};
}

/// Depth over time of the ramp: of the way from 10 to 90 % of the depth.
double ramp_rate(const OrganMaterial& m) {
  const double first = m.depth_m.front();
  const double deepest = *std::max_element(m.depth_m.begin(), m.depth_m.end());
  const auto when = [&](double share) {
    const double level = first + share * (deepest - first);
    std::size_t i = 0;
    while (m.depth_m[i] < level) ++i;
    return std::pair{m.time_s[i], m.depth_m[i]};
  };
  const auto [t1, u1] = when(0.1);
  const auto [t2, u2] = when(0.9);
  if (t2 > t1) return (u2 - u1) / (t2 - t1);
  return deepest / std::max(m.time_s.back() - m.time_s.front(), 1e-3);
}

}  // namespace

Json material_block(const BondMaterial& m, const Json& before) {
  Json block{{"Einf", quantity(m.equilibrium_Pa, "Pa")}, {"Eprime", quantity(m.lateral_Pa, "Pa")}};
  Json branches = Json::array();
  for (const auto& [modulus, time] : m.branches) {
    branches.push_back({{"g", quantity(modulus, "Pa")}, {"tau", quantity(time, "s")}});
  }
  if (!branches.empty()) block["branches"] = std::move(branches);
  const auto add_function = [&](const char* key, const ElongationFunction& function) {
    if (function.is_linear()) return;
    block[key] = {{"shape", "cubic"}, {"stiffening", quantity(1e3 * function.length_m, "mm")}};
  };
  add_function("potential", m.potential);
  add_function("kernel", m.kernel);
  for (const char* key : {"A0", "l0", "between", "regions"}) {
    if (before.contains(key)) block[key] = before.at(key);
  }
  return block;
}

void add_protocol_and_session(OrganMaterial& m) {
  const double rate = ramp_rate(m);
  const Json ramp = ramp_block(m, rate);
  m.scene["description"] = fmt::format("material: law {} put on the organ {}", m.law, m.motion);
  if (!m.scene.contains("protocol")) {
    m.scene["protocol"] = ramp;
    if (!m.scene.contains("contacts")) m.scene["contacts"] = Json::array({{{"kind", "sphere"}}});
  }
  Json tissue = Json::object();
  for (const char* key : {"organ", "bonds", "material", "anchors", "guides"}) {
    if (m.scene.contains(key)) tissue[key] = m.scene.at(key);
  }
  double longest_s = 0.0;
  for (const auto& b : m.material.branches) longest_s = std::max(longest_s, b.relaxation_time_s);
  constexpr double kRests = 8.0, kLeastRest_s = 5.0;
  m.session = {
      {"title", fmt::format("{} on an organ", m.law)},
      {"model", {{"kind", "network"}, {"scene", std::move(tissue)}}},
      {"rate", "1 kHz"},
      {"indentations",
       {{"depths", Json::array({ramp.at("depth")})},
        {"rates", Json::array({ramp.at("rate")})},
        {"hold", ramp.at("hold")},
        {"rest",
         fmt::format("{} s", significant(std::max(kRests * longest_s, kLeastRest_s), 3))}}}};
}

void compare(OrganMaterial& m, const Protocol& motion) {
  m.start = mismatch(m, m.correspondence_N, m.law_N, motion);
  m.organ = mismatch(m, m.organ_N, m.law_N, motion);
  const double deepest = *std::max_element(m.depth_m.begin(), m.depth_m.end());
  std::vector<bool> ramp(m.time_s.size()), hold(m.time_s.size());
  constexpr double kHeld = 0.02;  // of the deepest depth from there on
  bool reached = false;
  for (std::size_t i = 0; i < m.time_s.size(); ++i) {
    reached = reached || m.depth_m[i] >= (1.0 - kHeld) * deepest;
    (reached ? hold : ramp)[i] = true;
  }
  m.ramp = mismatch(m, m.organ_N, m.law_N, motion, ramp);
  m.hold = mismatch(m, m.organ_N, m.law_N, motion, hold);
  if (m.measured_N.empty()) return;
  m.law_to_recording = mismatch(m, m.law_N, m.measured_N, motion);
  m.organ_to_recording = mismatch(m, m.organ_N, m.measured_N, motion);
}

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
    parameters[bond_parameter_key(p.parameter.name)] = std::move(entry);
    order.push_back(bond_parameter_key(p.parameter.name));
  }
  json["parameters"] = std::move(parameters);
  if (m.covariance.size() > 0) {
    Json of_law = Json::array();
    const std::vector<LawParameter> table = law_parameters(m.fitted_law.spec);
    for (const std::size_t place : m.fitted_law.uncertainty->place) {
      of_law.push_back(law_key(table[place]));
    }
    json["uncertainty"] = {{"parameters", std::move(order)},
                           {"coordinate", "log"},
                           {"covariance", matrix_json(m.covariance)},
                           {"law_parameters", std::move(of_law)},
                           {"follows_law", matrix_json(m.follows)},
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
  json["fitted_law"] = to_json(m.fitted_law);
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
