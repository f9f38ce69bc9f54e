#pragma once
#include <cmath>
#include <concepts>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::show {

/// A value of a result as JSON; null for an empty optional and for a number that is not finite.
template <class T>
[[nodiscard]] Json result_value(const T& value) {
  if constexpr (requires { value.has_value(); }) {
    return value.has_value() ? result_value(*value) : Json(nullptr);
  } else if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
  } else {
    return Json(value);
  }
}

/// The value of a column in a row: a data member, a member function or a function of the row.
template <class Row>
class ResultMember {
 public:
  ResultMember() = default;
  template <class Get>
  requires std::invocable<const Get&, const Row&> ResultMember(Get get)
      : get_([get](const Row& row) { return result_value(std::invoke(get, row)); }) {}
  [[nodiscard]] Json operator()(const Row& row) const { return get_ ? get_(row) : Json(nullptr); }

 private:
  std::function<Json(const Row&)> get_;
};

/// A column of a result, declared once for JSON, CSV, terminal, Markdown and HTML.
template <class Row>
struct ResultColumn {
  /// @param name in JSON and CSV, with the SI unit; empty: in neither
  /// @param kept significant digits there; 0: all
  ResultColumn(std::string name, ResultMember<Row> of, int kept = kResultDigits)
      : key(std::move(name)), member(std::move(of)), digits(kept) {}
  /// Leaves the member out of JSON where it is null or an empty text.
  ResultColumn& or_left_out() {
    left_out = true;
    return *this;
  }
  /// Shows the column on terminals and pages, too.
  /// @param title heading, with the unit
  /// @param least width on a terminal; positive: aligned to the right
  /// @param si SI value of the unit
  ResultColumn& shown(std::string title, int least = 0, double si = 1.0, int significant = 4) {
    heading = std::move(title);
    width = least;
    unit = si;
    shown_digits = significant;
    is_shown = true;
    return *this;
  }
  /// Shows a number as this text; "-" where it is null.
  ResultColumn& as(std::string (*text)(double)) {
    return in_words([of = member, text](const Row& row) {
      const Json value = of(row);
      return Cell{value.is_null() ? "-" : text(value.template get<double>())};
    });
  }
  /// Shows this cell in place of the member.
  ResultColumn& in_words(std::function<Cell(const Row&)> text) {
    words = std::move(text);
    return *this;
  }

  std::string key;
  ResultMember<Row> member;
  int digits = kResultDigits;
  bool left_out = false, is_shown = false;
  std::string heading{};
  int width = 0;
  double unit = 1.0;
  int shown_digits = 4;
  std::function<Cell(const Row&)> words{};
};

/// A number with so many significant digits; anything else as it is.
[[nodiscard]] Json with_digits(Json value, int digits);
/// Text of a value in CSV: "yes", "no", nothing for null, the items of a list between blanks.
[[nodiscard]] std::string csv_cell(const Json& value, int digits);
/// Text of a value for people; "-" for null.
[[nodiscard]] std::string shown_cell(const Json& value, double unit, int digits);
/// One line of a table on a terminal: a blank between cells, two before one that is aligned to the
/// left and follows one aligned to the right.
/// @param widths least of each cell; positive: aligned to the right
[[nodiscard]] std::string aligned_line(const std::vector<Cell>& cells,
                                       const std::vector<int>& widths);

/// The columns of a result and the forms of its rows: the same values, units and digits in each.
template <class Row>
class ResultTable {
 public:
  ResultTable(std::vector<ResultColumn<Row>> columns) : columns_(std::move(columns)) {}

  [[nodiscard]] Json object(const Row& row) const {
    Json json = Json::object();
    for (const ResultColumn<Row>& c : columns_) {
      if (c.key.empty()) continue;
      Json value = with_digits(c.member(row), c.digits);
      if (!c.left_out || !(value.is_null() || value == "")) json[c.key] = std::move(value);
    }
    return json;
  }
  template <class Rows>
  [[nodiscard]] Json list(const Rows& rows) const {
    return array_json(rows, [this](const Row& row) { return object(row); });
  }
  /// A list for each column, of one value a row.
  template <class Rows>
  [[nodiscard]] Json lists(const Rows& rows) const {
    Json json = Json::object();
    for (const ResultColumn<Row>& c : columns_) {
      if (c.key.empty()) continue;
      json[c.key] =
          array_json(rows, [&c](const Row& row) { return with_digits(c.member(row), c.digits); });
    }
    return json;
  }
  template <class Rows>
  [[nodiscard]] std::string csv(const Rows& rows) const {
    std::string text = csv_line(keys());
    for (const Row& row : rows) text += csv_line(csv_cells(row));
    return text;
  }
  /// The line of headings and one for each row, each with a line feed.
  template <class Rows>
  [[nodiscard]] std::string text(const Rows& rows) const {
    std::string text = head() + "\n";
    for (const Row& row : rows) text += line(row) + "\n";
    return text;
  }
  /// For Markdown and HTML.
  template <class Rows>
  [[nodiscard]] Table page(std::string caption, const Rows& rows) const {
    Table table{std::move(caption), {}};
    for (const ResultColumn<Row>& c : columns_) {
      if (c.is_shown) table.columns.push_back({c.heading, c.width > 0});
    }
    for (const Row& row : rows) table.rows.push_back(cells(row));
    return table;
  }

  [[nodiscard]] std::string head() const {
    return aligned(mapped_shown([](const auto& c) { return Cell{c.heading}; }));
  }
  [[nodiscard]] std::string line(const Row& row) const { return aligned(cells(row)); }
  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const ResultColumn<Row>& c : columns_) {
      if (!c.key.empty()) keys.push_back(c.key);
    }
    return keys;
  }
  [[nodiscard]] std::vector<std::string> csv_cells(const Row& row) const {
    std::vector<std::string> cells;
    for (const ResultColumn<Row>& c : columns_) {
      if (!c.key.empty()) cells.push_back(csv_cell(c.member(row), c.digits));
    }
    return cells;
  }

 private:
  template <class Make>
  [[nodiscard]] std::vector<Cell> mapped_shown(const Make& make) const {
    std::vector<Cell> cells;
    for (const ResultColumn<Row>& c : columns_) {
      if (c.is_shown) cells.push_back(make(c));
    }
    return cells;
  }
  [[nodiscard]] std::vector<Cell> cells(const Row& row) const {
    return mapped_shown([&](const ResultColumn<Row>& c) {
      return c.words ? c.words(row) : Cell{shown_cell(c.member(row), c.unit, c.shown_digits)};
    });
  }
  [[nodiscard]] std::string aligned(const std::vector<Cell>& cells) const {
    std::vector<int> widths;
    for (const ResultColumn<Row>& c : columns_) {
      if (c.is_shown) widths.push_back(c.width);
    }
    return aligned_line(cells, widths);
  }

  std::vector<ResultColumn<Row>> columns_;
};

/// A line of CSV for each item of each row: the columns of the row, then those of the item.
/// @param items of a row, a member or a function
template <class Row, class Rows, class Items, class Item>
[[nodiscard]] std::string nested_csv(const ResultTable<Row>& outer, const Rows& rows, Items items,
                                     const ResultTable<Item>& inner) {
  const auto joined = [](std::vector<std::string> left, const std::vector<std::string>& right) {
    left.insert(left.end(), right.begin(), right.end());
    return csv_line(left);
  };
  std::string text = joined(outer.keys(), inner.keys());
  for (const Row& row : rows) {
    for (const Item& item : std::invoke(items, row)) {
      text += joined(outer.csv_cells(row), inner.csv_cells(item));
    }
  }
  return text;
}

}  // namespace tpm::show
