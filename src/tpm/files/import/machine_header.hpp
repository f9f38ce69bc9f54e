#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tpm/files/import/header_words.hpp"
#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// A column as the header shows it.
struct MachineColumn {
  std::size_t index;
  std::string name;  ///< may be empty
  std::string unit;  ///< may be empty
  std::optional<Recognized> meaning;

  /// "column 2 'Force'"
  [[nodiscard]] std::string label() const;
};

struct MachineHeader {
  std::size_t rows = 0;
  std::string sheet;
  std::vector<MachineColumn> columns;
};

/// Finds the rows above the samples, and in them titles and units in any order: blank rows, titles
/// of the file and sheet names may stand between them. Units that the options give go before those
/// of the file. Throws Error(bad_input) if there are no samples.
[[nodiscard]] MachineHeader read_machine_header(const DelimitedTable& table,
                                                const std::string& file,
                                                const ImportOptions& options);

}  // namespace tpm::files
