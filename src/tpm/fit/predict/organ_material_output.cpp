// Declared in tpm/fit/predict/organ_material_parts.hpp.
// Output of a law put on an organ: scene, session, JSON, terminal, CSV.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/predict/organ_bonds.hpp"
#include "tpm/fit/predict/organ_material_parts.hpp"
#include "tpm/fit/sample_digest.hpp"

namespace tpm::fit {
namespace {

constexpr int kMaterialDigits = 8;

Json mismatch_json(const ForceMismatch& m) {
  return {{"largest_over_peak", rounded(m.largest, kMaterialDigits)},
          {"rms_over_peak", rounded(m.rms, kMaterialDigits)},
          {"largest_at_s", rounded(m.at_s, kMaterialDigits)},
          {"largest_at_depth_m", rounded(m.depth_m, kMaterialDigits)},
          {"largest_at_rate_m_per_s", rounded(m.rate_m_per_s, kMaterialDigits)}};
}

std::string mismatch_words(std::string_view what, const ForceMismatch& m) {
  return fmt::format("  {:<26} {:>9} {:>9}   at {} s, {} mm, {} mm/s\n", what,
                     significant(100.0 * m.largest, 3), significant(100.0 * m.rms, 3),
                     significant(m.at_s, 4), significant(1e3 * m.depth_m, 3),
                     significant(1e3 * m.rate_m_per_s, 3));
}

Json matrix_json(const Eigen::MatrixXd& matrix) {
  return array_json(matrix.rowwise(),
                    [](const auto& row) { return array_json(row, std::identity()); });
}

/// Its name and SI unit: "Einf_Pa".
std::string parameter_key(const FitParameter& parameter) {
  const std::string_view symbol = si_symbol(parameter.unit.dimension);
  return fmt::format("{}{}{}", parameter.name, symbol.empty() ? "" : "_", symbol);
}

/// One of the forces of a course.
using CourseForce = std::vector<double> MaterialCourse::*;

/// Adds up how one force differs from another over parts of several courses.
class MismatchSum {
 public:
  explicit MismatchSum(double peak_N) : peak_N_(peak_N) {}

  /// @param asked which samples; all if it is empty
  void add(const MaterialCourse& c, CourseForce force, CourseForce target, const Protocol& motion,
           const std::vector<bool>& asked = {}) {
    for (std::size_t i = 0; i < (c.*force).size(); ++i) {
      if (!asked.empty() && !asked[i]) continue;
      const double part = ((c.*force)[i] - (c.*target)[i]) / peak_N_;
      squares_ += part * part;
      ++count_;
      if (std::abs(part) <= sum_.largest) continue;
      sum_.largest = std::abs(part);
      sum_.recording = c.name;
      sum_.at_s = c.time_s[i];
      sum_.depth_m = c.depth_m[i];
      const double h = 1e-6 * (motion.end_s() - motion.start_s());
      const double before = std::max(sum_.at_s - h, motion.start_s());
      sum_.rate_m_per_s =
          (c.depth_m[i] - value_at(motion, before)) / std::max(sum_.at_s - before, h);
    }
  }
  [[nodiscard]] ForceMismatch result() const {
    ForceMismatch r = sum_;
    r.rms = count_ > 0 ? std::sqrt(squares_ / count_) : 0.0;
    return r;
  }

