#include "tpm/files/import/machine_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/import/column_title.hpp"
#include "tpm/files/import/header_comments.hpp"
#include "tpm/files/import/machine_columns.hpp"
#include "tpm/files/unit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {

std::string MachineColumn::label() const {
  return name.empty() ? fmt::format("column {}", index + 1)
                      : fmt::format("column {} '{}'", index + 1, printable(name));
}

bool MachineColumn::is_named(std::string_view selector) const {
  return selector == name || selector == title || has_number(selector);
}

bool MachineColumn::has_number(std::string_view selector) const {
  constexpr std::string_view kWord = "column ";
  if (selector.starts_with(kWord)) selector.remove_prefix(kWord.size());
  return selector == std::to_string(index + 1);
}

namespace {

/// A row above the samples, from the table or from a comment.
struct HeaderRow {
  int line = 0;
  std::vector<std::string> cells;
  bool comment = false;
};

bool is_bracketed(std::string_view cell) {
  return without_brackets(cell).size() < cell.size();
}

/// A row of units: all cells are units or stand in brackets, or at least half of them are units and
/// none is a title. A cell that is no unit is refused by whoever reads its column.
bool is_unit_row(const HeaderRow& row) {
  std::size_t filled = 0, units = 0, brackets = 0, titles = 0;
  for (const std::string& field : row.cells) {
    if (field.empty() || field == "-") continue;
    ++filled;
    const std::string cell = written_unit(without_brackets(field));
    const bool number = cell.find_first_not_of("0123456789") == std::string_view::npos;
    const bool capitals =
        cell.size() > 1 && !units_in_any_case(cell, [](Dimension) { return true; }).empty();
    const bool unit = (is_unit(cell) || capitals) && !number;
    if (unit) ++units;
    if (is_bracketed(field)) ++brackets;
    if (!unit && recognize_title(split_title(field).name)) ++titles;
  }
  if (filled == 0) return false;
  return units == filled || brackets == filled || (2 * units >= filled && titles == 0);
}

bool is_blank(const HeaderRow& row) {
  return std::all_of(row.cells.begin(), row.cells.end(),
                     [](const std::string& cell) { return cell.empty(); });
}

std::size_t recognized_titles(const HeaderRow& row) {
  return static_cast<std::size_t>(
      std::count_if(row.cells.begin(), row.cells.end(), [](const std::string& cell) {
        const std::string name = split_title(cell).name;
        return recognize_title(name).has_value() || refused_title(name).has_value();
      }));
}

std::string cell_or_empty(const HeaderRow* row, std::size_t index) {
  return row != nullptr && index < row->cells.size() ? row->cells[index] : std::string();
}

/// A row above the titles that repeats one text names the sheet.
std::string sheet_name(const HeaderRow& row) {
  std::string name;
  for (const std::string& cell : row.cells) {
    if (cell.empty()) continue;
    const bool mark = cell.front() == '<';  // <DATA>
    if (mark || (!name.empty() && cell != name)) return {};
    name = cell;
  }
  return name;
}

/// Units given by name or number go before those of the file.
std::string chosen_unit(const MachineColumn& column, const ImportOptions& options) {
  for (const auto& [selector, unit] : options.units) {
    if (column.is_named(selector)) return unit;
  }
  return column.unit;
}

/// Where titles and units stand; null if nowhere.
struct HeaderRows {
  const HeaderRow* titles = nullptr;
  const HeaderRow* units = nullptr;
};

/// Units and titles stand in any order, with blank rows and rows of other things between them.
/// Titles are the row with the most names that are known; of several, the one nearest to the
/// samples.
HeaderRows header_rows(const std::vector<HeaderRow>& rows) {
  HeaderRows found;
  std::size_t most = 0;
  for (std::size_t i = rows.size(); i-- > 0;) {
    const HeaderRow& row = rows[i];
    if (is_blank(row)) continue;
    if (is_unit_row(row)) {
      if (found.units == nullptr) found.units = &row;
      continue;
    }
    const std::size_t names = recognized_titles(row);
    if ((found.titles != nullptr || row.comment) && names <= most) continue;
    found.titles = &row;
    most = names;
  }
  return found;
}

/// Titles between blanks hold blanks themselves: units in brackets belong to the word before them,
/// and where titles stand two blanks apart, words one blank apart belong together.
std::vector<std::string> blank_separated_titles(std::span<const std::string_view> fields,
                                                std::size_t width) {
  const std::vector<std::string> as_they_stand{fields.begin(), fields.end()};
  const auto is_bracket = [](std::string_view field) {
    return field.starts_with('[') || field.starts_with('(');
  };
  const auto brackets = std::count_if(fields.begin(), fields.end(), is_bracket);
  const bool alike = brackets == 0 || static_cast<std::size_t>(brackets) == fields.size();
  if (fields.size() == width && alike) return as_they_stand;
  std::vector<std::string> words;
  std::vector<std::string> spaced;
  const char* end = nullptr;
  for (const std::string_view field : fields) {
    const bool mark = field == "#" || field == "%" || field == "//";
    if (words.empty() && mark) continue;
    const bool bracket = is_bracket(field);
    if (bracket && !words.empty()) {
      words.back() += fmt::format(" {}", field);
    } else {
      words.emplace_back(field);
    }
    const bool near = end != nullptr && field.data() == end + 1;
    if (near && !spaced.empty()) {
      spaced.back() += fmt::format(" {}", field);
    } else {
      spaced.emplace_back(field);
    }
    end = field.data() + field.size();
  }
  if (words.size() == width) return words;
  return spaced.size() == width ? spaced : std::vector<std::string>();
}

std::vector<std::string> title_cells(const DelimitedTable& table,
                                     std::span<const std::string_view> fields, std::size_t width) {
  if (table.separator == ' ' && fields.size() != 1) return blank_separated_titles(fields, width);
  return {fields.begin(), fields.end()};
}

/// The cells of a comment, whose marks may be others than those between the numbers.
std::vector<std::string> comment_cells(const DelimitedTable& table, std::string_view text,
                                       std::size_t width) {
  text = without_label(text);
  for (const char separator : {',', ';', '\t'}) {
    std::vector<std::string> cells;
    for (const std::string_view field : cut_comment(text, separator)) {
      cells.emplace_back(trimmed(field));
    }
    const bool filled =
        std::ranges::none_of(cells, [](const std::string& cell) { return cell.empty(); });
    if (width > 1 && cells.size() == width && filled) return cells;
  }
  return title_cells(table, cut_comment(text, table.separator), width);
}

/// Titles that comments number one by one, each column once; none otherwise.
std::optional<HeaderRow> numbered_titles(const std::vector<std::pair<int, std::string>>& comments,
                                         std::size_t width) {
  HeaderRow row{0, std::vector<std::string>(width), true};
  std::size_t found = 0;
  for (const auto& [line, text] : comments) {
    const auto one = numbered_title(text);
    if (!one || one->number == 0 || one->number > width) continue;
    std::string& cell = row.cells[one->number - 1];
    if (!cell.empty()) return std::nullopt;
    cell = one->title;
    row.line = line;
    ++found;
  }
  return found == width ? std::optional(std::move(row)) : std::nullopt;
}

std::string joined_fields(const DelimitedTable& table, const DelimitedRow& row) {
  return fmt::format("{}", fmt::join(row.fields, std::string(1, table.separator)));
}

/// The rows above a block, comments of the file among them, in the order of their lines.
std::vector<HeaderRow> rows_above(const DelimitedTable& table, const SampleBlock& block) {
  std::vector<HeaderRow> rows;
  std::vector<std::pair<int, std::string>> comments;
  for (std::size_t i = block.header_first; i < block.first; ++i) {
    const DelimitedRow& row = table.rows[i];
    HeaderRow read{row.line, title_cells(table, row.fields, block.width)};
    const std::string text = joined_fields(table, row);
    const auto comment = behind_comment_mark(text, table.separator);
    // "% kPa" may be the units of a strain and a stress.
    if (comment && !is_unit_row(read)) {
      comments.emplace_back(row.line, *comment);
      continue;
    }
    rows.push_back(std::move(read));
  }
  const int from = block.header_first == 0 ? 0 : table.rows[block.header_first - 1].line;
  const int to = table.rows[block.first].line;
  for (const DelimitedComment& comment : table.comments) {
    if (comment.line < from || comment.line > to) continue;
    const auto begin = comment.text.find_first_not_of("# \t");
    if (begin != std::string::npos) {
      comments.emplace_back(comment.line, comment.text.substr(begin));
    }
  }
  for (const auto& [line, text] : comments) {
    rows.push_back({line, comment_cells(table, text, block.width), true});
  }
  if (auto titles = numbered_titles(comments, block.width)) rows.push_back(*std::move(titles));
  std::stable_sort(rows.begin(), rows.end(),
                   [](const HeaderRow& a, const HeaderRow& b) { return a.line < b.line; });
  return rows;
}

/// True for two units of one dimension and unlike sizes: a title and the row below it say each its
/// own, and nothing tells which was written by whoever chose the numbers.
bool disagree(const std::string& of_title, const std::string& of_row) {
  if (of_title == of_row || !is_unit(of_title) || !is_unit(of_row)) return false;
  const Unit one = parse_unit(of_title, {}), other = parse_unit(of_row, {});
  return one.dimension == other.dimension && one.to_si != other.to_si;
}

MachineColumn described_column(std::size_t index, const HeaderRows& rows,
                               const ImportOptions& options) {
  const ColumnTitle title = split_title(cell_or_empty(rows.titles, index));
  const std::string cell = cell_or_empty(rows.units, index);
  const std::string unit = written_unit(without_brackets(cell));
  MachineColumn column{
      index, title.name, unit.empty() ? title.unit : unit, recognize_title(title.name), {}, false,
      false, {}};
  column.title = trimmed(cell_or_empty(rows.titles, index));
  column.refused = refused_title(title.name);
  const std::string chosen = chosen_unit(column, options);
  column.unit_is_chosen = chosen != column.unit;
  for (const auto& [selector, said] : options.units) {
    column.unit_is_chosen |= column.is_named(selector);
  }
  column.unit = written_unit(chosen);
  if (!column.unit_is_chosen && disagree(title.unit, unit)) {
    column.unit_readings = {title.unit, unit};
  }
  const bool per_second = is_unit(column.unit) && parse_unit(column.unit, {}).symbol == "Hz" &&
                          column.unit.find("Hz") == std::string::npos;
  if (per_second && is_angular(column.name)) column.unit = "rad/s";
  doubt_capital_t(column);
  return column;
}

/// Two or more columns of logarithms are no measured quantities. "Log time" alone may be the time
/// of a log.
void take_meaning_of_logarithms(std::vector<MachineColumn>& columns) {
  const auto is_log = [](const MachineColumn& column) { return is_logarithm(column.title); };
  if (std::ranges::count_if(columns, is_log) < 2) return;
  for (MachineColumn& column : columns) {
    if (is_log(column)) column.meaning.reset();
  }
}

/// Describes the columns of a block by the rows above it.
void describe_columns(const DelimitedTable& table, const SampleBlock& block, MachineHeader& header,
                      const ImportOptions& options) {
  const std::vector<HeaderRow> above = rows_above(table, block);
  const HeaderRows rows = header_rows(above);
  header.columns.clear();
  header.sheet.clear();
  for (std::size_t i = above.size(); i-- > 0 && header.sheet.empty();) {
    const bool other = &above[i] != rows.units && &above[i] != rows.titles && !above[i].comment;
    if (other) header.sheet = sheet_name(above[i]);
  }
  for (std::size_t i = 0; i < block.width; ++i) {
    header.columns.push_back(described_column(i, rows, options));
  }
  const bool timed =
      std::any_of(header.columns.begin(), header.columns.end(), [](const MachineColumn& column) {
        return column.meaning && column.meaning->role == ColumnRole::time;
      });
  for (MachineColumn& column : header.columns) {
    recognize_by_unit(column, timed);
    read_capitals_of_unit(column);
    doubt_unit(column);
  }
  recognize_lone_columns(header.columns);
  take_meaning_of_logarithms(header.columns);
  header.rows = block.first;
  header.block = block;
}

/// True if the titles tell a recording or a spectrum.
bool is_understood(const MachineHeader& header) {
  const auto has = [&header](std::initializer_list<ColumnRole> roles) {
    return std::any_of(header.columns.begin(), header.columns.end(), [&](const MachineColumn& c) {
      return c.meaning && std::find(roles.begin(), roles.end(), c.meaning->role) != roles.end();
    });
  };
  const bool imposed = has({ColumnRole::time, ColumnRole::drive, ColumnRole::height});
  const bool observed = has({ColumnRole::response, ColumnRole::deflection});
  return (imposed && observed) ||
         (has({ColumnRole::frequency}) &&
          has({ColumnRole::storage, ColumnRole::loss, ColumnRole::magnitude}));
}

std::vector<std::string> title_texts(const MachineHeader& header) {
  std::vector<std::string> titles;
  for (const MachineColumn& column : header.columns) titles.push_back(column.name);
  return titles;
}

std::string block_list(const DelimitedTable& table, const std::vector<SampleBlock>& blocks) {
  std::string list;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    list += fmt::format("{}{} ({})", list.empty() ? "" : ", ", i + 1,
                        lines_of(table, blocks[i].first, blocks[i].end));
  }
  return list;
}

