// Declared in tpm/paper/claims/audit.hpp.
#include "tpm/paper/claims/audit.hpp"

namespace tpm::paper {
namespace {

Json optional_number(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

Json quantity_json(const AuditQuantity& quantity) {
  return {{"value", quantity.value},
          {"unit", quantity.unit.symbol},
          {"value_SI", quantity.value * quantity.unit.to_si},
          {"unit_SI", si_symbol(quantity.unit.dimension)}};
}

Json input_json(const AuditInput& input) {
  Json json{{"name", input.name}};
  if (!input.printed.empty()) json["printed"] = input.printed;
  json.update(quantity_json(input.value));
  json["where"] = input.where;
  if (!input.provenance.empty()) json["provenance"] = input.provenance;
  return json;
}

Json cause_json(const AuditCause& cause) {
  return {{"change", cause.text},
          {"recomputed", cause.recomputed},
          {"only_printed_values", cause.only_printed}};
}

const char* const kDerivedKey = "derived_from_print";

/// @param key of the number that is compared
Json detail_json(const AuditDetail& detail, const char* key) {
  return {{"what", detail.what},
          {key, detail.printed},
          {"recomputed", quantity_json(detail.recomputed)},
          {"verdict", detail.verdict},
          {"difference_percent", optional_number(detail.difference_percent)}};
}

Json finding_json(const Finding& finding) {
  Json json;
  json["id"] = finding.id;
  json["topic"] = finding.topic;
  json["kind"] = finding.kind;
  json["where"] = finding.where;
  json["claim"] = finding.claim;
  json["verdict"] = verdict_name(finding.verdict);
  json["difference_percent"] = optional_number(finding.difference_percent);
  const bool in_print = !finding.printed.empty();
  json[in_print ? "printed" : kDerivedKey] = finding.compared();
  json["recomputed"] = finding.recomputed ? quantity_json(*finding.recomputed) : Json();
  if (finding.bound) json["bound"] = quantity_json(*finding.bound);
  json["expression"] = finding.expression;
  json["inputs"] = array_json(finding.inputs, input_json);
  json["causes"] = array_json(finding.causes, cause_json);
  json["details"] = array_json(finding.details, [&](const AuditDetail& detail) {
    return detail_json(detail, in_print ? "printed" : kDerivedKey);
  });
  if (finding.cells) {
    json["cells"] = {{"cells", finding.cells->cells},
                     {"by_rounding", finding.cells->by_rounding},
                     {"by_truncation", finding.cells->by_truncation}};
  }
  json["consequence"] = finding.consequence;
  return json;
}

}  // namespace

Json to_json(const AuditReport& report) {
  Json json;
  json["title"] = report.title;
  json["findings"] = array_json(report.findings, finding_json);
  Json counts;
  for (const auto& [verdict, name] : kAuditVerdicts) {
    counts[std::string(name)] = report.count(verdict);
  }
  json["summary"] = std::move(counts);
  return json;
}

}  // namespace tpm::paper
