#include "tpm/base/nearest_word.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <vector>

namespace tpm::base {
namespace {

/// No known word is longer; the work grows with the square of the length.
constexpr std::size_t kLongest = 100;

std::string folded(std::string_view word) {
  std::string text(word);
  for (char& c : text) {
    c = c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

/// Letters to add, leave out, change or swap with their neighbour (optimal string alignment).
std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  std::iota(above.begin(), above.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, changed});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> known) {
  if (word.empty() || word.size() > kLongest) return {};
  const std::string wrong = folded(word);
  const std::string* nearest = nullptr;
  std::size_t fewest = 2 + wrong.size() / 4;
  for (const std::string& right : known) {
    if (right.empty() || right.size() > kLongest) continue;
    const std::size_t edits = edits_between(wrong, folded(right));
    if (edits >= fewest || edits >= std::max(wrong.size(), right.size())) continue;
    fewest = edits;
    nearest = &right;
  }
  if (nearest != nullptr) return *nearest;
  constexpr std::size_t kBeginning = 3;
  if (wrong.size() < kBeginning) return {};
  const auto begun = std::find_if(known.begin(), known.end(), [&](const std::string& right) {
    return folded(right).starts_with(wrong);
  });
  return begun == known.end() ? std::string{} : *begun;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> known) {
  const std::string nearest = nearest_word(word, known);
  return nearest.empty() ? std::string{} : fmt::format(" (did you mean '{}'?)", nearest);
}

Error unknown_word(std::string_view where, std::string_view what, std::string_view word,
                   std::span<const std::string> known) {
  return bad_input(
      where, fmt::format("{} '{}'{}", what, printable(word), did_you_mean(word, known)),
      known.empty() ? "none, for there is none" : fmt::format("one of {}", fmt::join(known, ", ")));
}

}  // namespace tpm::base
