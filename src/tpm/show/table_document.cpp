#include "tpm/show/table_document.hpp"

#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"

namespace tpm::show {
namespace {

/// Columns a terminal needs; our texts have no wide or combining characters.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(utf8::unchecked::distance(text.begin(), text.end()));
}

std::string padded(const std::string& cell, std::size_t width, bool right) {
  const std::size_t own = width_of(cell);
  const std::string space(width > own ? width - own : 0, ' ');
  return right ? space + cell : cell + space;
}

bool is_right(const std::vector<bool>& right, std::size_t column) {
  return column < right.size() && right[column];
}

std::vector<std::size_t> column_widths(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width_of(row[c]));
  }
  return widths;
}

std::string text_section(const TableSection& section) {
  std::vector<std::vector<std::string>> rows{section.columns};
  rows.insert(rows.end(), section.rows.begin(), section.rows.end());
  const auto widths = column_widths(rows);
  const std::size_t total = std::accumulate(widths.begin(), widths.end(), 2 * (widths.size() - 1));
  std::string lines = aligned(rows, section.right_aligned);
  lines.insert(lines.find('\n') + 1, std::string(total, '-') + "\n");
  return section.title + "\n" + lines + "\n";
}

std::string escaped(std::string_view text, TableStyle style) {
  std::string out;
  for (const char c : text) {
    if (style == TableStyle::markdown && (c == '|' || c == '*' || c == '_')) out += '\\';
    if (style == TableStyle::latex && std::string_view("&%$#_{}").find(c) != std::string::npos) {
      out += '\\';
    }
    if (style == TableStyle::latex && (c == '^' || c == '~' || c == '\\')) {
      out += c == '^'   ? "\\textasciicircum{}"
             : c == '~' ? "\\textasciitilde{}"
                        : "\\textbackslash{}";
      continue;
    }
    out += c;
  }
  return out;
}

std::string joined(const std::vector<std::string>& cells, std::string_view separator,
                   TableStyle style) {
  std::string line;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (c > 0) line += separator;
    line += escaped(cells[c], style);
  }
  return line;
}

std::string markdown_section(const TableSection& section) {
  std::string out = fmt::format("### {}\n\n| {} |\n|", escaped(section.title, TableStyle::markdown),
                                joined(section.columns, " | ", TableStyle::markdown));
  for (std::size_t c = 0; c < section.columns.size(); ++c) {
    out += is_right(section.right_aligned, c) ? " ---: |" : " --- |";
  }
  out += "\n";
  for (const auto& row : section.rows) {
    out += fmt::format("| {} |\n", joined(row, " | ", TableStyle::markdown));
  }
  return out + "\n";
}

std::string latex_section(const TableSection& section) {
  std::string alignment;
  for (std::size_t c = 0; c < section.columns.size(); ++c) {
    alignment += is_right(section.right_aligned, c) ? 'r' : 'l';
  }
  std::string out = fmt::format(
      "\\begin{{table}}\n\\caption{{{}}}\n\\begin{{tabular}}{{{}}}\n\\toprule\n{} "
      "\\\\\n\\midrule\n",
      escaped(section.title, TableStyle::latex), alignment,
      joined(section.columns, " & ", TableStyle::latex));
  for (const auto& row : section.rows) {
    out += joined(row, " & ", TableStyle::latex) + " \\\\\n";
  }
  return out + "\\bottomrule\n\\end{tabular}\n\\end{table}\n\n";
}

std::string remarks(const std::vector<std::string>& lines, TableStyle style) {
  std::string out;
  for (const std::string& line : lines) {
    out += style == TableStyle::text ? wrapped(line, 100, 2) : escaped(line, style);
    out += style == TableStyle::text ? "\n" : "\n\n";
  }
  if (style == TableStyle::text && !lines.empty()) out += "\n";
  return out;
}

std::string heading(const std::string& title, TableStyle style) {
  switch (style) {
    case TableStyle::text:
      return title + "\n\n";
    case TableStyle::markdown:
      return fmt::format("## {}\n\n", escaped(title, style));
    case TableStyle::latex:
      return fmt::format("% {}; needs \\usepackage{{booktabs}}\n", title);
  }
  return {};
}

}  // namespace

std::string render(const TableDocument& document, TableStyle style) {
  std::string out = heading(document.title, style) + remarks(document.introduction, style);
  for (const TableSection& section : document.sections) {
    switch (style) {
      case TableStyle::text:
        out += text_section(section);
        break;
      case TableStyle::markdown:
        out += markdown_section(section);
        break;
      case TableStyle::latex:
        out += latex_section(section);
        break;
    }
  }
  out += remarks(document.conclusion, style);
  while (out.ends_with("\n\n")) out.pop_back();
  return out;
}

std::string aligned(const std::vector<std::vector<std::string>>& rows,
                    const std::vector<bool>& right) {
  const auto widths = column_widths(rows);
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (c > 0) line += "  ";
      line += padded(row[c], widths[c], is_right(right, c));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (c > 0) line += ',';
    if (cells[c].find_first_of(",\"\r\n") == std::string::npos) {
      line += cells[c];
      continue;
    }
    line += '"';
    for (const char letter : cells[c])
      line += letter == '"' ? std::string("\"\"") : std::string(1, letter);
    line += '"';
  }
  return line + "\n";
}

std::string numbers_csv(const NumberColumns& columns, int digits) {
  std::vector<std::string> cells;
  for (const auto& column : columns) cells.push_back(column.first);
  std::string text = csv_line(cells);
  for (std::size_t row = 0; row < columns.front().second.size(); ++row) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double number = columns[c].second[row];
      cells[c] = std::isfinite(number) ? significant(number, digits) : "";
    }
    text += csv_line(cells);
  }
  return text;
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent,
                    std::size_t column) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!out.empty() && column + 1 + width_of(word) > width) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!out.empty()) {
      out += ' ';
      ++column;
    }
    out += word;
    column += width_of(word);
  }
  return out;
}

}  // namespace tpm::show
