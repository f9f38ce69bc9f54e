#include "tpm/files/import/header_comments.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"

namespace tpm::files {

std::vector<std::string_view> cut_comment(std::string_view text, char separator) {
  std::vector<std::string_view> fields;
  while (true) {
    const auto end = separator == ' ' ? text.find_first_of(" \t") : text.find(separator);
    const std::string_view field = text.substr(0, end);
    if (separator != ' ' || !field.empty()) fields.push_back(field);
    if (end == std::string_view::npos) return fields;
    text.remove_prefix(end + 1);
  }
}

std::optional<std::string_view> behind_comment_mark(std::string_view text, char separator) {
  constexpr std::string_view kBlanks = " \t";
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::string_view marks = separator == ';' ? "#%" : "#%;";
  const bool marked =
      text.starts_with("//") || (!text.empty() && marks.find(text.front()) != marks.npos);
  if (!marked) return std::nullopt;
  text.remove_prefix(std::min(text.find_first_not_of("#%;/ \t"), text.size()));
  return text;
}

std::string_view without_label(std::string_view text) {
  constexpr auto kLabels = std::to_array<std::string_view>(
      {"columns", "column names", "column titles", "names", "titles", "variables", "fields",
       "channels", "header", "units", "column units", "spalten", "einheiten", "colonnes"});
  const auto colon = text.find(':');
  if (colon == std::string_view::npos) return text;
  std::string label(trimmed(text.substr(0, colon)));
  std::ranges::transform(label, label.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(kLabels, label) == kLabels.end() ? text : text.substr(colon + 1);
}

std::optional<NumberedTitle> numbered_title(std::string_view text) {
  for (const std::string_view word : {"column ", "Column ", "col ", "Col ", "COLUMN "}) {
    if (text.starts_with(word)) text.remove_prefix(word.size());
  }
  const auto end = text.find_first_not_of("0123456789");
  constexpr std::size_t kMostDigits = 3;
  if (end == std::string_view::npos || end == 0 || end > kMostDigits) return std::nullopt;
  std::string_view title = trimmed(text.substr(end));
  if (title.size() < 2 || std::string_view(":=).").find(title.front()) == title.npos) {
    return std::nullopt;
  }
  title = trimmed(title.substr(1));
  if (title.empty()) return std::nullopt;
  return NumberedTitle{std::stoul(std::string(text.substr(0, end))), title};
}

}  // namespace tpm::files
