#pragma once
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace tpm::show {

/// Tint of a verdict where there is colour; the words always carry the meaning.
enum class Tone { plain, good, fair, bad };

struct Cell {
  std::string text;
  Tone tone = Tone::plain;
  std::string file{};  ///< that the page links, relative to it; may be empty
};

struct Column {
  std::string title;
  bool numeric = false;  ///< aligned to the right
};

// --- blocks -------------------------------------------------------------------------------------
// Text in them is plain; `words between backticks` are code.

struct Heading {
  int level = 2;  ///< 2 for a section, 3 within one
  std::string text;
};

struct Paragraph {
  std::string text;
};

struct Bullets {
  std::vector<Cell> items;
};

struct Table {
  std::string caption;
  std::vector<Column> columns;            ///< all without a title: HTML has no head row
  std::vector<std::vector<Cell>> rows{};  ///< each as long as `columns`
  /// In HTML on a narrow screen each row becomes a list of titles and values, in place of a table
  /// that must be scrolled.
  bool stacks = false;
};

struct Picture {
  std::string id;  ///< of the Figure, and of its drawing figures/ID.svg
  std::string title;
  std::string caption;
};

using DocumentPart = std::variant<Heading, Paragraph, Bullets, Table, Picture>;

/// A report as a list of blocks, independent of how it is rendered.
struct Document {
  std::string title;
  std::string subtitle;
  std::vector<DocumentPart> blocks{};

  void heading(int level, std::string text);
  void paragraph(std::string text);
  void bullets(std::vector<Cell> items);
  void table(Table table);
  void picture(Picture picture);
};

/// Writes the project's plain names and numbers as print does, outside code: eta1 as η₁, lambda1 as
/// λ₁, 2.6e+05 as 2.6·10⁵.
void typeset(Document& document);

/// GitHub-flavoured Markdown; pictures are links to figures/ID.svg beside it.
[[nodiscard]] std::string to_markdown(const Document& document);

/// One self-contained HTML page for screen, phone and paper.
/// @param drawings the SVG text of each picture, by id; Error(environment) if one is missing
[[nodiscard]] std::string to_html(const Document& document,
                                  const std::map<std::string, std::string>& drawings);

}  // namespace tpm::show
