#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/claims/claims.hpp"

namespace tpm::paper {

/// Reads the keys of one claim and evaluates formulas in its scope. Errors name file and claim.
class ClaimReader {
 public:
  /// Keeps references to both.
  ClaimReader(const ClaimSet& set, const Json& claim);

  [[nodiscard]] const ClaimSet& set() const noexcept { return set_; }
  [[nodiscard]] const std::string& at() const noexcept { return at_; }

  [[nodiscard]] bool has(std::string_view key) const { return claim_.contains(key); }
  /// Value of a key that this kind of claim needs; Error(bad_input) if it is missing.
  [[nodiscard]] const Json& required(std::string_view key) const;
  [[nodiscard]] std::string text(std::string_view key) const;
  [[nodiscard]] std::string text_or(std::string_view key, std::string_view otherwise) const;
  /// Key "unit", "" if missing.
  [[nodiscard]] Unit unit() const;

  /// Values that key "with" binds.
  [[nodiscard]] Scope scope() const;
  /// As above for one row of a table: its cells and constants, then "with".
  [[nodiscard]] Scope row_scope(const PrintedTable& table, std::size_t row) const;
  /// Binds a name to a quantity or a formula; the dimension must be that of the symbol.
  void bind(Scope& scope, const std::string& name, const std::string& value) const;

  [[nodiscard]] double evaluate(const std::string& expression, const Scope& scope) const;
  /// A quantity such as "30 s", or a formula.
  [[nodiscard]] double quantity(const std::string& text, const Scope& scope) const;

  /// The inputs of an expression with their printed forms.
  [[nodiscard]] std::vector<AuditInput> inputs(const std::string& expression,
                                               const Scope& scope) const;

 private:
  void bind_own(Scope& scope) const;

  const ClaimSet& set_;
  const Json& claim_;
  std::string at_;
};

/// Adds the inputs that are not known yet.
void append(std::vector<AuditInput>& inputs, std::vector<AuditInput> more);

/// A number for a claim: a sum of terms, or the root of an equation (keys "expression", "terms" or
/// "solve").
class ClaimValue {
 public:
  explicit ClaimValue(const ClaimReader& reader);

  [[nodiscard]] std::size_t terms() const noexcept { return terms_.size(); }
  /// SI value of one term.
  [[nodiscard]] double term(std::size_t index, const Scope& scope) const;
  [[nodiscard]] double total(const Scope& scope) const;
  /// In words, for the report.
  [[nodiscard]] const std::string& expression() const noexcept { return expression_; }
  [[nodiscard]] std::vector<AuditInput> inputs(const Scope& scope) const;

 private:
  [[nodiscard]] double root(const Scope& scope) const;

  const ClaimReader& reader_;
  std::vector<std::string> terms_;
  std::string unknown_, left_, right_, from_, to_;  ///< of "solve"
  std::string expression_;
};

}  // namespace tpm::paper
