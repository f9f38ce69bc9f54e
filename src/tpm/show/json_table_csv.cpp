#include "tpm/show/json_table_csv.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "tpm/show/result_table.hpp"

namespace tpm::show {
namespace {

using FlatRow = std::map<std::string, std::string>;

/// Two limits under a key that says so.
bool is_interval(std::string_view key, const Json& value) {
  constexpr std::array<std::string_view, 4> kWords{"interval", "bounds", "band", "new_specimen"};
  return value.size() == 2 && std::ranges::any_of(kWords, [key](std::string_view word) {
           return key.find(word) != std::string_view::npos;
         });
}

/// Flat rows and their columns in the order in which these were first met.
class FlatTable {
 public:
  explicit FlatTable(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void add(const Json& row, std::string_view spread) {
    FlatRow flat;
    flatten(row, "", flat);
    const Json::json_pointer place{std::string(spread)};
    if (place.empty() || !row.contains(place) || row.at(place).empty()) {
      rows_.push_back(std::move(flat));
      return;
    }
    for (const Json& element : row.at(place)) {
      FlatRow one = flat;
      flatten(element, place.back() + "_", one);
      rows_.push_back(std::move(one));
    }
  }

  [[nodiscard]] std::string text() const {
    std::string text = csv_line(columns_);
    for (const FlatRow& row : rows_) {
      std::vector<std::string> cells;
      for (const std::string& column : columns_) {
        const auto found = row.find(column);
        cells.push_back(found == row.end() ? std::string() : found->second);
      }
      text += csv_line(cells);
    }
    return text;
  }

 private:
  void set(const std::string& column, std::string cell, FlatRow& row) {
    if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) {
      columns_.push_back(column);
    }
    row[column] = std::move(cell);
  }

  void flatten(const Json& object, const std::string& before, FlatRow& row) {
    for (const auto& [key, value] : object.items()) {
      const std::string column = before + key;
      if (value.is_object()) {
        flatten(value, column + "_", row);
      } else if (value.is_array()) {
        const bool plain = std::ranges::none_of(value, &Json::is_structured);
        if (!plain || value.empty()) continue;
        if (is_interval(key, value)) {
          set(column + "_lower", csv_cell(value[0], 0), row);
          set(column + "_upper", csv_cell(value[1], 0), row);
          continue;
        }
        set(column, csv_cell(value, 0), row);
      } else {
        set(column, csv_cell(value, 0), row);
      }
    }
  }

  std::vector<std::string> columns_;
  std::vector<FlatRow> rows_;
};

}  // namespace

std::string json_table_csv(const Json& rows, std::string_view spread,
                           std::vector<std::string> columns) {
  FlatTable table(std::move(columns));
  for (const Json& row : rows) table.add(row, spread);
  return table.text();
}

}  // namespace tpm::show
