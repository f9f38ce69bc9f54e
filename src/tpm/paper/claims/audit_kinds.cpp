#include "tpm/paper/claims/audit_kinds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/claims/cause_search.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

/// The inputs that the cause search may change: those named in `search`, else all.
std::vector<AuditInput> searchable(const ClaimReader& claim, std::vector<AuditInput> inputs) {
  if (!claim->search) return inputs;
  std::erase_if(inputs, [&](const AuditInput& input) {
    return std::ranges::find(*claim->search, input.name) == claim->search->end();
  });
  return inputs;
}

/// f(t) from its Laplace transform by the Gaver-Stehfest sum of 14 terms, good to about 1e-4 for
/// the monotonic decays met here (H. Stehfest, Commun. ACM 13, 47, 1970).
template <class Transform>
double inverse_laplace(const Transform& transform, double time) {
  constexpr int kTerms = 14;
  constexpr int kHalf = kTerms / 2;
  const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
  double sum = 0.0;
  for (int k = 1; k <= kTerms; ++k) {
    double weight = 0.0;
    for (int j = (k + 1) / 2; j <= std::min(k, kHalf); ++j) {
      weight += std::pow(j, kHalf) * factorial(2 * j) /
                (factorial(kHalf - j) * factorial(j) * factorial(j - 1) * factorial(k - j) *
                 factorial(2 * j - k));
    }
    const double sign = (k + kHalf) % 2 == 0 ? 1.0 : -1.0;
    sum += sign * weight * transform(k * std::numbers::ln2 / time);
  }
  return sum * std::numbers::ln2 / time;
}

/// Left side of an "agree" claim in a scope; the time of a transform is bound there.
double left_side(const ClaimReader& claim, const Scope& scope) {
  const std::string& left = claim.needed(&Claim::left);
  if (!claim->transform) return claim.evaluate(left, scope);
  const double time = claim.evaluate(claim->transform->time, scope);
  if (!(time > 0.0)) throw bad_input(claim.at(), "inverse transform at t <= 0", "times above 0");
  return inverse_laplace(
      [&](double s) {
        Scope inner = scope;
        inner.values[claim->transform->variable] = s;
        return claim.evaluate(left, inner);
      },
      time);
}

/// The scopes in which an "agree" claim is compared, with words for each.
std::vector<std::pair<std::string, Scope>> samples(const ClaimReader& claim) {
  if (!claim->vary) return {{"", claim.scope()}};
  const auto& [symbol, values] = *claim->vary;
  std::vector<std::pair<std::string, Scope>> all;
  for (const std::string& value : values) {
    Scope scope = claim.scope();
    // A number, not a formula: it must mean the same in every definition that uses the name.
    scope.values[symbol] = claim.quantity(value, scope);
    all.emplace_back(fmt::format("{} = {}", symbol, value), std::move(scope));
  }
  return all;
}

bool satisfied(double left, const std::string& relation, double right) {
  if (relation == "<") return left < right;
  if (relation == "<=") return left <= right;
  if (relation == ">") return left > right;
  return left >= right;
}

/// The audit's word for a comparison of digits.
AuditVerdict audit_verdict(DigitVerdict verdict) noexcept {
  switch (verdict) {
    case DigitVerdict::by_rounding:
      return AuditVerdict::holds;
    case DigitVerdict::by_truncation:
      return AuditVerdict::holds_by_truncation;
    case DigitVerdict::last_digit_off:
      return AuditVerdict::last_digit_off;
    case DigitVerdict::differs:
      return AuditVerdict::differs;
  }
  return AuditVerdict::undetermined;
}

}  // namespace

void check_value(const ClaimReader& claim, Finding& finding) {
  const ClaimValue value(claim);
  const Scope scope = claim.scope();
  const Unit unit = claim.unit();
  const PrintedNumber printed = claim.printed();
  const DigitCheck check = compare_digits(printed, value.total(scope) / unit.to_si);
  finding.printed = with_unit(printed.text, unit);
  finding.recomputed = {check.computed, unit};
  finding.expression = value.expression();
  finding.inputs = value.inputs(scope);
  finding.verdict = audit_verdict(check.verdict);
  finding.difference_percent = check.difference_percent;
  if (!check.explained()) {
    finding.causes =
        search_causes(claim, value, scope, printed, unit, searchable(claim, finding.inputs));
  }
}

void add_check(Finding& finding, std::string what, const DigitCheck& check, const Unit& unit) {
  finding.verdict = std::max(finding.verdict, audit_verdict(check.verdict));
  finding.details.push_back({std::move(what),
                             with_unit(check.printed.text, unit),
                             {check.computed, unit},
                             check.words(),
                             check.difference_percent,
                             check.explained()});
}

void check_range(const ClaimReader& claim, Finding& finding) {
  const ClaimValue value(claim);
  const Unit unit = claim.unit();
  const auto [low, high] = claim.printed_pair();
  const ClaimRange& over = claim.needed(&Claim::over);
  finding.printed = fmt::format("{} - {}", low.text, with_unit(high.text, unit));
  finding.expression = value.expression();
  double worst = 0.0;
  finding.verdict = AuditVerdict::holds;
  for (const auto& [printed, end] : {std::pair(low, over.from), std::pair(high, over.to)}) {
    Scope scope = claim.scope();
    scope.values[over.symbol] = claim.quantity(end, scope);
    const DigitCheck check = compare_digits(printed, value.total(scope) / unit.to_si);
    add_check(finding, fmt::format("{} = {}", over.symbol, end), check, unit);
    const double difference = check.difference_percent.value_or(0.0);
    if (!finding.recomputed || std::abs(difference) > std::abs(worst)) {
      finding.recomputed = {check.computed, unit};
      worst = difference;
    }
    finding.inputs = value.inputs(scope);
    if (check.explained()) continue;
    for (auto& cause :
         search_causes(claim, value, scope, printed, unit, searchable(claim, finding.inputs), 2)) {
      cause.text = fmt::format("{}: {}", with_unit(printed.text, unit), cause.text);
      finding.causes.push_back(std::move(cause));
    }
  }
  finding.difference_percent = worst;
}

