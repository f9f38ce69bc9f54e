#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/paper/claims/claims.hpp"

namespace tpm::paper {

/// Verdict of recomputing what the paper prints.
enum class AuditVerdict {
  holds,
  holds_by_truncation,  ///< digits cut off instead of rounded
  last_digit_off,       ///< a neighbour of the printed last digit
  differs,              ///< another number; Finding::difference_percent says by how much
  contradicted,         ///< a statement that the paper's own equations or numbers refute
  undetermined,         ///< the paper gives no number to hold it to
};

inline constexpr auto kAuditVerdicts = std::to_array<Word<AuditVerdict>>({
    {AuditVerdict::holds, "holds"},
    {AuditVerdict::holds_by_truncation, "holds by truncation"},
    {AuditVerdict::last_digit_off, "last digit off"},
    {AuditVerdict::differs, "differs"},
    {AuditVerdict::contradicted, "contradicted"},
    {AuditVerdict::undetermined, "undetermined"},
});
[[nodiscard]] std::string_view verdict_name(AuditVerdict verdict) noexcept;

/// A number in the unit in which people read it.
struct AuditQuantity {
  double value = 0.0;
  Unit unit;
};

/// An input of a recomputation.
struct AuditInput {
  std::string name;
  std::string printed;  ///< as printed, with unit; empty if computed or bound by the claim
  AuditQuantity value;
  std::string where;
  std::string provenance;  ///< one of the words of Provenance; empty if the file says none
};

/// A changed input that would give the printed number.
struct AuditCause {
  std::string text;           ///< in words: "load = 0.2 N instead of 0.196 N"
  double recomputed = 0.0;    ///< what it gives, in the printed unit
  bool only_printed = false;  ///< uses nothing but other printed values of the symbol
  int digits = 0;             ///< significant digits of the changed value
  double relative_change = 0.0;
};

/// One of several numbers inside a finding: a table cell, a datum, a sample point.
struct AuditDetail {
  std::string what;
  std::string printed;  ///< or derived, as of the finding
  AuditQuantity recomputed;
  std::string verdict;
  std::optional<double> difference_percent;
  bool exact = false;  ///< the printed digits follow
};

/// Number of cells of printed tables that follow (kind "table").
struct AuditCells {
  int cells = 0;
  int by_rounding = 0;
  int by_truncation = 0;
};

/// Result of one claim.
struct Finding {
  std::string id;
  std::string topic;
  std::string kind;
  std::string where;
  std::string claim;    ///< the paper's words, quoted or paraphrased
  std::string printed;  ///< what is printed, with unit; empty if no number is
  /// Where no number is printed: what the printed equations give for the left side of `agree`, or
  /// the bound of `inequality`.
  std::string derived;
  std::optional<AuditQuantity> recomputed;  ///< in the printed unit
  std::optional<AuditQuantity> bound;       ///< right-hand side of an inequality
  std::string expression;                   ///< what was evaluated
  std::vector<AuditInput> inputs;
  AuditVerdict verdict = AuditVerdict::undetermined;
  std::optional<double> difference_percent;
  std::vector<AuditCause> causes;  ///< most plausible first: printed values, then few digits
  std::vector<AuditDetail> details;
  std::optional<AuditCells> cells;
  std::string consequence;

  /// The verdict in words: "differs by 2.3 %".
  [[nodiscard]] std::string verdict_words() const;
  /// The recomputed number, range or count of cells with its unit, four digits.
  [[nodiscard]] std::string recomputed_words() const;
  /// Number that the recomputed one is compared with: `printed`, else `derived`.
  [[nodiscard]] const std::string& compared() const noexcept {
    return printed.empty() ? derived : printed;
  }
  /// True for holds and holds_by_truncation.
  [[nodiscard]] bool stands() const noexcept;
};

struct AuditReport {
  std::string title;
  std::string file;
  std::vector<Finding> findings;

  [[nodiscard]] int count(AuditVerdict verdict) const noexcept;
};

/// Recomputes every claim of a claims file (docs/json.md describes the kinds). Every
/// verdict follows from a printed string and a recomputed number.
/// @param claims the document; checked against schemas/claims.schema.json
/// @param file its name, for messages
/// Throws Error(bad_input) naming file and claim, Error(numerical) if a formula gives no number.
[[nodiscard]] AuditReport run_audit(const Json& claims, std::string_view file);

/// docs/json.md lists the keys.
[[nodiscard]] Json to_json(const AuditReport& report);

}  // namespace tpm::paper