/// The blocks that may hold the recording: those of at least a tenth of the longest one's rows.
std::vector<SampleBlock> large_blocks(const std::vector<SampleBlock>& blocks) {
  constexpr std::size_t kPart = 10, kLeast = 3;
  std::size_t longest = 0;
  for (const SampleBlock& block : blocks) longest = std::max(longest, block.size());
  std::vector<SampleBlock> large;
  for (const SampleBlock& block : blocks) {
    const bool enough = block.size() >= kLeast && kPart * block.size() >= longest;
    if (enough || block.size() == longest) large.push_back(block);
  }
  return large;
}

SampleBlock chosen_block(const DelimitedTable& table, const std::string& file,
                         const ImportOptions& options, const std::vector<SampleBlock>& all,
                         MachineHeader& header) {
  if (all.empty()) {
    require_one_number_a_cell(table, file);
    throw bad_input(
        file,
        fmt::format("no row with two or more numbers between {} separators",
                    separator_name(table.separator)),
        "samples, or --separator and --decimal (comma, semicolon, tab or blank; point or comma)");
  }
  const std::vector<SampleBlock> blocks = large_blocks(all);
  if (options.block) {
    const auto number = static_cast<std::size_t>(*options.block);
    if (number >= 1 && number <= blocks.size()) return blocks[number - 1];
    throw bad_input(file, fmt::format("no block {} of samples", *options.block),
                    fmt::format("--block with one of {}", block_list(table, blocks)));
  }
  if (blocks.size() == 1) return blocks.front();
  std::vector<SampleBlock> understood;
  for (const SampleBlock& block : blocks) {
    describe_columns(table, block, header, options);
    // A block without titles under one of its width may go on with it.
    const bool goes_on = !understood.empty() && block.width == understood.back().width &&
                         recognized_titles({0, title_texts(header)}) == 0;
    if (goes_on || is_understood(header)) understood.push_back(block);
  }
  if (understood.size() == 1) return understood.front();
  throw bad_input(file, fmt::format("holds {} blocks of samples", blocks.size()),
                  fmt::format("--block with one of {}", block_list(table, blocks)));
}

