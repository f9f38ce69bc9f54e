// Declared in tpm/show/document.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/show/document.hpp"
#include "tpmkit/error.hpp"

namespace tpm::show {
namespace {

constexpr std::string_view kStyle = R"css(
:root { --ink: #1d2329; --soft: #57606a; --rule: #d8dee4; --tint: #f6f8fa; --link: #0059a6; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 60rem; color: var(--ink);
       background: #fff; font: 1rem/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; overflow-wrap: break-word; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .3rem; }
h2 { font-size: 1.3rem; margin: 2.6rem 0 .6rem; padding-top: .8rem; border-top: 1px solid var(--rule); }
h3 { font-size: 1.05rem; margin: 1.8rem 0 .4rem; }
p, ul { margin: .6rem 0; max-width: 46rem; }
li { margin: .25rem 0; }
a { color: var(--link); }
code { font: .9em/1.4 "DejaVu Sans Mono", ui-monospace, monospace; background: var(--tint); padding: 0 .25em; }
.subtitle { color: var(--soft); }
nav { margin: 1rem 0; padding: .6rem 1rem; background: var(--tint); border-radius: .4rem; }
nav a { display: inline-block; margin-right: 1.1rem; max-width: 100%; }
.wide { overflow-x: auto; margin: .8rem 0 1.2rem; }
table { border-collapse: collapse; font-size: .9rem; }
caption { text-align: left; color: var(--soft); padding-bottom: .35rem; }
th, td { padding: .3rem .7rem; border-bottom: 1px solid var(--rule); text-align: left; vertical-align: top;
         min-width: 3.2rem; }
th { background: var(--tint); }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.long { min-width: 15rem; }
.good { color: #0b5d2a; } td.good { background: #e9f6ec; }
.fair { color: #6b4a00; } td.fair { background: #fdf3dc; }
.bad { color: #93200f; } td.bad { background: #fdebe7; }
figure { margin: 1.2rem 0 1.8rem; }
figure svg { display: block; max-width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: .92rem; max-width: 46rem; }
figcaption b { color: var(--ink); }
@media print {
  body { max-width: none; padding: 0; font-size: 9.5pt; }
  nav { display: none; }
  h2 { break-after: avoid; } h3 { break-after: avoid; }
  figure, tr { break-inside: avoid; }
  .wide { overflow: visible; }
}
)css";

// Added where a table stacks.
constexpr std::string_view kStackingStyle =
    R"css(table.stacks th, table.stacks td { padding: .3rem .5rem; }
@media (max-width: 45rem) {
  table.stacks, table.stacks tbody, table.stacks caption { display: block; }
  table.stacks caption { overflow-wrap: anywhere; }
  table.stacks thead { display: none; }
  table.stacks tr { display: block; padding: .4rem 0; border-bottom: 1px solid var(--rule); }
  table.stacks td { display: flex; justify-content: space-between; gap: 1rem; border: 0; padding: .1rem .3rem;
                    overflow-wrap: anywhere; }
  table.stacks td.long { min-width: 0; }
  table.stacks td::before { content: attr(data-title); color: var(--soft); flex: none; max-width: 45%; }
}
)css";

bool stacks(const DocumentPart& block) {
  const auto* table = std::get_if<Table>(&block);
  return table != nullptr && table->stacks;
}

/// A file's name as an address relative to the page: a colon would make it a scheme.
std::string address(const std::string& file) {
  std::string out;
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || std::string_view("/._-~").find(c) != std::string_view::npos) {
      out += c;
    } else {
      out += fmt::format("%{:02X}", byte);
    }
  }
  return out;
}

/// HTML text; words between backticks become code.
std::string html_escaped(const std::string& text) {
  std::string out;
  bool code = false;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '`':
        out += code ? "</code>" : "<code>";
        code = !code;
        break;
      default:
        out += c;
    }
  }
  if (code) out += "</code>";
  return out;
}

constexpr auto kToneClasses =
    std::to_array<Word<Tone>>({{Tone::good, "good"}, {Tone::fair, "fair"}, {Tone::bad, "bad"}});

/// ` class="number good"`, or nothing. A cell of a sentence keeps a width in which it can be read.
std::string class_attribute(bool numeric, Tone tone, std::string_view text = {}) {
  constexpr std::size_t kSentence = 40;  // characters
  std::string classes = numeric ? "number" : text.size() > kSentence ? "long" : "";
  const std::string_view tint = word_for(kToneClasses, tone);
  if (!tint.empty()) classes += (classes.empty() ? "" : " ") + std::string(tint);
  return classes.empty() ? "" : fmt::format(" class=\"{}\"", classes);
}

