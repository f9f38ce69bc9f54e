#include "tpm/fit/expression/expression.hpp"

#include <fmt/format.h>
#include <muParser.h>

#include <cmath>
#include <numbers>
#include <set>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/fit/expression/model_functions.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr int kDeepestDefinition = 50;

}  // namespace

/// A formula ready to run: muParser reads the variables from `values`.
struct CompiledFormula {
  mu::Parser parser;
  std::vector<std::string> names;
  std::vector<double> values;
};

namespace {

mu::Parser new_parser() {
  mu::Parser parser;
  parser.ClearConst();
  parser.DefineConst("pi", std::numbers::pi);
  define_model_functions(parser);
  return parser;
}

/// muParser reads '=' as an assignment to a variable; a formula has none.
bool assigns(const std::string& text) {
  for (std::size_t i = text.find('='); i != std::string::npos; i = text.find('=', i + 1)) {
    const bool comparison =
        (i > 0 && std::string_view("<>!=").find(text[i - 1]) != std::string::npos) ||
        (i + 1 < text.size() && text[i + 1] == '=');
    if (!comparison) return true;
  }
  return false;
}

Error broken(const std::string& text, std::string_view why, std::string_view where) {
  return bad_input(where, fmt::format("expression '{}': {}", printable(text), why),
                   "a formula such as load / (lambda1 + E2)");
}

std::string without_full_stop(std::string message) {
  while (!message.empty() && message.back() == '.') message.pop_back();
  return message;
}

std::unique_ptr<CompiledFormula> compile(const std::string& text, std::string_view where) {
  if (assigns(text)) throw broken(text, "'=' assigns", where);
  auto compiled = std::make_unique<CompiledFormula>();
  compiled->parser = new_parser();
  try {
    compiled->parser.SetExpr(text);
    for (const auto& [name, unused] : compiled->parser.GetUsedVar()) {
      compiled->names.push_back(name);
    }
    compiled->values.assign(compiled->names.size(), 1.0);
    for (std::size_t i = 0; i < compiled->names.size(); ++i) {
      compiled->parser.DefineVar(compiled->names[i], &compiled->values[i]);
    }
  } catch (const mu::ParserError& error) {
    throw broken(text, without_full_stop(error.GetMsg()), where);
  }
  return compiled;
}

}  // namespace

struct Evaluator::Impl {
  std::map<std::string, double, std::less<>> symbols;
  std::map<std::string, std::string, std::less<>> definitions;
  std::map<std::string, std::unique_ptr<CompiledFormula>> cache;
  mu::Parser reserved = new_parser();  ///< only asked for the names it knows

  CompiledFormula& compiled(const std::string& text, std::string_view where) {
    auto& slot = cache[text];
    if (!slot) slot = compile(text, where);
    return *slot;
  }

  /// The formula a name stands for; none if it is a number or unknown.
  const std::string* formula_of(const std::string& name, const Scope& scope) const {
    if (const auto local = scope.formulas.find(name); local != scope.formulas.end()) {
      return &local->second;
    }
    const auto definition = definitions.find(name);
    return definition == definitions.end() ? nullptr : &definition->second;
  }

  /// Names that may be used: all if the scope has no others, else where they are listed.
  std::string known(const Scope& scope) const {
    if (!symbols.empty() || !definitions.empty()) return "a name from 'symbols' or 'definitions'";
    const std::vector<std::string> all = names(scope);
    return all.empty() ? "a formula of numbers" : fmt::format("{}", fmt::join(all, ", "));
  }

  std::vector<std::string> names(const Scope& scope) const {
    std::vector<std::string> all;
    for (const auto& entry : scope.values) all.push_back(entry.first);
    for (const auto& entry : scope.formulas) all.push_back(entry.first);
    for (const auto& entry : symbols) all.push_back(entry.first);
    for (const auto& entry : definitions) all.push_back(entry.first);
    return all;
  }

  /// Values of the definitions in one evaluation: each is computed once, or a chain of
  /// definitions that name two earlier ones each would cost a power of two.
  struct Known {
    std::map<std::string, double, std::less<>> values;
    std::set<std::string, std::less<>> under_way;
  };