/// Other rows of numbers, and rows below the samples.
void tell_unread_rows(const DelimitedTable& table, const std::vector<SampleBlock>& all,
                      MachineHeader& header) {
  for (const SampleBlock& block : all) {
    if (block.size() < 2 || block.first == header.block.first) continue;
    if (block.end > header.block.first && block.first < header.block.end) continue;
    header.findings.push_back(ImportFinding::told_of(
        "not read",
        fmt::format("{}, another block of samples", lines_of(table, block.first, block.end))));
  }
  std::size_t end = header.block.end;
  while (end < table.rows.size() && table.rows[end].fields.size() > 1) ++end;
  const std::size_t below = std::min(end, table.rows.size());
  const bool numbers =
      below > header.block.end && is_number_in_some_style(field_at(table.rows[below - 1], 1));
  if (numbers) {
    header.findings.push_back(ImportFinding::told_of(
        "not read",
        fmt::format("{}, below the samples", lines_of(table, header.block.end, below))));
  }
}

/// A decimal comma beside a separating comma doubles the fields of each row.
void require_titles_for_fields(const DelimitedTable& table, const MachineHeader& header,
                               const std::string& file) {
  if (table.separator != ',') return;
  std::size_t titles = 0;
  for (const HeaderRow& row : rows_above(table, header.block)) {
    if (recognized_titles(row) == 0) continue;
    std::size_t width = row.cells.size();
    while (width > 0 && row.cells[width - 1].empty()) --width;
    titles = std::max(titles, width);
  }
  const DelimitedRow& first = table.rows[header.block.first];
  std::size_t filled = first.fields.size();
  while (filled > 0 && first.fields[filled - 1].empty()) --filled;
  if (titles == 0 || titles >= filled) return;
  throw bad_input(
      fmt::format("{}:{}", file, first.line),
      fmt::format("{} fields below {} titles: commas in numbers look like separators", filled,
                  titles),
      "another separator than the comma, numbers in quotes, or a title for each column");
}

