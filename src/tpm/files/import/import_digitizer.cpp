#include "tpm/files/import/import_digitizer.hpp"

#include <fmt/format.h>

#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

bool is_word(std::string_view field, char word) {
  return field.size() == 1 && (field[0] == word || field[0] == word - 'a' + 'A');
}

/// X,Y,X,Y,...
bool is_pair_row(const DelimitedRow& row) {
  if (row.fields.size() < 2 || row.fields.size() % 2 != 0) return false;
  for (std::size_t i = 0; i < row.fields.size(); ++i) {
    if (!is_word(row.fields[i], i % 2 == 0 ? 'x' : 'y')) return false;
  }
  return true;
}

double coordinate(const DelimitedTable& table, const DelimitedRow& row, std::size_t index,
                  const std::string& file) {
  return parse_field_at(row.fields[index], table.decimal_comma,
                        [&] { return fmt::format("{}:{}: column {}", file, row.line, index + 1); });
}

bool is_empty_at(const DelimitedRow& row, std::size_t index) {
  return index >= row.fields.size() || row.fields[index].empty();
}

Error wrong_width(const DelimitedRow& row, const std::string& file, const std::string& expected) {
  return bad_input(fmt::format("{}:{}", file, row.line),
                   fmt::format("{} fields in this row", row.fields.size()), expected);
}

std::vector<DigitizedDataset> read_pairs(const DelimitedTable& table, const std::string& file) {
  const auto& names = table.rows[0].fields;
  std::vector<DigitizedDataset> datasets(table.rows[1].fields.size() / 2);
  for (std::size_t d = 0; d < datasets.size(); ++d) {
    if (2 * d < names.size()) datasets[d].name = names[2 * d];
  }
  for (std::size_t i = 2; i < table.rows.size(); ++i) {
    const DelimitedRow& row = table.rows[i];
    if (row.fields.size() > 2 * datasets.size()) {
      throw wrong_width(row, file, fmt::format("at most {}", 2 * datasets.size()));
    }
    for (std::size_t d = 0; d < datasets.size(); ++d) {
      if (is_empty_at(row, 2 * d) && is_empty_at(row, 2 * d + 1)) continue;
      if (is_empty_at(row, 2 * d) || is_empty_at(row, 2 * d + 1)) {
        throw bad_input(
            fmt::format("{}:{}", file, row.line),
            fmt::format("dataset '{}' has only one of x and y", printable(datasets[d].name)),
            "both or none");
      }
      datasets[d].x.push_back(coordinate(table, row, 2 * d, file));
      datasets[d].y.push_back(coordinate(table, row, 2 * d + 1, file));
    }
  }
  return datasets;
}

/// One block of an Engauge export: for each curve its column and the column of its x.
struct EngaugeColumn {
  std::size_t x;
  std::size_t y;
  std::size_t dataset;
};

std::vector<EngaugeColumn> begin_block(const DelimitedRow& titles, const std::string& file,
                                       std::vector<DigitizedDataset>& datasets) {
  std::vector<EngaugeColumn> columns;
  std::size_t x = 0;
  for (std::size_t i = 0; i < titles.fields.size(); ++i) {
    if (is_word(titles.fields[i], 'x')) {
      x = i;
    } else if (i == 0) {
      throw bad_input(fmt::format("{}:{}", file, titles.line), "the first title is not 'x'",
                      "x,Curve1,...");
    } else if (!titles.fields[i].empty()) {
      columns.push_back({x, i, datasets.size()});
      datasets.push_back({std::string(titles.fields[i]), {}, {}});
    }
  }
  return columns;
}

void add_point(const DelimitedTable& table, const DelimitedRow& row, const EngaugeColumn& column,
               const std::string& file, DigitizedDataset& dataset) {
  if (is_empty_at(row, column.y)) return;
  if (is_empty_at(row, column.x)) {
    throw bad_input(fmt::format("{}:{}", file, row.line),
                    fmt::format("curve '{}' has a value but no x", printable(dataset.name)),
                    "both or none");
  }
  dataset.x.push_back(coordinate(table, row, column.x, file));
  dataset.y.push_back(coordinate(table, row, column.y, file));
}

}  // namespace

std::vector<DigitizedDataset> read_wpd_csv(const DelimitedTable& table, const std::string& file) {
  if (table.rows.size() > 1 && is_pair_row(table.rows[1])) return read_pairs(table, file);
  DigitizedDataset dataset;
  for (const DelimitedRow& row : table.rows) {
    if (row.fields.size() != 2) throw wrong_width(row, file, "x and y");
    dataset.x.push_back(coordinate(table, row, 0, file));
    dataset.y.push_back(coordinate(table, row, 1, file));
  }
  return {dataset};
}

std::vector<DigitizedDataset> read_engauge(const DelimitedTable& table, const std::string& file) {
  std::vector<DigitizedDataset> datasets;
  std::vector<EngaugeColumn> columns;
  std::size_t width = 0;
  for (const DelimitedRow& row : table.rows) {
    if (columns.empty() || is_word(row.fields[0], 'x')) {
      columns = begin_block(row, file, datasets);
      width = row.fields.size();
      continue;
    }
    if (row.fields.size() > width) throw wrong_width(row, file, fmt::format("at most {}", width));
    for (const EngaugeColumn& column : columns) {
      add_point(table, row, column, file, datasets[column.dataset]);
    }
  }
  return datasets;
}

bool is_wpd_csv(const DelimitedTable& table) {
  const auto& rows = table.rows;
  if (rows.size() > 1 && is_pair_row(rows[1])) return true;
  const auto& first = rows[0].fields;
  return first.size() == 2 && is_number(first[0], table.decimal_comma) &&
         is_number(first[1], table.decimal_comma);
}

bool is_engauge(const DelimitedTable& table) {
  // "x,y" is a table of plain numbers; Engauge puts curve names beside its x.
  const auto& first = table.rows[0].fields;
  return first.size() > 1 && is_word(first[0], 'x') && !is_word(first[1], 'y');
}

}  // namespace tpm::files