 private:
  double peak_N_;
  ForceMismatch sum_;
  double squares_ = 0.0;
  int count_ = 0;
};

double deepest_of(const MaterialCourse& c) {
  return *std::max_element(c.depth_m.begin(), c.depth_m.end());
}

/// Depth over time of the ramp: of the way from 10 to 90 % of the depth.
double ramp_rate(const MaterialCourse& c) {
  const double first = c.depth_m.front();
  const double deepest = deepest_of(c);
  const auto when = [&](double share) {
    const double level = first + share * (deepest - first);
    std::size_t i = 0;
    while (c.depth_m[i] < level) ++i;
    return std::pair{c.time_s[i], c.depth_m[i]};
  };
  const auto [t1, u1] = when(0.1);
  const auto [t2, u2] = when(0.9);
  if (t2 > t1) return (u2 - u1) / (t2 - t1);
  return deepest / std::max(c.time_s.back() - c.time_s.front(), 1e-3);
}

/// True for samples before the deepest depth is reached.
std::vector<bool> on_the_way_in(const MaterialCourse& c) {
  constexpr double kHeld = 0.02;  // of the deepest depth from there on
  const double deepest = deepest_of(c);
  std::vector<bool> ramp(c.time_s.size());
  bool reached = false;
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    reached = reached || c.depth_m[i] >= (1.0 - kHeld) * deepest;
    ramp[i] = !reached;
  }
  return ramp;
}

Json limit_json(const std::optional<double>& limit) {
  return limit ? Json(rounded(*limit, kMaterialDigits)) : Json(nullptr);
}

/// "contact_1_m" of the parameters of a recording.
std::string placement_key(const FitParameter& p) {
  return p.name + (p.unit.dimension == Dimension::force ? "_N" : "_m");
}

Json course_json(const OrganMaterial& m, const MaterialCourse& c) {
  Json entry{{"name", c.name},
             {"law_contact_m", rounded(c.by_law.contact_m, kMaterialDigits)},
             {"law_offset_N", rounded(c.by_law.offset_N, kMaterialDigits)},
             {"organ_less_law", mismatch_json(c.organ)}};
  if (m.readings) {
    entry["contact_m"] = rounded(c.by_organ.contact_m, kMaterialDigits);
    entry["offset_N"] = rounded(c.by_organ.offset_N, kMaterialDigits);
  }
  if (c.law_to_recording) {
    entry["law_less_recording"] = mismatch_json(*c.law_to_recording);
    entry["organ_less_recording"] = mismatch_json(*c.organ_to_recording);
  }
  return entry;
}

/// Result of the fit to the readings: intervals and profiles of all its parameters.
Json readings_json(const OrganMaterial& m) {
  const ReadingsFit& r = *m.readings;
  Json parameters = Json::object();
  for (std::size_t i = 0; i < r.fit.parameters.size(); ++i) {
    const ParameterResult& p = r.fit.parameters[i];
    const std::string key =
        i < m.parameters.size() ? parameter_key(p.parameter) : placement_key(p.parameter);
    Json entry{{"value", rounded(p.estimate, kMaterialDigits)},
               {"lower", limit_json(p.lower)},
               {"upper", limit_json(p.upper)},
               {"verdict", verdict_name(p.verdict)}};
    Json values = Json::array(), rises = Json::array();
    for (const ProfilePoint& point : p.profile.points) {
      values.push_back(rounded(point.natural, kMaterialDigits));
      rises.push_back(rounded(point.deviance - r.fit.best.deviance, kMaterialDigits));
    }
    if (!values.empty()) {
      entry["profile"] = {{"value", std::move(values)}, {"deviance_rise", std::move(rises)}};
    }
    parameters[key] = std::move(entry);
  }
  return {{"readings", r.readings},
          {"independent_readings", rounded(r.independent, kMaterialDigits)},
          {"level", r.level},
          {"limit_deviance_rise", rounded(r.rise, kMaterialDigits)},
          {"parameters", std::move(parameters)}};
}

std::string interval_words(const OrganMaterial& m) {
  const std::string level = significant(100.0 * m.level, 3);
  if (m.intervals == MaterialIntervals::profiles)
    return fmt::format("{} % profile interval", level);
  if (m.intervals == MaterialIntervals::law && !(m.quantile > 0.0)) return "no interval";
  return fmt::format("{} % interval", level);
}

std::string limits_text(const std::optional<double>& lower, const std::optional<double>& upper,
                        const Unit& unit) {
  if (!lower && !upper) return "";
  const auto shown = [&](const std::optional<double>& v) {
    return v ? significant(*v / unit.to_si, 4) : std::string("open");
  };
  return fmt::format("{} .. {} ", shown(lower), shown(upper));
}

/// Contact and offset of every recording, by the law and by the organ.
std::string placement_text(const OrganMaterial& m) {
  std::string text = fmt::format("\n  {:<12} {:>12} {:>12}\n", "recordings", "law", "organ");
  const std::vector<ParameterResult>& found = m.readings->fit.parameters;
  for (std::size_t i = 0; i < m.courses.size(); ++i) {
    const MaterialCourse& c = m.courses[i];
    const double by_law[] = {c.by_law.contact_m, c.by_law.offset_N};
    for (std::size_t k = 0; k < 2; ++k) {
      const ParameterResult& p = found[m.parameters.size() + 2 * i + k];
      const Unit& unit = p.parameter.unit;
      text += fmt::format("  {:<12} {:>12} {:>12}   {}{}   {}\n", p.parameter.name,
                          significant(by_law[k] / unit.to_si, 4),
                          significant(p.estimate / unit.to_si, 4),
                          limits_text(p.lower, p.upper, unit), unit.symbol, k == 0 ? c.name : "");
    }
  }
  text += fmt::format("  {} readings count as {} independent ones\n", m.readings->readings,
                      significant(m.readings->independent, 3));
  return text;
}

}  // namespace

