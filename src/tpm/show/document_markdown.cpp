// Declared in tpm/show/document.hpp.
#include <fmt/format.h>

#include "tpm/show/document.hpp"

namespace tpm::show {
namespace {

/// Outside code, characters that Markdown would read as markup are escaped.
std::string markdown_escaped(const std::string& text, bool in_table = false) {
  std::string out;
  bool code = false;
  for (const char c : text) {
    if (c == '`') code = !code;
    const bool special = !code && (c == '*' || c == '<' || c == '[' || c == '\\');
    if (special || (in_table && c == '|')) out += '\\';
    out += c;
  }
  return out;
}

std::string row_text(const std::vector<std::string>& cells) {
  return fmt::format("| {} |\n", fmt::join(cells, " | "));
}

/// Renders one block; a Markdown block ends with an empty line.
struct MarkdownBlock {
  std::string operator()(const Heading& heading) const {
    return fmt::format("{} {}\n\n", std::string(static_cast<std::size_t>(heading.level), '#'),
                       markdown_escaped(heading.text));
  }

  std::string operator()(const Paragraph& paragraph) const {
    return markdown_escaped(paragraph.text) + "\n\n";
  }

  std::string operator()(const Bullets& bullets) const {
    std::string out;
    for (const Cell& item : bullets.items)
      out += fmt::format("- {}\n", markdown_escaped(item.text));
    return out + "\n";
  }

  std::string operator()(const Table& table) const {
    std::vector<std::string> titles;
    std::vector<std::string> rule;
    for (const Column& column : table.columns) {
      titles.push_back(markdown_escaped(column.title, true));
      rule.emplace_back(column.numeric ? "---:" : "---");
    }
    std::string out = row_text(titles) + row_text(rule);
    for (const auto& row : table.rows) {
      std::vector<std::string> cells;
      cells.reserve(row.size());
      for (const Cell& cell : row) cells.push_back(markdown_escaped(cell.text, true));
      out += row_text(cells);
    }
    if (table.caption.empty()) return out + "\n";
    return fmt::format("{}\n\n{}\n", markdown_escaped(table.caption), out);
  }

  std::string operator()(const Picture& picture) const {
    const std::string title = markdown_escaped(picture.title);
    const std::string image = fmt::format("![{}](figures/{}.svg)\n\n", title, picture.id);
    if (picture.caption.empty()) return image;
    return fmt::format("**{}.** {}\n\n{}", title, markdown_escaped(picture.caption), image);
  }
};

}  // namespace

std::string to_markdown(const Document& document) {
  std::string out = fmt::format("# {}\n\n{}\n\n", markdown_escaped(document.title),
                                markdown_escaped(document.subtitle));
  for (const DocumentPart& block : document.blocks) out += std::visit(MarkdownBlock{}, block);
  out.pop_back();  // one line feed at the end, not two
  return out;
}

}  // namespace tpm::show
