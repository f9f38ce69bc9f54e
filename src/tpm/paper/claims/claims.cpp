#include "tpm/paper/claims/claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tpm/base/printed_number.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

std::string text_of(const Json& object, std::string_view key) {
  const auto found = object.find(key);
  return found == object.end() ? std::string{} : found->get<std::string>();
}

/// A printed value is a number in the symbol's unit, or a formula such as pi/6.
double printed_si(const std::string& value, const Unit& unit, const Evaluator& evaluator,
                  std::string_view at) {
  const bool is_formula = value.find_first_not_of("0123456789.eE+- ") != std::string::npos;
  const double number =
      is_formula ? evaluator.evaluate(value, {}, at) : parse_printed(value, at).value;
  return number * unit.to_si;
}

PrintedSymbol read_symbol(const Json& item, const Evaluator& evaluator, std::string_view file) {
  PrintedSymbol symbol;
  symbol.name = item.at("name").get<std::string>();
  symbol.words = item.value("words", symbol.name);
  const std::string at = fmt::format("{}: symbol '{}'", file, symbol.name);
  symbol.value = item.at("value").get<std::string>();
  symbol.unit = parse_unit(text_of(item, "unit"), at);
  symbol.si = printed_si(symbol.value, symbol.unit, evaluator, at);
  symbol.where = item.at("where").get<std::string>();
  symbol.provenance = text_of(item, "provenance");
  if (const auto also = item.find("also"); also != item.end()) {
    for (const Json& other : *also) {
      PrintedAlternative alternative;
      alternative.value = other.at("value").get<std::string>();
      alternative.si = printed_si(alternative.value, symbol.unit, evaluator, at);
      alternative.where = other.at("where").get<std::string>();
      symbol.also.push_back(std::move(alternative));
    }
  }
  return symbol;
}

PrintedTable read_table(const Json& item, std::string_view file) {
  PrintedTable table;
  table.id = item.at("id").get<std::string>();
  const std::string at = fmt::format("{}: table '{}'", file, table.id);
  table.where = item.at("where").get<std::string>();
  table.kind = item.at("kind").get<std::string>();
  if (const auto constants = item.find("constants"); constants != item.end()) {
    for (const auto& [name, value] : constants->items()) {
      table.constants.emplace_back(name, value.get<std::string>());
    }
  }
  for (const Json& column : item.at("columns")) {
    table.columns.push_back(
        {column.at("name").get<std::string>(), parse_unit(text_of(column, "unit"), at)});
  }
  for (const Json& row : item.at("rows")) {
    if (row.size() != table.columns.size()) {
      throw bad_input(at, fmt::format("row {} has {} cells", table.rows.size() + 1, row.size()),
                      fmt::format("{}, one for each column", table.columns.size()));
    }
    table.rows.push_back(row.get<std::vector<std::string>>());
    for (const std::string& cell : table.rows.back()) static_cast<void>(parse_printed(cell, at));
  }
  return table;
}

template <class Range, class Name>
void require_unique(const Range& range, const Name& name_of, std::string_view at) {
  std::set<std::string> seen;
  for (const auto& item : range) {
    if (!seen.insert(name_of(item)).second) {
      throw bad_input(at, fmt::format("'{}' stands twice", printable(name_of(item))),
                      "each id once");
    }
  }
}

}  // namespace

bool PrintedTable::has_column(std::string_view name) const noexcept {
  return std::ranges::any_of(columns, [&](const PrintedColumn& c) { return c.name == name; });
}

std::size_t PrintedTable::column(std::string_view name, std::string_view at) const {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].name == name) return i;
  }
  throw bad_input(at, fmt::format("table '{}' has no column '{}'", id, printable(name)),
                  "one of its columns");
}

double PrintedTable::si(std::size_t row, std::size_t column, std::string_view at) const {
  return parse_number(rows.at(row).at(column), at) * columns.at(column).unit.to_si;
}

const PrintedSymbol* ClaimSet::symbol(std::string_view name) const noexcept {
  const auto found = std::ranges::find(symbols, name, &PrintedSymbol::name);
  return found == symbols.end() ? nullptr : &*found;
}

const PrintedTable& ClaimSet::table(std::string_view id, std::string_view at) const {
  for (const PrintedTable& t : tables) {
    if (t.id == id) return t;
  }
  throw bad_input(at, fmt::format("unknown table '{}'", printable(id)), "an id from 'tables'");
}

std::filesystem::path paper_claims_path() {
  return share_dir() / "data" / "paper_claims.json";
}

std::vector<PrintedTable> read_printed_tables(const Json& document, std::string_view file) {
  std::vector<PrintedTable> tables;
  if (const auto items = document.find("tables"); items != document.end()) {
    for (const Json& item : *items) tables.push_back(read_table(item, file));
  }
  require_unique(
      tables, [](const PrintedTable& t) { return t.id; }, fmt::format("{}: tables", file));
  return tables;
}

ClaimSet read_claims(const Json& written, std::string_view file) {
  const Json document = checked(written, "claims", file);
  ClaimSet set;
  set.file = std::string(file);
  set.title = document.at("title").get<std::string>();
  for (const Json& item : document.at("symbols")) {
    set.symbols.push_back(read_symbol(item, set.evaluator, file));
    set.evaluator.define_symbol(set.symbols.back().name, set.symbols.back().si, file);
  }
  if (const auto definitions = document.find("definitions"); definitions != document.end()) {
    for (const Json& item : *definitions) {
      const auto name = item.at("name").get<std::string>();
      set.evaluator.define_expression(name, item.at("expression").get<std::string>(),
                                      fmt::format("{}: definition '{}'", file, name));
    }
  }
  set.tables = read_printed_tables(document, file);
  set.claims = document.at("claims");
  require_unique(
      set.claims, [](const Json& c) { return c.at("id").get<std::string>(); },
      fmt::format("{}: claims", file));
  return set;
}

std::optional<double> quantity_si(std::string_view text) {
  const auto space = text.find_first_of(" \t");
  if (space == std::string_view::npos || !is_unit(text.substr(space))) return std::nullopt;
  if (text.substr(0, space).find_first_not_of("0123456789.eE+-") != std::string_view::npos) {
    return std::nullopt;
  }
  const Unit unit = parse_unit(text.substr(space), text);
  return parse_number(text.substr(0, space), text) * unit.to_si;
}

}  // namespace tpm::paper