  double lookup(const std::string& name, const Scope& scope, std::string_view where, int depth,
                Known& known_values) {
    if (const auto value = scope.values.find(name); value != scope.values.end()) {
      return value->second;
    }
    const std::string* formula = formula_of(name, scope);
    if (formula == nullptr) {
      if (const auto symbol = symbols.find(name); symbol != symbols.end()) return symbol->second;
      throw bad_input(
          where,
          fmt::format("unknown symbol '{}'{}", printable(name), did_you_mean(name, names(scope))),
          known(scope));
    }
    if (known_values.under_way.contains(name)) {
      throw bad_input(where, fmt::format("'{}' refers to itself", printable(name)),
                      "definitions without circles");
    }
    if (const auto value = known_values.values.find(name); value != known_values.values.end()) {
      return value->second;
    }
    if (depth >= kDeepestDefinition) {
      throw bad_input(where,
                      fmt::format("'{}' stands below {} definitions that name each other",
                                  printable(name), kDeepestDefinition),
                      fmt::format("at most {}", kDeepestDefinition));
    }
    known_values.under_way.insert(name);
    const double value = run(*formula, scope, where, depth + 1, known_values);
    known_values.under_way.erase(name);
    known_values.values.emplace(name, value);
    return value;
  }

  double run(const std::string& text, const Scope& scope, std::string_view where, int depth,
             Known& known_values) {
    CompiledFormula& formula = compiled(text, where);
    // Looked up first: a definition may use the same formula and so the same storage.
    const auto values = mapped<double>(formula.names, [&](const auto& name) {
      return lookup(name, scope, where, depth, known_values);
    });
    std::copy(values.begin(), values.end(), formula.values.begin());
    double result = 0.0;
    try {
      result = formula.parser.Eval();
    } catch (const mu::ParserError& error) {
      throw broken(text, without_full_stop(error.GetMsg()), where);
    } catch (const Error& error) {
      throw error.within(fmt::format("{}: expression '{}'", where, printable(text)));
    }
    if (formula.parser.GetNumResults() != 1) throw broken(text, "more than one value", where);
    if (!std::isfinite(result)) {
      throw Error(ExitCode::numerical, where,
                  fmt::format("expression '{}' is not a finite number", printable(text)));
    }
    return result;
  }

  void collect(const std::string& text, const Scope& scope, std::string_view where, int depth,
               std::set<std::string>& found, std::set<std::string>& followed) {
    for (const auto& name : compiled(text, where).names) {
      const std::string* formula = scope.values.contains(name) ? nullptr : formula_of(name, scope);
      if (formula == nullptr || depth >= kDeepestDefinition) {
        found.insert(name);
      } else if (followed.insert(name).second) {
        collect(*formula, scope, where, depth + 1, found, followed);
      }
    }
  }

  void require_free(const std::string& name, std::string_view where) const {
    if (symbols.contains(name) || definitions.contains(name) ||
        reserved.GetConst().contains(name) || reserved.GetFunDef().contains(name)) {
      throw bad_input(where, fmt::format("the name '{}' is taken", printable(name)),
                      "a name of its own");
    }
  }
};

Evaluator::Evaluator() : impl_(std::make_unique<Impl>()) {}
Evaluator::~Evaluator() = default;
Evaluator::Evaluator(Evaluator&&) noexcept = default;
Evaluator& Evaluator::operator=(Evaluator&&) noexcept = default;

void Evaluator::define_symbol(const std::string& name, double value, std::string_view where) {
  impl_->require_free(name, where);
  impl_->symbols.emplace(name, value);
}

void Evaluator::define_expression(const std::string& name, std::string text,
                                  std::string_view where) {
  impl_->require_free(name, where);
  static_cast<void>(impl_->compiled(text, where));
  impl_->definitions.emplace(name, std::move(text));
}

double Evaluator::evaluate(const std::string& text, const Scope& scope,
                           std::string_view where) const {
  Impl::Known known_values;
  return impl_->run(text, scope, where, 0, known_values);
}

std::vector<std::string> Evaluator::inputs(const std::string& text, const Scope& scope,
                                           std::string_view where) const {
  std::set<std::string> found, followed;
  impl_->collect(text, scope, where, 0, found, followed);
  return {found.begin(), found.end()};
}

}  // namespace tpm::fit
