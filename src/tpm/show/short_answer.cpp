#include "tpm/show/short_answer.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tpm::show {
namespace {

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::ranges::replace(text, '\n', ' ');
  return text;
}

/// Each warning once, in their order.
std::vector<std::string> distinct(const std::vector<std::string>& warnings) {
  std::vector<std::string> kept;
  for (const std::string& words : warnings) {
    if (!words.empty() && std::ranges::find(kept, words) == kept.end()) kept.push_back(words);
  }
  return kept;
}

/// Warnings in at most `most` lines; those that are too many share the last one.
std::vector<std::string> warning_lines(const std::vector<std::string>& warnings, std::size_t most) {
  std::vector<std::string> lines;
  for (const std::string& words : warnings) {
    if (lines.size() < most) {
      lines.push_back("! " + words);
    } else {
      lines.back() += "; ! " + words;
    }
  }
  return lines;
}

std::vector<std::string> row_lines(const ShortAnswer& answer, std::size_t most) {
  if (answer.rows.size() <= most) return answer.rows;
  const std::size_t kept = most - 1;
  std::vector<std::string> lines(answer.rows.begin(),
                                 answer.rows.begin() + static_cast<std::ptrdiff_t>(kept));
  lines.push_back(answer.rest ? answer.rest(kept)
                              : fmt::format("... and {} more", answer.rows.size() - kept));
  return lines;
}

}  // namespace

std::string to_text(const ShortAnswer& answer, std::size_t most) {
  constexpr std::size_t kFewestRows = 6;  // before warnings share a line
  const std::vector<std::string> warnings = distinct(answer.warnings);
  std::size_t taken =
      answer.conclusion.size() + answer.head.size() + answer.limits.size() + answer.end.size();
  const bool apart = !answer.rows.empty();
  if (apart) taken += 2;                // blank lines around the table
  if (!answer.end.empty()) taken += 1;  // and one before the end
  const std::size_t left = most > taken ? most - taken : 0;
  const std::size_t rows_at_least = std::min(answer.rows.size(), kFewestRows);
  const std::size_t for_warnings = warnings.empty()
                                       ? 0
                                       : std::clamp(left > rows_at_least ? left - rows_at_least : 1,
                                                    std::size_t{1}, warnings.size());
  const std::size_t for_rows =
      std::max<std::size_t>(left > for_warnings ? left - for_warnings : 1, 1);

  std::vector<std::string> lines = answer.conclusion;
  const auto add = [&](const std::vector<std::string>& more) {
    lines.insert(lines.end(), more.begin(), more.end());
  };
  if (apart) lines.emplace_back();
  add(answer.head);
  if (apart) add(row_lines(answer, for_rows));
  if (apart && !(answer.limits.empty() && warnings.empty())) lines.emplace_back();
  add(answer.limits);
  add(warning_lines(warnings, std::max<std::size_t>(for_warnings, 1)));
  if (!answer.end.empty()) lines.emplace_back();
  add(answer.end);
  std::string text;
  for (const std::string& line : lines) text += one_line(line) + "\n";
  return text;
}

std::vector<std::string> separate_lines(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    if (end > from) lines.emplace_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

std::vector<std::string> counted(std::vector<std::string> lines, std::size_t most,
                                 const char* what) {
  if (lines.size() <= most) return lines;
  const std::size_t left_out = lines.size() - (most - 1);
  lines.resize(most - 1);
  lines.push_back(fmt::format("... and {} more {}", left_out, what));
  return lines;
}

std::string end_line(const std::string& next) {
  return next.empty() ? "more: --verbose" : fmt::format("more: --verbose; next: {}", next);
}

void end_answer(ShortAnswer& answer, const std::string& folder,
                const std::vector<std::string>& files, const std::string& next) {
  if (!files.empty()) {
    answer.end.push_back(fmt::format("written to {}: {}", folder, fmt::join(files, ", ")));
  }
  answer.end.push_back(end_line(next));
}

}  // namespace tpm::show
