#include "tpm/files/separator.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/number_style.hpp"

namespace tpm::files {
namespace {

bool holds_outside_quotes(std::string_view line, char wanted) {
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == wanted && !quoted) return true;
  }
  return false;
}

/// Lines from all over a text: a preamble may be longer than the samples that a start would show.
std::vector<std::string_view> sampled_lines(std::string_view text) {
  constexpr std::size_t kAtStart = 500, kPlaces = 16, kAtPlace = 40;
  std::vector<std::string_view> sample;
  // False if the part ends before `most` lines are taken.
  const auto take = [&sample](std::string_view part, std::size_t most) {
    std::size_t taken = 0;
    while (!part.empty() && taken < most) {
      const std::string_view line = part.substr(0, part.find_first_of("\r\n"));
      part.remove_prefix(std::min(line.size() + 1, part.size()));
      if (line.starts_with('#') || line.find_first_not_of(" \t") == std::string_view::npos)
        continue;
      sample.push_back(line);
      ++taken;
    }
    return taken == most;
  };
  if (!take(text, kAtStart)) return sample;
  for (std::size_t place = 1; place <= kPlaces; ++place) {
    const auto feed = text.find_first_of("\r\n", place * (text.size() / (kPlaces + 1)));
    if (feed != std::string_view::npos) take(text.substr(feed), kAtPlace);
  }
  return sample;
}

/// Text between quotes, or the field itself.
std::string_view without_quotes(std::string_view field) noexcept {
  const bool quoted = field.size() > 1 && field.front() == '"' && field.back() == '"';
  return quoted ? trimmed(field.substr(1, field.size() - 2)) : field;
}

/// The fields of a line as far as a separator can be told from them: quotes keep their content.
std::vector<std::string_view> rough_fields(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const bool end = i == line.size();
    if (!end && line[i] == '"') quoted = !quoted;
    const bool blank = separator == ' ' && !end && line[i] == '\t';
    if (!end && (quoted || (line[i] != separator && !blank))) continue;
    const std::string_view field = without_quotes(trimmed(line.substr(begin, i - begin)));
    if (separator != ' ' || !field.empty()) fields.push_back(field);
    begin = i + 1;
  }
  return fields;
}

/// A field that another separator would cut into several numbers.
bool holds_several_numbers(std::string_view field) {
  if (is_number_in_some_style(field)) return false;
  for (const char other : {'\t', ';', ',', ' '}) {
    if (field.find(other) == std::string_view::npos) continue;
    const auto parts = rough_fields(field, other);
    if (parts.size() > 1 && std::all_of(parts.begin(), parts.end(), is_number_in_some_style)) {
      return true;
    }
  }
  return false;
}

/// Two or more numbers, which are most of what the line holds, and nothing left to cut.
/// @param labelled  the line may begin with a text
bool is_row_of_numbers(std::string_view line, char separator, bool labelled) {
  std::size_t numbers = 0, filled = 0;
  for (const std::string_view field : rough_fields(line, separator)) {
    if (field.empty()) continue;
    const bool digits = field.front() >= '0' && field.front() <= '9';  // a date or a clock
    ++filled;
    if (is_number_in_some_style(field)) {
      ++numbers;
    } else if (!labelled && filled == 1 && !digits) {
      return false;
    } else if (holds_several_numbers(field)) {
      return false;
    }
  }
  return numbers >= 2 && 2 * numbers > filled;
}

}  // namespace

char find_separator(std::string_view text) {
  constexpr auto kCandidates = std::to_array({'\t', ';', ',', ' '});
  const std::vector<std::string_view> sample = sampled_lines(text);
  const auto lines_with = [&](auto&& holds) {
    return static_cast<std::size_t>(std::count_if(sample.begin(), sample.end(), holds));
  };
  for (const bool labelled : {false, true}) {
    char best = '\0';
    std::size_t most = 0;
    for (const char candidate : kCandidates) {
      const std::size_t rows = lines_with(
          [&](std::string_view line) { return is_row_of_numbers(line, candidate, labelled); });
      if (rows > most) best = candidate;
      most = std::max(most, rows);
    }
    if (most > 0) return best;
  }
  for (const char candidate : {'\t', ';', ','}) {
    const std::size_t n = lines_with(
        [candidate](std::string_view line) { return holds_outside_quotes(line, candidate); });
    if (n > 0 && 2 * n >= sample.size()) return candidate;
  }
  return ',';
}

}  // namespace tpm::files
