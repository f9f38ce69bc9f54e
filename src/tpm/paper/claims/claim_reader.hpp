#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/claims/claims.hpp"

namespace tpm::paper {

/// One claim, whose formulas are evaluated in its scope. Errors name file and claim.
class ClaimReader {
 public:
  /// Keeps references to both.
  ClaimReader(const ClaimSet& set, const Claim& claim);

  [[nodiscard]] const ClaimSet& set() const noexcept { return set_; }
  [[nodiscard]] const std::string& at() const noexcept { return at_; }

  [[nodiscard]] const Claim* operator->() const noexcept { return &claim_; }
  /// A key that this kind of claim needs; Error(bad_input) with the key if it is missing.
  template <class V>
  [[nodiscard]] const V& needed(std::optional<V> Claim::*member) const {
    if (const std::optional<V>& value = claim_.*member) return *value;
    Claim only;
    if constexpr (std::is_same_v<V, std::string>) {
      (only.*member).emplace("a text");  // an empty one would not be written
    } else {
      (only.*member).emplace();
    }
    refuse_without(claim_key(only));
  }
  /// Of the printed number; of a plain one if the claim says none.
  [[nodiscard]] Unit unit() const;
  /// The printed number. Throws Error(bad_input) for the ends of a range.
  [[nodiscard]] PrintedNumber printed() const;
  /// The ends of a range or a band, low before high.
  [[nodiscard]] std::pair<PrintedNumber, PrintedNumber> printed_pair() const;

  /// Values that the claim binds.
  [[nodiscard]] Scope scope() const;
  /// As above for one row of a table: its cells and constants, then the claim's.
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
  [[noreturn]] void refuse_without(const std::string& key) const;

  const ClaimSet& set_;
  const Claim& claim_;
  std::string at_;
};

/// Adds the inputs that are not known yet.
void append(std::vector<AuditInput>& inputs, std::vector<AuditInput> more);

/// A number for a claim: an expression, a sum of terms, or the root of an equation.
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
  std::optional<ClaimEquation> solve_;
  std::string expression_;
};

}  // namespace tpm::paper