std::string scene_quantity(double value, std::string_view unit) {
  constexpr int kDigits = 10;
  return fmt::format("{} {}", shortest(rounded(value, kDigits)), unit);
}

Json ramp_hold_block(double depth_m, double rate_m_per_s, double hold_s) {
  constexpr int kDigits = 4;
  const auto text = [](double value, const char* unit) {
    return fmt::format("{} {}", significant(value, kDigits), unit);
  };
  return {{"kind", "ramp_hold"},
          {"depth", text(1e3 * depth_m, "mm")},
          {"rate", text(1e3 * rate_m_per_s, "mm/s")},
          {"hold", text(hold_s, "s")}};
}

Json material_block(const BondMaterial& m, const Json& before) {
  Json block{{"Einf", scene_quantity(m.equilibrium_Pa, "Pa")},
             {"Eprime", scene_quantity(m.lateral_Pa, "Pa")}};
  Json branches = Json::array();
  for (const auto& [modulus, time] : m.branches) {
    branches.push_back({{"g", scene_quantity(modulus, "Pa")}, {"tau", scene_quantity(time, "s")}});
  }
  if (!branches.empty()) block["branches"] = std::move(branches);
  const auto add_function = [&](const char* key, const ElongationFunction& function) {
    if (function.is_linear()) return;
    block[key] = {{"shape", function.shape_name()}};
    for (std::size_t k = 0; k < function.parameters().size(); ++k) {
      const MaterialParameter& p = function.parameters()[k];
      const double value = function.values()[k];
      if (p.dimension == Dimension::dimensionless) {
        block[key][p.name] = value;
        continue;
      }
      const Unit unit = shown_unit(p.dimension);
      block[key][p.name] = scene_quantity(value / unit.to_si, unit.symbol);
    }
  };
  add_function("potential", m.potential);
  add_function("kernel", m.kernel);
  for (const char* key : {"A0", "l0", "between", "regions"}) {
    if (before.contains(key)) block[key] = before.at(key);
  }
  return block;
}

Json network_session(std::string title, const Json& scene, const Json& ramp, double slowest_s) {
  Json tissue = Json::object();
  for (const char* key : {"organ", "bonds", "material", "anchors", "sliders"}) {
    if (scene.contains(key)) tissue[key] = scene.at(key);
  }
  constexpr double kRests = 8.0, kLeastRest_s = 5.0;
  return {{"title", std::move(title)},
          {"model", {{"kind", "network"}, {"scene", std::move(tissue)}}},
          {"rate", "1 kHz"},
          {"indentations",
           {{"depths", Json::array({ramp.at("depth")})},
            {"rates", Json::array({ramp.at("rate")})},
            {"hold", ramp.at("hold")},
            {"rest",
             fmt::format("{} s", significant(std::max(kRests * slowest_s, kLeastRest_s), 3))}}}};
}

