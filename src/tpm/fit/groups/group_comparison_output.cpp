// Declared in tpm/fit/groups/group_comparison.hpp.
#include <fmt/format.h>

#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/groups/group_comparison.hpp"
#include "tpm/show/json_table_csv.hpp"

namespace tpm::fit {
namespace {

bool is_ratio(const ComparedQuantity& q) {
  return q.parameter.scale == Scale::log;
}

/// The difference in theta as a ratio, or in SI.
double shown_difference(const ComparedQuantity& q, double theta) {
  return is_ratio(q) ? std::exp(theta) : theta;
}

Json typical_json(const ComparedQuantity& q, std::size_t group, const std::string& name) {
  Json j{{"group", name}, {"left_out", q.left_out[group]}};
  if (!q.typical[group]) return j;
  const RandomEffects& e = *q.typical[group];
  j["specimens"] = e.specimens;
  j["typical_SI"] = rounded(q.parameter.natural(e.mean));
  j["interval_SI"] = {rounded(q.parameter.natural(e.interval.lower)),
                      rounded(q.parameter.natural(e.interval.upper))};
  return j;
}

Json quantity_json(const GroupComparison& c, const ComparedQuantity& q) {
  Json j{{"name", q.parameter.name}, {"unit", q.si_unit}};
  j["groups"] = Json::array({typical_json(q, 0, c.names[0]), typical_json(q, 1, c.names[1])});
  if (q.only_without) j["not_separable"] = remark_json(*q.only_without);
  if (q.not_described[0] + q.not_described[1] > 0) j["only_if_described"] = true;
  if (!q.difference) {
    j["reason"] = q.reason;
    return j;
  }
  const GroupDifference& d = *q.difference;
  const std::string key = is_ratio(q) ? "ratio" : "difference_SI";
  j[key] = rounded(shown_difference(q, d.difference));
  j[is_ratio(q) ? "ratio_interval" : "difference_interval_SI"] = {
      rounded(shown_difference(q, d.interval.lower)),
      rounded(shown_difference(q, d.interval.upper))};
  j["p_value"] = rounded(d.p_value);
  j["degrees_of_freedom"] = d.degrees;
  j[is_ratio(q) ? "between_specimens_sd_of_log" : "between_specimens_sd_SI"] =
      rounded(std::sqrt(d.tau_squared));
  return j;
}

std::string with_interval(double value, double lower, double upper) {
  return fmt::format("{} ({} .. {})", significant(value, 4), significant(lower, 4),
                     significant(upper, 4));
}

std::string typical_text(const ComparedQuantity& q, std::size_t group) {
  if (!q.typical[group]) return "-";
  const RandomEffects& e = *q.typical[group];
  const auto shown = [&](double theta) {
    return q.parameter.natural(theta) / q.parameter.unit.to_si;
  };
  return with_interval(shown(e.mean), shown(e.interval.lower), shown(e.interval.upper));
}

std::string line_of(const ComparedQuantity& q, bool tested) {
  std::string text =
      fmt::format("{:<20} {:<26} {:<26} ",
                  q.parameter.unit.symbol.empty()
                      ? q.parameter.name
                      : fmt::format("{}, {}", q.parameter.name, q.parameter.unit.symbol),
                  typical_text(q, 0), typical_text(q, 1));
  if (!q.difference) return text + q.reason + "\n";
  const GroupDifference& d = *q.difference;
  const double unit = is_ratio(q) ? 1.0 : q.parameter.unit.to_si;
  const auto shown = [&](double theta) { return shown_difference(q, theta) / unit; };
  text += fmt::format(
      "{:<26} {:<9} {}",
      fmt::format(
          "{}{}", is_ratio(q) ? "x " : "+ ",
          with_interval(shown(d.difference), shown(d.interval.lower), shown(d.interval.upper))),
      probability(d.p_value), tested ? probability(q.p_holm) : std::string("as its parts"));
  const int left_out = q.left_out[0] + q.left_out[1];
  if (left_out > 0) text += fmt::format("  left out: {}", left_out);
  if (const std::string doubt = doubt_of(q); !doubt.empty()) text += "  ! " + doubt;
  return text + "\n";
}

}  // namespace

std::string conclusion(const GroupComparison& c) {
  std::vector<std::string> differ, open;
  bool described = true;
  const double alpha = 1.0 - c.study.level;
  for (const ComparedQuantity& q : c.parameters) {
    if (!q.difference || q.only_without) continue;
    (q.p_holm < alpha ? differ : open).push_back(q.parameter.name);
    described = described && q.not_described[0] + q.not_described[1] == 0;
  }
  if (differ.empty() && open.empty()) {
    return "the groups cannot be compared: no parameter is determined by two specimens of each";
  }
  const std::string against = fmt::format(
      "{}{} against {}",
      described ? "" : "if the law described every recording, which it does not: ", c.names[1],
      c.names[0]);
  if (differ.empty()) {
    return fmt::format(
        "{}: no difference is shown in {} (Holm, {:.4g} %); the intervals say how large one "
        "may be",
        against, fmt::join(open, ", "), 100.0 * c.study.level);
  }
  return fmt::format(
      "{}: a difference in {} (Holm, {:.4g} %){}", against, fmt::join(differ, ", "),
      100.0 * c.study.level,
      open.empty() ? std::string() : fmt::format("; none is shown in {}", fmt::join(open, ", ")));
}

Json to_json(const GroupComparison& c) {
  Json study = to_json(c.study);
  study.erase("pooled");
  for (std::size_t i = 0; i < c.study.rows.size(); ++i) {
    study["recordings"][i]["group"] = c.names[i < c.first ? 0 : 1];
  }
  Json j{{"conclusion", conclusion(c)}, {"confidence_level", c.study.level}};
  j["parameters"] = array_json(c.parameters, [&](const ComparedQuantity& q) {
    Json entry = quantity_json(c, q);
    if (q.difference) entry["p_value_holm"] = rounded(q.p_holm);
    return entry;
  });
  if (!c.moduli.empty()) {
    j["young_moduli"] =
        array_json(c.moduli, [&](const ComparedQuantity& q) { return quantity_json(c, q); });
  }
  j.update(study);
  return j;
}

std::string to_terminal_text(const GroupComparison& c) {
  const std::size_t second = c.study.rows.size() - c.first;
  std::string text = conclusion(c) + "\n" + c.study.why + "\n";
  if (depends_on_reference(c.study.law)) text += reference_words(c.study.law) + "\n";
  text += fmt::format(
      "\n{:<20} {:<26} {:<26} {:<26} {:<9} {}\n", "", fmt::format("{} ({})", c.names[0], c.first),
      fmt::format("{} ({})", c.names[1], second), "second against first", "p", "p (Holm)");
  for (const ComparedQuantity& q : c.parameters) text += line_of(q, true);
  for (const ComparedQuantity& q : c.moduli) text += line_of(q, false);
  text += fmt::format(
      "typical specimens and ratios (x) or differences (+) with {:.4g} % intervals; random effects "
      "with one "
      "spread between specimens, modified Hartung-Knapp\n",
      100.0 * c.study.level);
  for (const SpecimenRow& row : c.study.rows) {
    if (!row.fit) text += fmt::format("! {} is not fitted: {}\n", row.name, row.reason);
    if (row.fit && row.fit->adequacy && row.fit->adequacy->is_rejected()) {
      text += fmt::format("! {}: {}\n", row.name, row.fit->adequacy->summary);
    }
  }
  return text;
}

std::string comparison_csv(const GroupComparison& c) {
  const Json all = to_json(c);
  Json rows = all.at("parameters");
  for (const Json& modulus : all.value("young_moduli", Json::array())) rows.push_back(modulus);
  for (Json& row : rows) row["confidence_level"] = c.study.level;
  return json_table_csv(rows, "/groups");
}

}  // namespace tpm::fit
