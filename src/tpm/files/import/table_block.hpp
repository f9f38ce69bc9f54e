#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tpm/files/delimited.hpp"

namespace tpm::files {

/// Rows of samples that follow each other in a table, and the rows above that may say what they
/// are.
struct SampleBlock {
  std::size_t header_first = 0;  ///< row that follows the block before
  std::size_t first = 0;         ///< first row of samples
  std::size_t end = 0;           ///< row behind the last one
  std::size_t width = 0;         ///< fields of a row

  [[nodiscard]] std::size_t size() const noexcept { return end - first; }
};

/// Finds the blocks of samples of a table: rows with two or more numbers, which are most of their
/// fields. A block ends at a row of text (an end mark, titles of another table) or where another
/// begins; rows below the samples that begin with a text ("Maximum,4.0,0.35") do not belong to it.
/// A row that lacks numbers inside a block belongs to it: whoever reads it refuses it.
[[nodiscard]] std::vector<SampleBlock> find_sample_blocks(const DelimitedTable& table);

/// Refuses "5.36 +- 0.16" in one cell, with a sign of any kind between. Throws Error(bad_input).
void require_one_number_a_cell(const DelimitedTable& table, const std::string& file);

/// The block of all rows from `header_rows` on.
[[nodiscard]] SampleBlock block_below(const DelimitedTable& table, std::size_t header_rows);

/// "lines 12 to 300"
[[nodiscard]] std::string lines_of(const DelimitedTable& table, std::size_t first, std::size_t end);

/// A field of a row; empty if the row is too short.
[[nodiscard]] inline std::string_view field_at(const DelimitedRow& row, std::size_t index) {
  return index < row.fields.size() ? row.fields[index] : std::string_view();
}

}  // namespace tpm::files
