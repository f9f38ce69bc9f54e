#include "tpm/paper/claims/audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/claims/audit_kinds.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

struct ClaimKind {
  std::string_view name;
  void (*check)(const ClaimReader&, Finding&);
};

constexpr auto kKinds = std::to_array<ClaimKind>({
    {"value", check_value},
    {"range", check_range},
    {"band", check_band},
    {"agree", check_agree},
    {"inequality", check_inequality},
    {"dimension", check_dimension},
    {"table", check_table},
    {"misfit", check_misfit},
});

const ClaimKind& kind_named(const std::string& name, std::string_view at) {
  const auto found = std::ranges::find(kKinds, name, &ClaimKind::name);
  if (found != kKinds.end()) return *found;
  throw unknown_word(at, "unknown kind", name, mapped<std::string>(kKinds, &ClaimKind::name));
}

using Placeholders = std::map<std::string, std::string, std::less<>>;

std::string number_text(const AuditQuantity& quantity) {
  return with_unit(significant(quantity.value, 4), quantity.unit);
}

/// Values that a consequence may quote.
Placeholders placeholders(const ClaimReader& claim, const Finding& finding) {
  Placeholders values;
  values["printed"] = finding.compared();
  values["recomputed"] = finding.recomputed_words();
  if (finding.bound) values["bound"] = number_text(*finding.bound);
  values["difference"] =
      finding.difference_percent ? percent_text(*finding.difference_percent) : "nothing";
  values["cause"] = finding.causes.empty() ? "no single input" : finding.causes.front().text;
  if (finding.cells) {
    values["count"] = std::to_string(finding.cells->by_rounding + finding.cells->by_truncation);
    values["total"] = std::to_string(finding.cells->cells);
    values["rounded"] = std::to_string(finding.cells->by_rounding);
  }
  if (!claim->report) return values;
  for (const auto& [name, number] : *claim->report) {
    const Unit unit = parse_unit(number.unit.value_or(""), claim.at());
    const double si = claim.evaluate(number.expression, claim.scope());
    values[name] = number_text({si / unit.to_si, unit});
  }
  return values;
}

std::string fill(const std::string& text, const Placeholders& values, std::string_view at) {
  std::string filled;
  std::size_t from = 0;
  for (std::size_t open = text.find('{'); open != std::string::npos; open = text.find('{', from)) {
    const std::size_t close = text.find('}', open);
    const std::string name =
        close == std::string::npos ? text.substr(open) : text.substr(open + 1, close - open - 1);
    const auto value = values.find(name);
    if (close == std::string::npos || value == values.end()) {
      throw bad_input(at, fmt::format("unknown placeholder '{}' in a consequence", printable(name)),
                      "printed, recomputed, difference, cause, or a name from 'report'");
    }
    filled.append(text, from, open - from).append(value->second);
    from = close + 1;
  }
  return filled.append(text, from);
}

Finding examine(const ClaimSet& set, const Claim& item) {
  const ClaimReader claim(set, item);
  Finding finding;
  finding.id = item.id;
  finding.topic = item.topic.value_or("");
  finding.kind = item.kind;
  finding.where = item.where;
  finding.claim = item.quote;
  kind_named(finding.kind, claim.at()).check(claim, finding);
  const Placeholders values = placeholders(claim, finding);
  // All templates are filled, so that a wrong one does not wait for the day it is needed.
  const auto filled = [&](const std::optional<std::string>& text) {
    return text ? fill(*text, values, claim.at()) : std::string{};
  };
  const std::string holds = filled(item.if_holds), fails = filled(item.if_fails);
  const std::string open = filled(item.if_open);
  finding.consequence = finding.verdict == AuditVerdict::undetermined ? open
                        : finding.stands()                            ? holds
                                                                      : fails;
  return finding;
}

}  // namespace

std::string_view verdict_name(AuditVerdict verdict) noexcept {
  return word_for(kAuditVerdicts, verdict);
}

std::string Finding::verdict_words() const {
  if (verdict != AuditVerdict::differs || !difference_percent) {
    return std::string(verdict_name(verdict));
  }
  return "differs by " + percent_text(*difference_percent);
}

std::string Finding::recomputed_words() const {
  if (kind == "range" && details.size() == 2) {
    return fmt::format("{} - {}", significant(details[0].recomputed.value, 4),
                       number_text(details[1].recomputed));
  }
  if (recomputed) return number_text(*recomputed);
  if (!cells) return "-";
  return fmt::format("{} of {}", cells->by_rounding + cells->by_truncation, cells->cells);
}

bool Finding::stands() const noexcept {
  return verdict == AuditVerdict::holds || verdict == AuditVerdict::holds_by_truncation;
}

int AuditReport::count(AuditVerdict verdict) const noexcept {
  return static_cast<int>(std::ranges::count(findings, verdict, &Finding::verdict));
}

AuditReport run_audit(const Json& claims, std::string_view file) {
  const ClaimSet set = read_claims(claims, file);
  AuditReport report;
  report.title = set.title;
  report.file = set.file;
  for (const Claim& item : set.claims) report.findings.push_back(examine(set, item));
  return report;
}

}  // namespace tpm::paper