/// "Fits to the tables" -> "fits-to-the-tables"
std::string anchor(const std::string& heading) {
  std::string id;
  for (const char c : heading) {
    const auto u = static_cast<unsigned char>(c);
    if (u < 0x80 && std::isalnum(u) != 0) {
      id += static_cast<char>(std::tolower(u));
    } else if (!id.empty() && id.back() != '-') {
      id += '-';
    }
  }
  return id;
}

/// The drawing without its XML prologue, which HTML does not allow.
std::string inline_svg(const std::string& svg, const Picture& picture) {
  const auto start = svg.find("<svg");
  if (start == std::string::npos) {
    throw Error(ExitCode::environment, picture.id + ".svg", "is no SVG drawing");
  }
  return fmt::format("<svg role=\"img\" aria-label=\"{}\"{}", html_escaped(picture.title),
                     svg.substr(start + 4));
}

struct HtmlBlock {
  const std::map<std::string, std::string>& drawings;

  std::string operator()(const Heading& heading) const {
    return fmt::format("<h{0} id=\"{1}\">{2}</h{0}>\n", heading.level, anchor(heading.text),
                       html_escaped(heading.text));
  }

  std::string operator()(const Paragraph& paragraph) const {
    return fmt::format("<p>{}</p>\n", html_escaped(paragraph.text));
  }

  std::string operator()(const Bullets& bullets) const {
    std::string out = "<ul>\n";
    for (const Cell& item : bullets.items) {
      out += fmt::format("<li{}>{}</li>\n", class_attribute(false, item.tone),
                         html_escaped(item.text));
    }
    return out + "</ul>\n";
  }

  std::string operator()(const Table& table) const {
    std::string out =
        fmt::format("<div class=\"wide\"><table{}>\n", table.stacks ? " class=\"stacks\"" : "");
    if (!table.caption.empty()) {
      out += fmt::format("<caption>{}</caption>\n", html_escaped(table.caption));
    }
    const auto titled = [](const Column& column) { return !column.title.empty(); };
    if (std::ranges::any_of(table.columns, titled)) {
      out += "<thead><tr>";
      for (const Column& column : table.columns) {
        out +=
            fmt::format("<th scope=\"col\"{}>{}</th>", class_attribute(column.numeric, Tone::plain),
                        html_escaped(column.title));
      }
      out += "</tr></thead>\n";
    }
    out += "<tbody>\n";
    for (const auto& row : table.rows) {
      out += "<tr>";
      for (std::size_t i = 0; i < row.size(); ++i) {
        const std::string title =
            table.stacks ? fmt::format(" data-title=\"{}\"", html_escaped(table.columns[i].title))
                         : "";
        const std::string text = html_escaped(row[i].text);
        out += fmt::format(
            "<td{}{}>{}</td>", class_attribute(table.columns[i].numeric, row[i].tone, row[i].text),
            title,
            row[i].file.empty() ? text
                                : fmt::format("<a href=\"{}\">{}</a>", address(row[i].file), text));
      }
      out += "</tr>\n";
    }
    return out + "</tbody></table></div>\n";
  }

  std::string operator()(const Picture& picture) const {
    const auto drawing = drawings.find(picture.id);
    if (drawing == drawings.end()) {
      throw Error(ExitCode::environment, picture.id + ".svg", "was not drawn");
    }
    return fmt::format("<figure>\n{}\n<figcaption><b>{}.</b> {}</figcaption>\n</figure>\n",
                       inline_svg(drawing->second, picture), html_escaped(picture.title),
                       html_escaped(picture.caption));
  }
};

std::string contents(const Document& document) {
  std::string out = "<nav aria-label=\"Contents\">\n";
  for (const DocumentPart& block : document.blocks) {
    const auto* heading = std::get_if<Heading>(&block);
    if (heading == nullptr || heading->level != 2) continue;
    out +=
        fmt::format("<a href=\"#{}\">{}</a>\n", anchor(heading->text), html_escaped(heading->text));
  }
  return out + "</nav>\n";
}

}  // namespace

std::string to_html(const Document& document, const std::map<std::string, std::string>& drawings) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}{4}</style>\n</head>\n<body>\n"
      "<h1>{0}</h1>\n<p class=\"subtitle\">{2}</p>\n{3}",
      html_escaped(document.title), kStyle, html_escaped(document.subtitle), contents(document),
      std::ranges::any_of(document.blocks, stacks) ? kStackingStyle : "");
  for (const DocumentPart& block : document.blocks) out += std::visit(HtmlBlock{drawings}, block);
  return out + "</body>\n</html>\n";
}

}  // namespace tpm::show
