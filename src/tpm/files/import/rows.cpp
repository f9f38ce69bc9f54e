#include "tpm/files/import/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr std::array<std::string_view, 4> kTextColumns = {"label", "provenance", "where", "note"};

constexpr std::array<std::string_view, 11> kValueColumns = {
    "name", "quantity",   "value", "lower",   "upper", "plus_minus",
    "unit", "provenance", "where", "formula", "note"};

/// The project's own files are plain: comma, point, one header row.
DelimitedTable read_rows(std::string_view bytes, const std::string& file) {
  DelimitedOptions options;
  options.separator = ',';
  options.decimal_comma = false;
  DelimitedTable table = parse_delimited(bytes, file, options);
  if (table.rows.size() < 2) throw bad_input(file, "has a header but no rows", "at least one row");
  std::set<std::string_view> names;
  for (const std::string_view name : table.rows.front().fields) {
    if (!names.insert(name).second) {
      throw bad_input(fmt::format("{}:{}", file, table.rows.front().line),
                      fmt::format("column '{}' stands twice", printable(name)), "each column once");
    }
  }
  return table;
}

}  // namespace

CurveRows::CurveRows(std::string_view bytes, std::string file, const CurveDescription& description)
    : table_(read_rows(bytes, file)), file_(std::move(file)) {
  const auto names = table_.rows.front().fields;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(kTextColumns.begin(), kTextColumns.end(), names[i]) != kTextColumns.end()) {
      texts_.emplace(names[i], i);
    } else {
      describe(std::string(names[i]), i, description);
    }
  }
  for (const auto& [name, column] : description.columns) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw bad_input(fmt::format("{}:{}", file_, table_.rows.front().line),
                      fmt::format("no column '{}'", printable(name)),
                      "every column that the description names");
    }
  }
}

void CurveRows::describe(const std::string& name, std::size_t index,
                         const CurveDescription& description) {
  const std::string where = fmt::format("{}:{}", file_, table_.rows.front().line);
  const auto found = description.columns.find(name);
  if (found == description.columns.end()) {
    throw bad_input(where, fmt::format("column '{}' is not described", printable(name)),
                    "a key of that name under 'columns' of the description");
  }
  const Key key{found->second.quantity, found->second.bound};
  if (!numeric_.emplace(key, NumericColumn{index, found->second}).second) {
    throw bad_input(where,
                    fmt::format("two columns hold the {} of {}", bound_name(key.second),
                                quantity_name(key.first)),
                    "one column for each quantity");
  }
}

bool CurveRows::has(Quantity quantity, Bound bound) const {
  return numeric_.contains({quantity, bound});
}

std::string_view CurveRows::field(std::size_t row, std::size_t column) const {
  return table_.rows[row + 1].fields[column];
}

std::string CurveRows::place(std::size_t row, std::size_t column) const {
  return fmt::format("{}:{}: column '{}'", file_, line(row),
                     printable(table_.rows.front().fields[column]));
}

std::string CurveRows::place(std::size_t row, Quantity quantity, Bound bound) const {
  return place(row, numeric_.at({quantity, bound}).index);
}

std::optional<double> CurveRows::number(std::size_t row, Quantity quantity, Bound bound) const {
  const auto found = numeric_.find({quantity, bound});
  if (found == numeric_.end()) return std::nullopt;
  const auto& [index, description] = found->second;
  if (field(row, index).empty()) return std::nullopt;
  const auto where = [&, column = index] { return place(row, column); };
  return parse_field_at(field(row, index), false, where) * description.unit.to_si;
}

std::optional<double> CurveRows::at_least(std::size_t row, Quantity quantity, Bound bound,
                                          double least) const {
  const auto value = number(row, quantity, bound);
  if (value && *value < least) {
    throw bad_input(
        place(row, quantity, bound),
        fmt::format("{} is too small", printable(field(row, numeric_.at({quantity, bound}).index))),
        fmt::format("at least {}", least));
  }
  return value;
}

