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

ClaimReader::ClaimReader(const ClaimSet& set, const Json& claim)
    : set_(set),
      claim_(claim),
      at_(fmt::format("{}: claim '{}'", set.file, printable(claim.at("id").get<std::string>()))) {}

const Json& ClaimReader::required(std::string_view key) const {
  const auto found = claim_.find(key);
  if (found == claim_.end()) {
    throw bad_input(at_, fmt::format("key '{}' is missing", key),
                    fmt::format("it, because the kind is '{}'", printable(text("kind"))));
  }
  return *found;
}

std::string ClaimReader::text(std::string_view key) const {
  const Json& value = required(key);
  if (!value.is_string()) throw bad_input(at_, fmt::format("key '{}' is a list", key), "one text");
  return value.get<std::string>();
}

std::string ClaimReader::text_or(std::string_view key, std::string_view otherwise) const {
  return has(key) ? text(key) : std::string(otherwise);
}

Unit ClaimReader::unit() const {
  return parse_unit(text_or("unit", ""), at_);
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
  if (!has("with")) return;
  for (const auto& [name, value] : required("with").items()) {
    bind(scope, name, value.get<std::string>());
  }
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

ClaimValue::ClaimValue(const ClaimReader& reader) : reader_(reader) {
  if (reader.has("solve")) {
    const Json& solve = reader.required("solve");
    unknown_ = solve.at("unknown").get<std::string>();
    left_ = solve.at("left").get<std::string>();
    right_ = solve.at("right").get<std::string>();
    from_ = solve.at("from").get<std::string>();
    to_ = solve.at("to").get<std::string>();
    terms_ = {unknown_};
    expression_ = fmt::format("{} that solves {} = {}", unknown_, left_, right_);
  } else if (reader.has("terms")) {
    terms_ = reader.required("terms").get<std::vector<std::string>>();
    expression_ = fmt::format("{}", fmt::join(terms_, " + "));
  } else {
    terms_ = {reader.text("expression")};
    expression_ = terms_.front();
  }
}

double ClaimValue::term(std::size_t index, const Scope& scope) const {
  return unknown_.empty() ? reader_.evaluate(terms_[index], scope) : root(scope);
}

double ClaimValue::total(const Scope& scope) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < terms_.size(); ++i) sum += term(i, scope);
  return sum;
}

double ClaimValue::root(const Scope& scope) const {
  const auto residual = [&](double value) {
    Scope inner = scope;
    inner.formulas.erase(unknown_);
    inner.values[unknown_] = value;
    return reader_.evaluate(left_, inner) - reader_.evaluate(right_, inner);
  };
  const double low = reader_.quantity(from_, scope);
  const double high = reader_.quantity(to_, scope);
  const double at_low = residual(low);
  const double at_high = residual(high);
  if (!(low < high) || at_low * at_high > 0.0) {
    throw bad_input(reader_.at(), fmt::format("the equation for '{}' has no root there", unknown_),
                    fmt::format("a sign change between 'from' ({}) and 'to' ({})", from_, to_));
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
  if (unknown_.empty()) {
    std::vector<AuditInput> all;
    for (const std::string& t : terms_) {
      append(all, reader_.inputs(t, scope));
    }
    return all;
  }
  Scope inner = scope;
  inner.values[unknown_] = root(scope);
  auto inputs = reader_.inputs(fmt::format("({}) - ({})", left_, right_), inner);
  std::erase_if(inputs, [&](const AuditInput& i) { return i.name == unknown_; });
  return inputs;
}

}  // namespace tpm::paper
