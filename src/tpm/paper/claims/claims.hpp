#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/fit/expression/expression.hpp"
#include "tpmkit/units.hpp"

namespace tpm::paper {

/// A value that the paper prints for a symbol in another place.
struct PrintedAlternative {
  std::string value;  ///< as printed
  double si = 0.0;
  std::string where;
};

/// A named number of the paper.
struct PrintedSymbol {
  std::string name;
  std::string summary;  ///< in texts, "load" of load_small; the name if the file says none
  std::string value;    ///< as printed, e.g. "12" or "pi/6"
  Unit unit{"", Dimension::dimensionless, 1.0};  ///< of a plain number unless said
  double si = 0.0;
  std::string where;
  std::string provenance;                ///< empty if not said
  std::vector<PrintedAlternative> also;  ///< printed elsewhere for the same thing
};

/// A column of a printed table; its name is bound to the row's value while a row is evaluated.
struct PrintedColumn {
  std::string name;
  Unit unit{"", Dimension::dimensionless, 1.0};  ///< of a plain number unless said
};

/// A table with its numbers as printed, row by row.
struct PrintedTable {
  std::string id;
  std::string where;
  std::string kind;  ///< "relaxation", "static_band" (which `tpm paper tables` knows) or "other"
  std::vector<std::pair<std::string, std::string>> constants;  ///< names bound for every row
  std::vector<PrintedColumn> columns;
  std::vector<std::vector<std::string>> rows;

  /// Index of a column; throws Error(bad_input) starting with `at` if there is none.
  [[nodiscard]] std::size_t column(std::string_view name, std::string_view at) const;
  [[nodiscard]] bool has_column(std::string_view name) const noexcept;
  /// The SI value of a cell.
  [[nodiscard]] double si(std::size_t row, std::size_t column, std::string_view at) const;
};

/// An equation of one unknown, whose root lies between two quantities or formulas.
struct ClaimEquation {
  std::string unknown, left, right, from, to;
};

struct ClaimTransform {
  std::string variable, time;
};

struct ClaimRange {
  std::string symbol, from, to;
};

struct ClaimValues {
  std::string symbol;
  std::vector<std::string> values;
};

/// An expression beside a column of a table.
struct ClaimSeries {
  std::string column, expression;
};

struct ClaimNumber {
  std::string expression;
  std::optional<std::string> unit;
};

/// Something that the paper says. Which members a claim needs follows from its kind
/// (audit_kinds.hpp).
struct Claim {
  using Texts = std::vector<std::string>;
  using Bindings = std::vector<std::pair<std::string, std::string>>;

  std::string id, kind, where, quote;
  std::optional<std::string> topic, unit, expression, left, right, relation, tolerance,
      relative_error, claimed_dimension, if_holds, if_fails, if_open;
  std::optional<Texts> printed;  ///< a number, or the ends of a range
  std::optional<Texts> terms, tables, band, search;
  std::optional<Bindings> rows, with;
  std::optional<ClaimEquation> solve;
  std::optional<ClaimTransform> transform;
  std::optional<ClaimRange> over;
  std::optional<ClaimValues> vary;
  std::optional<std::vector<ClaimSeries>> series;
  std::optional<std::vector<std::pair<std::string, ClaimNumber>>> report;
};

/// The key of a member that a claim may leave out.
/// @param only a claim with this member and no other of them
[[nodiscard]] std::string claim_key(const Claim& only);

/// A claims file, read: what a paper prints, in which units, and the formulas that connect it.
struct ClaimSet {
  std::string file;  ///< for messages
  std::string title;
  Evaluator evaluator;
  std::vector<PrintedSymbol> symbols;
  std::vector<PrintedTable> tables;
  std::vector<Claim> claims;  ///< each has a unique id

  [[nodiscard]] const PrintedSymbol* symbol(std::string_view name) const noexcept;
  /// Throws Error(bad_input) starting with `at` if there is no such table.
  [[nodiscard]] const PrintedTable& table(std::string_view id, std::string_view at) const;
};

/// The paper's own claims: data/paper_claims.json of share_dir().
[[nodiscard]] std::filesystem::path paper_claims_path();

/// Claims that a paper prints.
[[nodiscard]] const FileKind& claims_kind();

/// Only the tables of a claims file, which is all that `tpm paper tables` needs. Throws
/// Error(bad_input) as read_claims() does.
[[nodiscard]] std::vector<PrintedTable> read_printed_tables(const Json& document,
                                                            std::string_view file);

/// Reads a document. Throws Error(bad_input) naming the file
/// and the symbol, table or claim.
[[nodiscard]] ClaimSet read_claims(const Json& document, std::string_view file);

/// A quantity ("0.196 N") as its SI value; nothing if the text is not a number followed by a unit,
/// and so is a formula.
[[nodiscard]] std::optional<double> quantity_si(std::string_view text);

}  // namespace tpm::paper
