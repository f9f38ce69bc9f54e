#include "tpm/paper/claims/claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/data/curve_words.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

/// A printed value is a number in the symbol's unit, or a formula such as pi/6.
double printed_si(const std::string& value, const Unit& unit, const Evaluator& evaluator,
                  std::string_view at) {
  const bool is_formula = value.find_first_not_of("0123456789.eE+- ") != std::string::npos;
  const double number =
      is_formula ? evaluator.evaluate(value, {}, at) : parse_printed(value, at).value;
  return number * unit.to_si;
}

/// Unread keys are for people: they can find in the paper what is said of it.
template <class T>
Key<T> quote_key() {
  return unread<T>("quote", text().form, "the paper's own words");
}

template <class T>
Key<T> where_key(std::string T::*where) {
  return required(key("where", where, text(1), "where the paper says so"));
}

ValueType<std::string> name_text() {
  return text_like("^[A-Za-z_][A-Za-z0-9_]*$", "a name of letters, digits and _", "E1")
      .named("name", "a name of letters, digits and _");
}

const Block<PrintedAlternative>& alternative_block() {
  using A = PrintedAlternative;
  static const Block<A> block(
      "alternative", "a value that is printed elsewhere for the same",
      {required(key("value", &A::value, text(1), "as printed")), where_key(&A::where)});
  return block;
}

const Block<PrintedSymbol>& symbol_block() {
  using S = PrintedSymbol;
  std::vector<std::string> provenances;
  for (const auto& entry : kProvenances) provenances.emplace_back(entry.text);
  static const Block<S> block(
      "symbol", "a named number of the paper",
      {required(key("name", &S::name, name_text(), "in formulas")),
       key("summary", &S::summary, text(1),
           "its name in texts, such as load; the name if left out"),
       required(key("value", &S::value, text(1), "as printed, or a formula such as pi/6")),
       key("unit", &S::unit, unit_text(), "of the value; left out for a plain number"),
       where_key(&S::where), quote_key<S>(),
       key("provenance", &S::provenance, one_of(provenances), "where the paper has it from"),
       key("also", &S::also, list(alternative_block().type()), "printed elsewhere for the same")});
  return block;
}

struct Definition {
  std::string name, expression, where;
};

const Block<Definition>& definition_block() {
  using D = Definition;
  static const Block<D> block(
      "definition", "a name for an expression",
      {required(key("name", &D::name, name_text(), "in formulas")),
       required(key("expression", &D::expression, text(1), "what it stands for")),
       where_key(&D::where), quote_key<D>()});
  return block;
}

const Block<PrintedColumn>& printed_column_block() {
  using C = PrintedColumn;
  static const Block<C> block(
      "printed_column", "a column of a printed table",
      {required(key("name", &C::name, name_text(), "bound to a row's value in formulas")),
       key("unit", &C::unit, unit_text(), "of its cells; left out for plain numbers")});
  return block;
}

const Block<PrintedTable>& table_block() {
  using T = PrintedTable;
  static const Block<T> block(
      "printed_table", "a table with its numbers as printed",
      {required(key("id", &T::id, text(1), "a name for claims")),
       required(key("kind", &T::kind, one_of({"relaxation", "static_band", "other"}),
                    "what tpm paper tables knows it as")),
       where_key(&T::where),
       key("constants", &T::constants, map_of(text(1)), "names bound for every row"),
       required(key("columns", &T::columns, list(printed_column_block().type(), {.fewest = 1}),
                    "in their order")),
       required(key("rows", &T::rows, list(list(text(1)), {.fewest = 1}),
                    "the cells of each row, as printed"))},
      {{"a cell for each column in every row", [](const T& table) -> std::optional<Fault> {
          for (std::size_t i = 0; i < table.rows.size(); ++i) {
            if (table.rows[i].size() == table.columns.size()) continue;
            return Fault{"rows", fmt::format("row {} of table '{}' has {} cells", i + 1, table.id,
                                             table.rows[i].size())};
          }
          return std::nullopt;
        }}});
  return block;
}

