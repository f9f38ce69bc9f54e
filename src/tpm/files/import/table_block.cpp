#include "tpm/files/import/table_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tpm/files/clock_text.hpp"
#include "tpm/files/number_style.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

bool is_reading(std::string_view field) {
  return is_number_in_some_style(field) || is_clock_text(field);
}

struct RowCount {
  std::size_t filled = 0;
  std::size_t readings = 0;
  bool text_first = false;  ///< the first filled field is none

  [[nodiscard]] bool is_sample() const { return readings >= 2 && 2 * readings > filled; }
};

RowCount count_row(const DelimitedRow& row) {
  RowCount count;
  for (const std::string_view field : row.fields) {
    if (field.empty()) continue;
    const bool reading = is_reading(field);
    if (count.filled == 0) count.text_first = !reading;
    ++count.filled;
    if (reading) ++count.readings;
  }
  return count;
}

/// Fields without the empty ones at the end.
std::size_t filled_width(const DelimitedRow& row) {
  std::size_t width = row.fields.size();
  while (width > 0 && row.fields[width - 1].empty()) --width;
  return width;
}

class BlockFinder {
 public:
  explicit BlockFinder(const DelimitedTable& table) : rows_(table.rows) {}

  std::vector<SampleBlock> find() {
    std::size_t i = 0;
    std::size_t header = 0;
    while (i < rows_.size()) {
      if (!begins_at(i)) {
        ++i;
        continue;
      }
      SampleBlock block{header, i, end_of(i), rows_[i].fields.size()};
      i = block.end;
      trim(block);
      // Two numbers in one row may be data of the specimen, above its titles.
      if (block.size() > 1) header = block.end;
      blocks_.push_back(block);
    }
    return std::move(blocks_);
  }

 private:
  [[nodiscard]] bool is_sample(std::size_t i) const { return count_row(rows_[i]).is_sample(); }
  [[nodiscard]] bool same_width(std::size_t i, std::size_t j) const {
    return rows_[i].fields.size() == rows_[j].fields.size() ||
           filled_width(rows_[i]) == filled_width(rows_[j]);
  }

  /// Samples come in rows of one width: a row of another above two of them is no sample.
  [[nodiscard]] bool begins_at(std::size_t i) const {
    if (!is_sample(i)) return false;
    if (i + 2 >= rows_.size() || !is_sample(i + 1) || !is_sample(i + 2)) return true;
    return same_width(i, i + 1) || !same_width(i + 1, i + 2);
  }

  [[nodiscard]] std::size_t end_of(std::size_t first) const {
    const std::size_t width = rows_[first].fields.size();
    std::size_t i = first + 1;
    while (i < rows_.size()) {
      const RowCount count = count_row(rows_[i]);
      if (!count.is_sample()) {
        const bool gap = count.readings > 0 && !count.text_first && rows_[i].fields.size() == width;
        if (!gap) break;
      }
      ++i;
    }
    return i;
  }

  /// Takes rows that begin with a text from the end, where the first sample begins with a number.
  void trim(SampleBlock& block) const {
    if (count_row(rows_[block.first]).text_first) return;
    while (block.size() > 1 && count_row(rows_[block.end - 1]).text_first) --block.end;
  }

  const std::vector<DelimitedRow>& rows_;
  std::vector<SampleBlock> blocks_;
};

}  // namespace

void require_one_number_a_cell(const DelimitedTable& table, const std::string& file) {
  constexpr auto kMarks = std::to_array<std::string_view>({"\xC2\xB1", "+/-", "+-"});
  for (const DelimitedRow& row : table.rows) {
    for (const std::string_view field : row.fields) {
      const bool digits = !field.empty() && field.front() >= '0' && field.front() <= '9';
      const bool both = digits && std::ranges::any_of(kMarks, [field](std::string_view mark) {
                          return field.find(mark) != std::string_view::npos;
                        });
      if (!both) continue;
      throw bad_input(fmt::format("{}:{}", file, row.line),
                      fmt::format("'{}' in one cell", printable(field)),
                      "the value and its standard deviation in columns of their own, such as G(t) "
                      "[kPa] and SD [kPa]");
    }
  }
}

std::vector<SampleBlock> find_sample_blocks(const DelimitedTable& table) {
  return BlockFinder(table).find();
}

SampleBlock block_below(const DelimitedTable& table, std::size_t header_rows) {
  return {0, header_rows, table.rows.size(), table.rows[header_rows].fields.size()};
}

std::string lines_of(const DelimitedTable& table, std::size_t first, std::size_t end) {
  const int from = table.rows[first].line, to = table.rows[end - 1].line;
  return from == to ? fmt::format("line {}", from) : fmt::format("lines {} to {}", from, to);
}

}  // namespace tpm::files
