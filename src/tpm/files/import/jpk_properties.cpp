#include "tpm/files/import/jpk_properties.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

constexpr std::string_view kBlank = " \t\f";

/// Takes the next line off `text`, without its end.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line.substr(std::min(line.find_first_not_of(kBlank), line.size()));
}

bool is_continued(std::string_view line) {
  const std::size_t last = line.find_last_not_of('\\');
  const std::size_t backslashes = line.size() - (last == std::string_view::npos ? 0 : last + 1);
  return backslashes % 2 == 1;
}

/// Where the key of a line ends: at a separator that is not escaped.
std::size_t end_of_key(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\') {
      ++i;
    } else if (line[i] == '=' || line[i] == ':' || kBlank.find(line[i]) != kBlank.npos) {
      return i;
    }
  }
  return line.size();
}

/// Without the backslashes. What the importer reads is ASCII: \uXXXX in comments stays as it is.
std::string unescaped(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '\\' && i + 1 < text.size() && text[i + 1] != 'u';
    plain += text[escape ? ++i : i];
  }
  return plain;
}

std::string_view value_after(std::string_view line, std::size_t key_end) {
  const auto skip_blank = [&line](std::size_t at) {
    return std::min(line.find_first_not_of(kBlank, at), line.size());
  };
  std::size_t at = skip_blank(key_end);
  if (at < line.size() && (line[at] == '=' || line[at] == ':')) at = skip_blank(at + 1);
  return line.substr(at);
}

}  // namespace

PropertyMap parse_properties(std::string_view text) {
  PropertyMap properties;
  while (!text.empty()) {
    std::string line(next_line(text));
    if (line.empty() || line.front() == '#' || line.front() == '!') continue;
    while (is_continued(line)) {
      line.pop_back();
      line += next_line(text);
    }
    const std::size_t end = end_of_key(line);
    properties[unescaped(std::string_view(line).substr(0, end))] =
        unescaped(value_after(line, end));
  }
  return properties;
}

JpkProperties::JpkProperties(PropertyMap own, const PropertyMap& shared, std::string place)
    : own_(std::move(own)), shared_(&shared), place_(std::move(place)) {
  for (const auto& [key, number] : own_) {
    if (!key.ends_with(".*")) continue;
    const std::string_view path = std::string_view(key).substr(0, key.size() - 2);
    const std::size_t dot = path.rfind('.');
    if (dot == std::string_view::npos) continue;
    references_.push_back({std::string(path.substr(0, dot + 1)),
                           fmt::format("{}.{}.", path.substr(dot + 1), number)});
  }
}

std::optional<std::string> JpkProperties::find(std::string_view key) const {
  if (const auto own = own_.find(key); own != own_.end()) return own->second;
  for (const Reference& reference : references_) {
    if (!key.starts_with(reference.head)) continue;
    const auto shared =
        shared_->find(reference.block + std::string(key.substr(reference.head.size())));
    if (shared != shared_->end()) return shared->second;
  }
  return std::nullopt;
}

std::optional<std::string> JpkProperties::find_any(std::initializer_list<std::string> keys) const {
  for (const std::string& key : keys) {
    if (auto value = find(key)) return value;
  }
  return std::nullopt;
}

std::string JpkProperties::text(std::string_view key) const {
  if (auto value = find(key)) return *std::move(value);
  throw bad_input(place_of(key), "is missing", "a complete JPK force file");
}

double JpkProperties::number(std::string_view key) const {
  return parse_number(text(key), place_of(key));
}

std::string JpkProperties::place_of(std::string_view key) const {
  return fmt::format("{}: key {}", place_, printable(key, 120));
}

}  // namespace tpm::files