const Block<ClaimRange>& range_block() {
  using R = ClaimRange;
  static const Block<R> block("range_of_symbol", "a range of a symbol",
                              {required(key("symbol", &R::symbol, name_text(), "which")),
                               required(key("from", &R::from, text(1), "its first value")),
                               required(key("to", &R::to, text(1), "its last value"))});
  return block;
}

const Block<ClaimEquation>& equation_block() {
  using E = ClaimEquation;
  static const Block<E> block(
      "equation", "an equation of one unknown",
      {required(key("unknown", &E::unknown, name_text(), "what is looked for")),
       required(key("left", &E::left, text(1), "its left side")),
       required(key("right", &E::right, text(1), "its right side")),
       required(key("from", &E::from, text(1), "least value")),
       required(key("to", &E::to, text(1), "largest value"))});
  return block;
}

const Block<ClaimValues>& vary_block() {
  using V = ClaimValues;
  static const Block<V> block("vary", "values of a symbol",
                              {required(key("symbol", &V::symbol, name_text(), "which")),
                               required(key("values", &V::values, list(text(1), {.fewest = 1}),
                                            "quantities or formulas"))});
  return block;
}

const Block<ClaimTransform>& transform_block() {
  using T = ClaimTransform;
  static const Block<T> block(
      "transform", "an inverse Laplace transform",
      {required(key("variable", &T::variable, name_text(), "of the transform")),
       required(key("time", &T::time, name_text(), "of the function"))});
  return block;
}

const Block<ClaimSeries>& series_block() {
  using S = ClaimSeries;
  static const Block<S> block(
      "series", "an expression beside a column",
      {required(key("column", &S::column, name_text(), "of the table")),
       required(key("expression", &S::expression, text(1), "what it should be"))});
  return block;
}

const Block<ClaimNumber>& reported_block() {
  using N = ClaimNumber;
  static const Block<N> block("reported", "a number that the report gives",
                              {required(key("expression", &N::expression, text(1), "its value")),
                               key("unit", &N::unit, text(), "its unit")});
  return block;
}

const Block<Claim>& claim_block() {
  using C = Claim;
  static const Block<C> block(
      "claim", "something that the paper says",
      {required(key("id", &C::id, text(1), "its name, once in the file")),
       key("topic", &C::topic, text(1), "what it is about"),
       required(key("kind", &C::kind, text(1), "how it is checked")),
       where_key(&C::where),
       required(key("quote", &C::quote, text(1), "the paper's own words")),
       key("printed", &C::printed, list(text(1), {.fewest = 2, .most = 2, .one_too = true}),
           "the number, or the ends of a range, as printed"),
       key("unit", &C::unit, text(), "of the printed number"),
       key("expression", &C::expression, text(1), "what the number should be"),
       key("terms", &C::terms, list(text(1), {.fewest = 2}), "or the terms of a sum"),
       key("solve", &C::solve, equation_block().type(), "or the root of an equation"),
       key("left", &C::left, text(1), "left side of a relation"),
       key("right", &C::right, text(1), "right side of a relation"),
       key("relation", &C::relation, one_of({"<", "<=", ">", ">="}), "between the two"),
       key("vary", &C::vary, vary_block().type(), "at which the claim is examined"),
       key("over", &C::over, range_block().type(), "over which the claim is examined"),
       key("transform", &C::transform, transform_block().type(), "to be inverted"),
       key("tolerance", &C::tolerance, text(1), "relative"),
       key("tables", &C::tables, list(text(1), {.fewest = 1}), "ids of tables"),
       key("rows", &C::rows, map_of(text(1)),
           "names of columns and what they are in the rows meant"),
       key("series", &C::series, list(series_block().type(), {.fewest = 1}),
           "columns and what they should be"),
       key("band", &C::band, list(name_text(), {.fewest = 2, .most = 2}),
           "columns with the ends of a band"),
       key("relative_error", &C::relative_error, text(1), "of the comparison"),
       key("claimed_dimension", &C::claimed_dimension, text(1),
           "a unit of the dimension that is claimed"),
       key("with", &C::with, map_of(text(1)), "names and what is put in their place"),
       key("search", &C::search, list(name_text()), "symbols that may be the cause of a failure"),
       key("report", &C::report, map_of(reported_block().type()), "further numbers"),
       key("if_holds", &C::if_holds, text(1), "what follows if it holds"),
       key("if_fails", &C::if_fails, text(1), "what follows if it fails"),
       key("if_open", &C::if_open, text(1), "what follows if it is undetermined")});
  return block;
}

