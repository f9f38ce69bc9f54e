#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/files/delimited.hpp"
#include "tpm/files/import/description.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::files {

/// The rows of a curve's CSV file, read through its description: fields become SI numbers, and
/// errors name file, line and column. The first row holds the column names.
class CurveRows {
 public:
  /// Throws Error(bad_input) if the columns and their description do not match.
  CurveRows(std::string_view bytes, std::string file, const CurveDescription& description);

  [[nodiscard]] std::size_t size() const noexcept { return table_.rows.size() - 1; }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  [[nodiscard]] int line(std::size_t row) const { return table_.rows[row + 1].line; }
  [[nodiscard]] bool has(Quantity quantity, Bound bound = Bound::value) const;

  /// "FILE:LINE: column 'force_N'".
  [[nodiscard]] std::string place(std::size_t row, Quantity quantity, Bound bound) const;

  /// SI; none if there is no such column or the field is empty.
  [[nodiscard]] std::optional<double> number(std::size_t row, Quantity quantity, Bound bound) const;
  /// As number(), and an error below `least` (SI).
  [[nodiscard]] std::optional<double> at_least(std::size_t row, Quantity quantity, Bound bound,
                                               double least) const;
  /// Every row's number; an empty field or a missing column is an error.
  [[nodiscard]] std::vector<double> full_column(Quantity quantity, Bound bound) const;
  /// Empty if there is no such column.
  [[nodiscard]] std::string text(std::size_t row, std::string_view column) const;
  /// The word in column 'provenance', which has to be there.
  [[nodiscard]] Provenance provenance(std::size_t row) const;

 private:
  struct NumericColumn {
    std::size_t index;
    ColumnDescription description;
  };
  using Key = std::pair<Quantity, Bound>;

  void describe(const std::string& name, std::size_t index, const CurveDescription& description);
  [[nodiscard]] std::string_view field(std::size_t row, std::size_t column) const;
  [[nodiscard]] std::string place(std::size_t row, std::size_t column) const;

  DelimitedTable table_;
  std::string file_;
  std::map<Key, NumericColumn> numeric_;
  std::map<std::string, std::size_t, std::less<>> texts_;
};

/// Reads the CSV file of kind "values", whose columns are fixed: name, quantity, value, lower,
/// upper, plus_minus, unit, provenance, where, formula, note.
[[nodiscard]] ValueSet read_values(const CurveHeader& header, std::string_view bytes,
                                   const std::string& file);

}  // namespace tpm::files
