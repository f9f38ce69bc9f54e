#include "tpm/paper/claims/claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

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
       key("words", &S::words, text(1), "what people call it, such as load; the name if left out"),
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

/// A claim as it stands in the file: its kind, which audit_kinds.cpp lists, says which keys it
/// needs, and ClaimReader reads them.
FormPtr claim_form() {
  const FormPtr some = text(1).form, name = name_text().form;
  const FormPtr printed = either_form({some, list_form(some, 2, 2)});
  const FormPtr from_to_of_symbol = object_form(
      "range_of_symbol", "a range of a symbol",
      {required_key("symbol", name, "which"), required_key("from", some, "its first value"),
       required_key("to", some, "its last value")});
  const FormPtr equation = object_form(
      "equation", "an equation of one unknown",
      {required_key("unknown", name, "what is looked for"),
       required_key("left", some, "its left side"), required_key("right", some, "its right side"),
       required_key("from", some, "least value"), required_key("to", some, "largest value")});
  const FormPtr vary =
      object_form("vary", "values of a symbol",
                  {required_key("symbol", name, "which"),
                   required_key("values", list_form(some, 1), "quantities or formulas")});
  const FormPtr transform = object_form("transform", "an inverse Laplace transform",
                                        {required_key("variable", name, "of the transform"),
                                         required_key("time", name, "of the function")});
  const FormPtr series = object_form("series", "an expression beside a column",
                                     {required_key("column", name, "of the table"),
                                      required_key("expression", some, "what it should be")});
  const FormPtr reported = object_form("reported", "a number that the report gives",
                                       {required_key("expression", some, "its value"),
                                        optional_key("unit", text().form, "its unit")});
  return object_form(
      "claim", "something that the paper says",
      {required_key("id", some, "its name, once in the file"),
       optional_key("topic", some, "what it is about"),
       required_key("kind", some, "how it is checked"),
       required_key("where", some, "where the paper says so"),
       required_key("quote", some, "the paper's own words"),
       optional_key("printed", printed, "the number, or the ends of a range, as printed"),
       optional_key("unit", text().form, "of the printed number"),
       optional_key("expression", some, "what the number should be"),
       optional_key("terms", list_form(some, 2), "or the terms of a sum"),
       optional_key("solve", equation, "or the root of an equation"),
       optional_key("left", some, "left side of a relation"),
       optional_key("right", some, "right side of a relation"),
       optional_key("relation", one_of({"<", "<=", ">", ">="}).form, "between the two"),
       optional_key("vary", vary, "at which the claim is examined"),
       optional_key("over", from_to_of_symbol, "over which the claim is examined"),
       optional_key("transform", transform, "to be inverted"),
       optional_key("tolerance", some, "relative"),
       optional_key("tables", list_form(some, 1), "ids of tables"),
       optional_key("rows", map_form(some), "names of columns and what they are in the rows meant"),
       optional_key("series", list_form(series, 1), "columns and what they should be"),
       optional_key("band", list_form(name, 2, 2), "columns with the ends of a band"),
       optional_key("relative_error", some, "of the comparison"),
       optional_key("claimed_dimension", some, "a unit of the dimension that is claimed"),
       optional_key("with", map_form(some), "names and what is put in their place"),
       optional_key("search", list_form(name, 0), "symbols that may be the cause of a failure"),
       optional_key("report", map_form(reported), "further numbers"),
       optional_key("if_holds", some, "what follows if it holds"),
       optional_key("if_fails", some, "what follows if it fails"),
       optional_key("if_open", some, "what follows if it is undetermined")});
}

struct ClaimsKeys {
  std::string title, citation;
  std::vector<PrintedSymbol> symbols;
  std::vector<Definition> definitions;
  std::vector<PrintedTable> tables;
  Json claims;
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
       required(
           key("claims", &K::claims, as_json(list_form(claim_form(), 1)), "what is recomputed"))});
  return block;
}

void read_numbers(PrintedSymbol& symbol, const Evaluator& evaluator, std::string_view file) {
  const std::string at = fmt::format("{}: symbol '{}'", file, symbol.name);
  if (symbol.words.empty()) symbol.words = symbol.name;
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
