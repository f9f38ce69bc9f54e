#pragma once
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "tpm/files/import/machine_header.hpp"

namespace tpm::files {

/// Finds the columns of a machine's table by what the user says or by their titles.
///
/// Of several titles the one closest to the specimen counts. Two of one rank with different numbers
/// are refused, naming the option that chooses, unless the whole set of titles repeats: then
/// specimens stand side by side, and the first is read.
class ColumnChoice {
 public:
  /// All are kept as references.
  ColumnChoice(const DelimitedTable& table, const MachineHeader& header, const std::string& file);

  /// @param selector  name, whole title or number from 1 of the column, or empty
  /// @param option    that chooses such a column, "--time"
  /// Null if none fits. Throws Error(bad_input) for a selector without a column.
  [[nodiscard]] const MachineColumn* find(ColumnRole role, const std::string& selector,
                                          const char* option) const;

  using Condition = std::function<bool(const MachineColumn&)>;
  /// By its title, among those that fulfil a condition.
  [[nodiscard]] const MachineColumn* by_title(ColumnRole role, const char* option,
                                              const Condition& condition = {}) const;

  /// True if its cells are times of day, with a date or without.
  [[nodiscard]] bool is_clock(const MachineColumn& column) const;

  /// The only column whose title means nothing and that is_clock(), such as 'Zeitstempel'; null if
  /// there is none.
  [[nodiscard]] const MachineColumn* lone_clock() const;

  /// A column of what was asked for in this role; null if there is none.
  [[nodiscard]] const MachineColumn* refused(ColumnRole role) const;

  /// Throws Error(bad_input) if no column has this name or number, whose unit the user says.
  void require_column_for_unit(const std::string& selector) const;

  /// "column 1 'Time', column 2 'Force'"
  [[nodiscard]] std::string list() const;

  /// Those that an option may take for what is missing: none of another quantity or dimension.
  /// Empty if there is none.
  /// @param without left out, null or not
  /// @param may_be  dimensions of what is missing; a column without a known unit may be any
  [[nodiscard]] std::string list_of(std::initializer_list<Dimension> may_be,
                                    std::initializer_list<const MachineColumn*> without) const;

  /// Number of specimens side by side, 1 or more.
  [[nodiscard]] std::size_t specimens() const noexcept { return specimens_; }

 private:
  [[nodiscard]] const MachineColumn& by_selector(const std::string& selector) const;
  [[nodiscard]] bool same_numbers(const MachineColumn& a, const MachineColumn& b) const;
  [[nodiscard]] bool rises(const MachineColumn& column) const;
  void count_specimens();

  const DelimitedTable& table_;
  const MachineHeader& header_;
  const std::string& file_;
  std::size_t specimens_ = 1;
  std::vector<bool> of_others_;  ///< true for a column of a later specimen
};

/// The number of a cell as it stands, without its unit; a clock as seconds. None for other texts.
[[nodiscard]] std::optional<double> find_cell_number(std::string_view field, NumberStyle style);

}  // namespace tpm::files
