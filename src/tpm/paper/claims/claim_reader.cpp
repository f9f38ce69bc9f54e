#include "tpm/paper/claims/claim_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <cstdint>

#include "tpm/base/quantity_text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {

ClaimReader::ClaimReader(const ClaimSet& set, const Claim& claim)
    : set_(set), claim_(claim), at_(fmt::format("{}: claim '{}'", set.file, printable(claim.id))) {}

void ClaimReader::refuse_without(const std::string& key) const {
  throw bad_input(at_, fmt::format("key '{}' is missing", key),
                  fmt::format("it, because the kind is '{}'", printable(claim_.kind)));
}

Unit ClaimReader::unit() const {
  return parse_unit(claim_.unit.value_or(""), at_);
}

PrintedNumber ClaimReader::printed() const {
  const Claim::Texts& printed = needed(&Claim::printed);
  if (printed.size() == 1) return parse_printed(printed.front(), at_);
  throw bad_input(at_, "a range is printed", "one number");
}

std::pair<PrintedNumber, PrintedNumber> ClaimReader::printed_pair() const {
  const Claim::Texts& printed = needed(&Claim::printed);
  if (printed.size() != 2) {
    throw bad_input(at_, "one number is printed", "two, low and high");
  }
  auto low = parse_printed(printed[0], at_);
  auto high = parse_printed(printed[1], at_);
  if (low.value < high.value) return {std::move(low), std::move(high)};
  throw bad_input(at_, fmt::format("printed is {} to {}", low.text, high.text), "low before high");
}

void ClaimReader::bind(Scope& scope, const std::string& name, const std::string& value) const {
  const auto si = quantity_si(value);
  if (!si) {
    scope.values.erase(name);
    scope.formulas[name] = value;
    return;
  }
  if (const PrintedSymbol* symbol = set_.symbol(name); symbol != nullptr) {
    const std::string_view unit = std::string_view(value).substr(value.find_first_of(" \t") + 1);
    static_cast<void>(parse_unit(unit, symbol->unit.dimension, fmt::format("{}: {}", at_, name)));
  }
  scope.values[name] = *si;
}

void ClaimReader::bind_own(Scope& scope) const {
  if (!claim_.with) return;
  for (const auto& [name, value] : *claim_.with) bind(scope, name, value);
}

Scope ClaimReader::scope() const {
  Scope scope;
  bind_own(scope);
  return scope;
}

Scope ClaimReader::row_scope(const PrintedTable& table, std::size_t row) const {
  Scope scope;
  for (const auto& [name, value] : table.constants) bind(scope, name, value);
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    scope.values[table.columns[c].name] = table.si(row, c, at_);
  }
  bind_own(scope);
  return scope;
}

double ClaimReader::evaluate(const std::string& expression, const Scope& scope) const {
  return set_.evaluator.evaluate(expression, scope, at_);
}

double ClaimReader::quantity(const std::string& text, const Scope& scope) const {
  if (const auto si = quantity_si(text)) return *si;
  return evaluate(text, scope);
}

std::vector<AuditInput> ClaimReader::inputs(const std::string& expression,
                                            const Scope& scope) const {
  std::vector<AuditInput> inputs;
  for (const std::string& name : set_.evaluator.inputs(expression, scope, at_)) {
    AuditInput input;
    input.name = name;
    const PrintedSymbol* symbol = set_.symbol(name);
    const Unit unit = symbol != nullptr ? symbol->unit : Unit{"", Dimension::dimensionless, 1.0};
    if (symbol != nullptr && !scope.values.contains(name)) {
      input.printed = with_unit(symbol->value, unit);
      input.where = symbol->where;
      input.provenance = symbol->provenance;
    } else {
      input.where = "this claim";
    }
    input.value = {evaluate(name, scope) / unit.to_si, unit};
    inputs.push_back(std::move(input));
  }
  return inputs;
}

void append(std::vector<AuditInput>& inputs, std::vector<AuditInput> more) {
  for (AuditInput& input : more) {
    const bool known = std::ranges::find(inputs, input.name, &AuditInput::name) != inputs.end();
    if (!known) inputs.push_back(std::move(input));
  }
}

ClaimValue::ClaimValue(const ClaimReader& reader) : reader_(reader), solve_(reader->solve) {
  if (solve_) {
    terms_ = {solve_->unknown};
    expression_ =
        fmt::format("{} that solves {} = {}", solve_->unknown, solve_->left, solve_->right);
    return;
  }
  terms_ = reader->terms ? *reader->terms : Claim::Texts{reader.needed(&Claim::expression)};
  expression_ = fmt::format("{}", fmt::join(terms_, " + "));
}

double ClaimValue::term(std::size_t index, const Scope& scope) const {
  return solve_ ? root(scope) : reader_.evaluate(terms_[index], scope);
}

double ClaimValue::total(const Scope& scope) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < terms_.size(); ++i) sum += term(i, scope);
  return sum;
}

double ClaimValue::root(const Scope& scope) const {
  const auto residual = [&](double value) {
    Scope inner = scope;
    inner.formulas.erase(solve_->unknown);
    inner.values[solve_->unknown] = value;
    return reader_.evaluate(solve_->left, inner) - reader_.evaluate(solve_->right, inner);
  };
  const double low = reader_.quantity(solve_->from, scope);
  const double high = reader_.quantity(solve_->to, scope);
  const double at_low = residual(low);
  const double at_high = residual(high);
  if (!(low < high) || at_low * at_high > 0.0) {
    throw bad_input(
        reader_.at(), fmt::format("the equation for '{}' has no root there", solve_->unknown),
        fmt::format("a sign change between 'from' ({}) and 'to' ({})", solve_->from, solve_->to));
  }
  if (at_low == 0.0) return low;
  if (at_high == 0.0) return high;
  std::uintmax_t iterations = 200;
  const auto bracket =
      boost::math::tools::toms748_solve(residual, low, high, at_low, at_high,
                                        boost::math::tools::eps_tolerance<double>(50), iterations);
  return 0.5 * (bracket.first + bracket.second);
}

std::vector<AuditInput> ClaimValue::inputs(const Scope& scope) const {
  if (!solve_) {
    std::vector<AuditInput> all;
    for (const std::string& t : terms_) {
      append(all, reader_.inputs(t, scope));
    }
    return all;
  }
  Scope inner = scope;
  inner.values[solve_->unknown] = root(scope);
  auto inputs = reader_.inputs(fmt::format("({}) - ({})", solve_->left, solve_->right), inner);
  std::erase_if(inputs, [&](const AuditInput& i) { return i.name == solve_->unknown; });
  return inputs;
}

}  // namespace tpm::paper