struct ClaimsKeys {
  std::string title, citation;
  std::vector<PrintedSymbol> symbols;
  std::vector<Definition> definitions;
  std::vector<PrintedTable> tables;
  std::vector<Claim> claims;
};

const Block<ClaimsKeys>& claims_block() {
  using K = ClaimsKeys;
  static const Block<K> block(
      "claims", "",
      {required(key("title", &K::title, text(1), "of the paper")),
       required(key("citation", &K::citation, text(1), "authors, journal, year, pages")),
       unread<K>("doi", text().form, "of the paper"),
       unread<K>("note", text().form, "what a reader has to know"),
       required(key("symbols", &K::symbols, list(symbol_block().type()), "named numbers")),
       key("definitions", &K::definitions, list(definition_block().type()), "names for formulas"),
       key("tables", &K::tables, list(table_block().type()), "printed tables"),
       required(key("claims", &K::claims, list(claim_block().type(), {.fewest = 1}),
                    "what is recomputed"))});
  return block;
}

void read_numbers(PrintedSymbol& symbol, const Evaluator& evaluator, std::string_view file) {
  const std::string at = fmt::format("{}: symbol '{}'", file, symbol.name);
  if (symbol.summary.empty()) symbol.summary = symbol.name;
  symbol.si = printed_si(symbol.value, symbol.unit, evaluator, at);
  for (PrintedAlternative& other : symbol.also) {
    other.si = printed_si(other.value, symbol.unit, evaluator, at);
  }
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
  throw unknown_word(at, fmt::format("table '{}' has no column", id), name,
                     mapped<std::string>(columns, &PrintedColumn::name));
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
  throw unknown_word(at, "unknown table", id, mapped<std::string>(tables, &PrintedTable::id));
}

std::string claim_key(const Claim& only) {
  for (const Key<Claim>& one : claim_block().keys()) {
    if (!one.form.required && !one.write(only).is_null()) return one.form.name;
  }
  throw std::logic_error("no key of a claim is written from this member");
}

std::filesystem::path paper_claims_path() {
  return share_dir() / "data" / "paper_claims.json";
}

const FileKind& claims_kind() {
  static const FileKind kind{
      "claims",
      "What a paper prints, so that it can be recomputed (tpm paper audit, tpm paper tables)",
      "Numbers are texts as printed, formulas are texts", claims_block().form()};
  return kind;
}

namespace {

ClaimsKeys read_claims_keys(const Json& written, std::string_view file) {
  ClaimsKeys keys =
      claims_block().made(checked(written, claims_kind(), file), DocumentPlace{std::string(file)});
  require_unique(
      keys.tables, [](const PrintedTable& t) { return t.id; }, fmt::format("{}: tables", file));
  for (const PrintedTable& table : keys.tables) {
    const std::string at = fmt::format("{}: table '{}'", file, table.id);
    for (const auto& row : table.rows) {
      for (const std::string& cell : row) static_cast<void>(parse_printed(cell, at));
    }
  }
  return keys;
}

}  // namespace

std::vector<PrintedTable> read_printed_tables(const Json& document, std::string_view file) {
  return read_claims_keys(document, file).tables;
}

ClaimSet read_claims(const Json& written, std::string_view file) {
  ClaimsKeys keys = read_claims_keys(written, file);
  ClaimSet set;
  set.file = std::string(file);
  set.title = std::move(keys.title);
  set.symbols = std::move(keys.symbols);
  for (PrintedSymbol& symbol : set.symbols) {
    read_numbers(symbol, set.evaluator, file);
    set.evaluator.define_symbol(symbol.name, symbol.si, file);
  }
  for (const Definition& definition : keys.definitions) {
    set.evaluator.define_expression(definition.name, definition.expression,
                                    fmt::format("{}: definition '{}'", file, definition.name));
  }
  set.tables = std::move(keys.tables);
  set.claims = std::move(keys.claims);
  require_unique(
      set.claims, [](const Claim& c) { return c.id; }, fmt::format("{}: claims", file));
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
