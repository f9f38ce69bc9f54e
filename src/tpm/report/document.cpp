#include "tpm/report/document.hpp"

#include <utility>

namespace tpm {

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

}  // namespace tpm