void add_protocol_and_session(OrganMaterial& m) {
  const MaterialCourse& deepest = *std::ranges::max_element(m.courses, {}, deepest_of);
  const double depth_m = deepest_of(deepest);
  const double rate_m_per_s = ramp_rate(deepest);
  const double held_s = deepest.time_s.back() - deepest.time_s.front() - depth_m / rate_m_per_s;
  const Json ramp = ramp_hold_block(depth_m, rate_m_per_s, std::max(held_s, 1.0));
  m.scene["description"] = fmt::format("material: law {} put on the organ {}", m.law, m.motion);
  if (!m.scene.contains("protocol")) {
    m.scene["protocol"] = ramp;
    if (!m.scene.contains("contacts")) m.scene["contacts"] = Json::array({{{"kind", "sphere"}}});
  }
  double slowest_s = 0.0;
  for (const auto& b : m.material.branches) slowest_s = std::max(slowest_s, b.relaxation_time_s);
  m.session = network_session(fmt::format("{} on an organ", m.law), m.scene, ramp, slowest_s);
}

void compare(OrganMaterial& m, const std::vector<MaterialMotion>& motions) {
  using C = MaterialCourse;
  MismatchSum start(m.peak_N), organ(m.peak_N), ramp(m.peak_N), hold(m.peak_N);
  MismatchSum law_to_recording(m.peak_N), organ_to_recording(m.peak_N);
  const auto alone = [&](const C& c, CourseForce force, CourseForce target,
                         const Protocol& motion) {
    MismatchSum sum(m.peak_N);
    sum.add(c, force, target, motion);
    return sum.result();
  };
  for (std::size_t i = 0; i < motions.size(); ++i) {
    C& c = m.courses[i];
    const Protocol& motion = motions[i].protocol;
    std::vector<bool> part = on_the_way_in(c);
    start.add(c, &C::correspondence_N, &C::law_N, motion);
    organ.add(c, &C::organ_N, &C::law_N, motion);
    ramp.add(c, &C::organ_N, &C::law_N, motion, part);
    part.flip();
    hold.add(c, &C::organ_N, &C::law_N, motion, part);
    c.organ = alone(c, &C::organ_N, &C::law_N, motion);
    if (c.measured_N.empty()) continue;
    law_to_recording.add(c, &C::law_N, &C::measured_N, motion);
    organ_to_recording.add(c, &C::organ_N, &C::measured_N, motion);
    c.law_to_recording = alone(c, &C::law_N, &C::measured_N, motion);
    c.organ_to_recording = alone(c, &C::organ_N, &C::measured_N, motion);
  }
  m.start = start.result();
  m.organ = organ.result();
  m.ramp = ramp.result();
  m.hold = hold.result();
  if (m.courses.front().measured_N.empty()) return;
  m.law_to_recording = law_to_recording.result();
  m.organ_to_recording = organ_to_recording.result();
}

Json to_json(const OrganMaterial& m) {
  Json json{{"law", m.law}, {"motion", m.motion}, {"peak_N", rounded(m.peak_N, kMaterialDigits)}};
  Json parameters = Json::object();
  Json order = Json::array();
  for (const OrganMaterialParameter& p : m.parameters) {
    Json entry{{"value", rounded(p.value, kMaterialDigits)},
               {"start", rounded(p.start, kMaterialDigits)},
               {"by_law", rounded(p.by_law, kMaterialDigits)},
               {"at_bound", p.at_bound}};
    if (p.lower) entry["lower"] = rounded(*p.lower, kMaterialDigits);
    if (p.upper) entry["upper"] = rounded(*p.upper, kMaterialDigits);
    const std::string key = parameter_key(p.parameter);
    parameters[key] = std::move(entry);
    order.push_back(key);
  }
  json["parameters"] = std::move(parameters);
  json["intervals"] = intervals_name(m.intervals);
  if (m.readings) json["readings"] = readings_json(m);
  json["courses"] = Json::array();
  for (const MaterialCourse& c : m.courses) json["courses"].push_back(course_json(m, c));
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
                           {"level", m.fitted_law.uncertainty->level},
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
  json["remarks"] = remarks_json(m.remarks);
  json["fitted_law"] = with_sample_digests(files::to_json(m.fitted_law), m.samples_sha256);
  json["scene"] = m.scene;
  return json;
}

