#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/files/import/table_block.hpp"
#include "tpm/files/number_style.hpp"

namespace tpm::files {

/// A column as the header shows it.
struct MachineColumn {
  std::size_t index;
  std::string name;  ///< may be empty
  std::string unit;  ///< may be empty
  std::optional<Recognized> meaning;
  std::optional<RefusedTitle> refused;  ///< its meaning but for a word or its unit
  bool misfit = false;  ///< the unit is none of what the title says: taken if no other column fits
  bool unit_is_chosen = false;                  ///< by the options, not by the file
  std::vector<std::string> unit_readings = {};  ///< of a unit that is two: "MPA" is mPa or MPa
  std::string title = {};  ///< as the file writes it, with its unit: "Force (N)"

  /// True if an option means this column: by its name, its title as it stands, or its number.
  [[nodiscard]] bool is_named(std::string_view selector) const;

  /// "column 2 'Force'"
  [[nodiscard]] std::string label() const;
  /// By its place from 1, as users may write it: "2", or "column 2" as messages do.
  [[nodiscard]] bool has_number(std::string_view selector) const;
};

struct MachineHeader {
  std::size_t rows = 0;  ///< above the samples
  SampleBlock block;
  NumberStyle style;
  std::string sheet;
  std::vector<MachineColumn> columns;
  std::vector<ImportFinding> findings;  ///< parts of the file that are not read
};

/// Finds the samples, and above them titles and units in any order: blank rows, titles of the file
/// and sheet names may stand between them, and titles may stand in comments. Of several blocks of
/// samples the one is taken whose titles are understood; options.block chooses. Units that the
/// options give go before those of the file. Throws Error(bad_input) if there are no samples, or
/// several blocks that could be meant.
[[nodiscard]] MachineHeader read_machine_header(const DelimitedTable& table,
                                                const std::string& file,
                                                const ImportOptions& options);

}  // namespace tpm::files
