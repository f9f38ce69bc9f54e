#include "tpm/show/document.hpp"

#include <algorithm>
#include <array>
#include <regex>
#include <string_view>
#include <utility>

namespace tpm::show {

namespace {

std::string superscript(const std::string& digits) {
  constexpr std::array<std::string_view, 10> kDigits{"⁰", "¹", "²", "³", "⁴",
                                                     "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out;
  for (const char c : digits) out += kDigits[static_cast<std::size_t>(c - '0')];
  return out;
}

/// 2.6e+05 -> 2.6·10⁵
std::string with_powers_of_ten(const std::string& text) {
  static const std::regex exponent("([0-9])e([+-])0*([0-9]+)");
  std::string out;
  auto rest = text.cbegin();
  std::smatch found;
  while (std::regex_search(rest, text.cend(), found, exponent)) {
    out.append(rest, found[0].first);
    out +=
        found[1].str() + "·10" + (found[2].str() == "-" ? "⁻" : "") + superscript(found[3].str());
    rest = found[0].second;
  }
  return out.append(rest, text.cend());
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

/// Only what stands outside backticks.
void typeset(std::string& text) {
  std::string out;
  bool code = false;
  for (std::size_t start = 0; start <= text.size();) {
    const auto end = std::min(text.find('`', start), text.size());
    std::string part = text.substr(start, end - start);
    if (!code) {
      part = with_powers_of_ten(part);
      replace_all(part, "eta1", "η₁");
      replace_all(part, "lambda1", "λ₁");
    }
    out += part;
    if (end < text.size()) out += '`';
    code = !code;
    start = end + 1;
  }
  text = std::move(out);
}

struct Typesetting {
  void operator()(Heading& heading) const { typeset(heading.text); }
  void operator()(Paragraph& paragraph) const { typeset(paragraph.text); }
  void operator()(Bullets& bullets) const {
    for (Cell& item : bullets.items) typeset(item.text);
  }
  void operator()(Table& table) const {
    typeset(table.caption);
    for (Column& column : table.columns) typeset(column.title);
    for (auto& row : table.rows) {
      for (Cell& cell : row) typeset(cell.text);
    }
  }
  void operator()(Picture& picture) const {
    typeset(picture.title);
    typeset(picture.caption);
  }
};

}  // namespace

void typeset(Document& document) {
  for (DocumentPart& block : document.blocks) std::visit(Typesetting{}, block);
}

void Document::heading(int level, std::string text) {
  blocks.emplace_back(Heading{level, std::move(text)});
}

void Document::paragraph(std::string text) {
  blocks.emplace_back(Paragraph{std::move(text)});
}

void Document::bullets(std::vector<Cell> items) {
  blocks.emplace_back(Bullets{std::move(items)});
}

void Document::table(Table table) {
  blocks.emplace_back(std::move(table));
}

void Document::picture(Picture picture) {
  blocks.emplace_back(std::move(picture));
}

}  // namespace tpm::show