/// Refuses a table whose quantities stand there as logarithms only, unless columns are chosen.
void require_no_logarithms(const MachineHeader& header, const std::string& file,
                           const ImportOptions& options) {
  const bool chosen = std::ranges::any_of(
      std::to_array({&options.time_column, &options.drive_column, &options.response_column,
                     &options.frequency_column, &options.storage_column, &options.loss_column}),
      [](const std::string* selector) { return !selector->empty(); });
  if (chosen || is_understood(header)) return;
  std::string logarithms;
  std::size_t count = 0;
  for (const MachineColumn& column : header.columns) {
    if (!is_logarithm(column.title)) continue;
    logarithms += fmt::format("{}{}", count == 0 ? "" : ", ", column.label());
    ++count;
  }
  if (count < 2) return;
  throw bad_input(file, fmt::format("{}: logarithms, by their titles", printable(logarithms, 200)),
                  "the quantities themselves (10 to the power of each number, or e for ln), with "
                  "their units in the titles, such as 'omega (rad/s)' and 'G' (Pa)'");
}

NumberStyle style_of(const DelimitedTable& table, const MachineHeader& header,
                     const std::string& file, const ImportOptions& options) {
  std::vector<StyledColumn> columns;
  columns.reserve(header.columns.size());
  const DelimitedRow* first = table.rows.data() + header.block.first;
  for (const MachineColumn& column : header.columns) {
    columns.push_back({column.label(), first, header.block.size(), column.index});
  }
  return find_number_style(columns, {options.text.decimal_comma, options.text.thousands}, file);
}

}  // namespace

MachineHeader read_machine_header(const DelimitedTable& table, const std::string& file,
                                  const ImportOptions& options) {
  MachineHeader header;
  SampleBlock block;
  std::vector<SampleBlock> all;
  if (options.header_rows) {
    const auto rows = static_cast<std::size_t>(*options.header_rows);
    if (rows >= table.rows.size()) {
      throw bad_input(file, fmt::format("{} header rows but only {} rows", rows, table.rows.size()),
                      "samples below the header");
    }
    block = block_below(table, rows);
  } else {
    all = find_sample_blocks(table);
    block = chosen_block(table, file, options, all, header);
  }
  describe_columns(table, block, header, options);
  require_no_logarithms(header, file, options);
  require_titles_for_fields(table, header, file);
  tell_unread_rows(table, all, header);
  header.style = style_of(table, header, file, options);
  return header;
}

}  // namespace tpm::files