std::vector<double> CurveRows::full_column(Quantity quantity, Bound bound) const {
  if (!has(quantity, bound)) {
    throw bad_input(file_, fmt::format("no column for {}", quantity_name(quantity)),
                    "a column that the description gives this quantity");
  }
  std::vector<double> values;
  values.reserve(size());
  for (std::size_t row = 0; row < size(); ++row) {
    const auto value = number(row, quantity, bound);
    if (!value) throw bad_input(place(row, quantity, bound), "empty", "a number in every row");
    values.push_back(*value);
  }
  return values;
}

std::string CurveRows::text(std::size_t row, std::string_view column) const {
  const auto found = texts_.find(column);
  return found == texts_.end() ? std::string() : std::string(field(row, found->second));
}

Provenance CurveRows::provenance(std::size_t row) const {
  const auto found = texts_.find("provenance");
  if (found == texts_.end()) {
    throw bad_input(fmt::format("{}:{}", file_, table_.rows.front().line), "no column 'provenance'",
                    "a provenance word in every row");
  }
  return parse_provenance(field(row, found->second), place(row, found->second));
}

namespace {

/// One row of a file of kind "values".
class ValueRow {
 public:
  ValueRow(const DelimitedRow& row, const std::string& file) : row_(row), file_(file) {}

  [[nodiscard]] std::string text(std::string_view column) const {
    const auto at = std::find(kValueColumns.begin(), kValueColumns.end(), column);
    return std::string(row_.fields[static_cast<std::size_t>(at - kValueColumns.begin())]);
  }
  [[nodiscard]] std::optional<double> number(std::string_view column, double to_si) const {
    if (text(column).empty()) return std::nullopt;
    return parse_field(text(column), false, place(column)) * to_si;
  }
  [[nodiscard]] std::string place(std::string_view column) const {
    return fmt::format("{}:{}: column '{}'", file_, row_.line, column);
  }
  [[nodiscard]] int line() const { return row_.line; }

 private:
  const DelimitedRow& row_;
  const std::string& file_;
};

NamedValue read_value(const ValueRow& row) {
  NamedValue value;
  value.line = row.line();
  value.name = row.text("name");
  value.quantity = row.text("quantity");
  value.unit = parse_unit(row.text("unit"), row.place("unit"));
  value.value = row.number("value", value.unit.to_si);
  value.lower = row.number("lower", value.unit.to_si);
  value.upper = row.number("upper", value.unit.to_si);
  value.plus_minus = row.number("plus_minus", value.unit.to_si);
  value.provenance = parse_provenance(row.text("provenance"), row.place("provenance"));
  value.where = row.text("where");
  value.formula = row.text("formula");
  value.note = row.text("note");
  return value;
}

}  // namespace

ValueSet read_values(const CurveHeader& header, std::string_view bytes, const std::string& file) {
  const DelimitedTable table = read_rows(bytes, file);
  if (!std::equal(kValueColumns.begin(), kValueColumns.end(), table.rows.front().fields.begin(),
                  table.rows.front().fields.end())) {
    throw bad_input(fmt::format("{}:{}", file, table.rows.front().line), "wrong columns",
                    fmt::format("{}", fmt::join(kValueColumns, ",")));
  }
  ValueSet set;
  set.header = header;
  std::set<std::string> names;
  for (std::size_t i = 1; i < table.rows.size(); ++i) {
    const ValueRow row(table.rows[i], file);
    set.values.push_back(read_value(row));
    if (const auto fault = find_value_fault(set.values.back())) {
      throw bad_input(row.place(fault->column.c_str()), fault->what, fault->expected);
    }
    if (!names.insert(set.values.back().name).second) {
      throw bad_input(row.place("name"),
                      fmt::format("'{}' stands twice", printable(set.values.back().name)),
                      "each name once");
    }
  }
  return set;
}

}  // namespace tpm::files