namespace {

/// The symbol whose name is the whole of a formula, if its value stands in print.
const PrintedSymbol* printed_alone(const ClaimReader& claim, const std::string& formula) {
  const PrintedSymbol* symbol = claim.set().symbol(formula);
  if (symbol == nullptr) return nullptr;
  const bool in_print = symbol->provenance == "table" || symbol->provenance == "text" ||
                        symbol->provenance == "abstract";
  return in_print ? symbol : nullptr;
}

}  // namespace

void check_agree(const ClaimReader& claim, Finding& finding) {
  const std::string& left = claim.needed(&Claim::left);
  const std::string& right = claim.needed(&Claim::right);
  const double tolerance = parse_number(claim->tolerance.value_or("1e-9"), claim.at());
  const Unit unit = claim.unit();
  double worst = -1.0;
  for (const auto& [words, scope] : samples(claim)) {
    const double a = left_side(claim, scope) / unit.to_si;
    const double b = claim.evaluate(right, scope) / unit.to_si;
    const double scale = std::max(std::abs(a), std::abs(b));
    const double relative = scale == 0.0 ? 0.0 : std::abs(a - b) / scale;
    std::optional<double> percent;
    if (b != 0.0) percent = 100.0 * (a - b) / std::abs(b);
    if (!words.empty()) {
      finding.details.push_back({words,
                                 with_unit(significant(a, 4), unit),
                                 {b, unit},
                                 relative <= tolerance ? "agrees" : "does not agree",
                                 percent,
                                 false});
    }
    if (relative <= worst) continue;
    worst = relative;
    if (const PrintedSymbol* symbol = printed_alone(claim, left)) {
      finding.printed = with_unit(symbol->value, symbol->unit);
    } else {
      finding.derived = with_unit(significant(a, 4), unit);
    }
    finding.recomputed = {b, unit};
    finding.difference_percent = percent;
    finding.inputs = claim.inputs(right, scope);
    if (!claim->transform) append(finding.inputs, claim.inputs(left, scope));
  }
  finding.expression = claim->transform ? fmt::format("inverse Laplace of {} = {}", left, right)
                                        : fmt::format("{} = {}", left, right);
  finding.verdict = worst <= tolerance ? AuditVerdict::holds : AuditVerdict::contradicted;
}

void check_inequality(const ClaimReader& claim, Finding& finding) {
  const std::string& left = claim.needed(&Claim::left);
  const std::string& right = claim.needed(&Claim::right);
  const std::string& relation = claim.needed(&Claim::relation);
  const Scope scope = claim.scope();
  const Unit unit = claim.unit();
  const double a = claim.evaluate(left, scope) / unit.to_si;
  const double b = claim.evaluate(right, scope) / unit.to_si;
  finding.expression = fmt::format("{} {} {}", left, relation, right);
  if (const PrintedSymbol* symbol = printed_alone(claim, right)) {
    finding.printed = fmt::format("{} {}", relation, with_unit(symbol->value, symbol->unit));
  } else {
    finding.derived = fmt::format("{} {}", relation, with_unit(significant(b, 4), unit));
    const PrintedSymbol* own = claim.set().symbol(right);
    if (own != nullptr && own->provenance == "assumed") finding.derived += " (assumed)";
  }
  finding.recomputed = {a, unit};
  finding.bound = {b, unit};
  finding.inputs = claim.inputs(left, scope);
  append(finding.inputs, claim.inputs(right, scope));
  if (b != 0.0) finding.difference_percent = 100.0 * (a - b) / std::abs(b);
  finding.verdict = satisfied(a, relation, b) ? AuditVerdict::holds : AuditVerdict::contradicted;
}

void check_dimension(const ClaimReader& claim, Finding& finding) {
  const std::string& name = claim.needed(&Claim::expression);
  const PrintedSymbol* symbol = claim.set().symbol(name);
  if (symbol == nullptr) {
    const auto known = mapped<std::string>(claim.set().symbols, &PrintedSymbol::name);
    throw bad_input(
        claim.at(),
        fmt::format("unknown symbol '{}'{}", printable(name), did_you_mean(name, known)),
        "a name from 'symbols'");
  }
  const Unit example = parse_unit(claim.needed(&Claim::claimed_dimension), claim.at());
  finding.printed = with_unit(symbol->value, symbol->unit);
  finding.expression =
      fmt::format("'{}' is a unit of {}; a {} is claimed", symbol->unit.symbol,
                  dimension_name(symbol->unit.dimension), dimension_name(example.dimension));
  finding.recomputed = {parse_number(symbol->value, claim.at()), symbol->unit};
  finding.inputs = claim.inputs(name, {});
  const bool same = example.dimension == symbol->unit.dimension;
  finding.verdict = same ? AuditVerdict::holds : AuditVerdict::contradicted;
}

}  // namespace tpm::paper