std::string to_terminal_text(const OrganMaterial& m) {
  std::string text = fmt::format("{} put on an organ {}, peak {} N\n\n", m.law, m.motion,
                                 significant(m.peak_N, 4));
  text += fmt::format("  {:<12} {:>12} {:>12} ", "bonds", "start", m.readings ? "law" : "fitted");
  if (m.readings) text += fmt::format("{:>12} ", "readings");
  text += fmt::format("  {}\n", interval_words(m));
  for (const OrganMaterialParameter& p : m.parameters) {
    const Unit& unit = p.parameter.unit;
    const auto shown = [&](double v) { return significant(v / unit.to_si, 4); };
    text +=
        fmt::format("  {:<12} {:>12} {:>12} ", p.parameter.name, shown(p.start), shown(p.by_law));
    if (m.readings) text += fmt::format("{:>12} ", shown(p.value));
    text += "  " + limits_text(p.lower, p.upper, unit) + unit.symbol;
    text += p.at_bound ? " (at a bound)\n" : "\n";
  }
  if (m.readings) text += placement_text(m);
  text += fmt::format("\n  {:<26} {:>9} {:>9}\n", "in % of the peak", "largest", "rms");
  text += mismatch_words("correspondence less law", m.start);
  text += mismatch_words("fitted organ less law", m.organ);
  text += mismatch_words("  on the way in", m.ramp);
  text += mismatch_words("  held", m.hold);
  if (m.law_to_recording) {
    text += mismatch_words("law less recording", *m.law_to_recording);
    text += mismatch_words("organ less recording", *m.organ_to_recording);
  }
  for (const MaterialCourse& c : m.courses) {
    if (m.courses.size() == 1 || !c.organ_to_recording) continue;
    text += mismatch_words(fmt::format("  {}", c.name), *c.organ_to_recording);
  }
  text += fmt::format(
      "\nthe organ cannot reproduce {} % of the law's peak ({} % rms); it is worst at {} mm and {} "
      "mm/s\n",
      significant(100.0 * m.organ.largest, 3), significant(100.0 * m.organ.rms, 3),
      significant(1e3 * m.organ.depth_m, 3), significant(1e3 * m.organ.rate_m_per_s, 3));
  for (const Remark& remark : m.remarks) text += "! " + remark.text + "\n";
  return text;
}

std::string to_csv(const OrganMaterial& m) {
  std::string text = "recording,time_s,depth_m,law_N,correspondence_N,organ_N";
  const bool measured = !m.courses.front().measured_N.empty();
  if (measured) text += ",measured_N";
  text += "\n";
  constexpr int kDigits = 9;
  for (std::size_t k = 0; k < m.courses.size(); ++k) {
    const MaterialCourse& c = m.courses[k];
    for (std::size_t i = 0; i < c.time_s.size(); ++i) {
      text += fmt::format("{},{}", k + 1, significant(c.time_s[i], kDigits));
      for (const auto* column : {&c.depth_m, &c.law_N, &c.correspondence_N, &c.organ_N}) {
        text += fmt::format(",{}", significant((*column)[i], kDigits));
      }
      if (measured) text += fmt::format(",{}", significant(c.measured_N[i], kDigits));
      text += "\n";
    }
  }
  return text;
}

}  // namespace tpm::fit
