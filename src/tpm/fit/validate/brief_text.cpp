#include "tpm/fit/validate/brief_text.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kTitle = 15;
constexpr std::size_t kMostOfOne = 3;  // lines of words that are always printed

std::size_t lines_in(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

std::string titled_line(std::string_view title, const std::string& words) {
  return wrapped(fmt::format("{:<15}{}", title, words), BriefText::kWidth, kTitle) + "\n";
}

/// The first lines of a text, the last of them ending in dots if there were more.
std::string first_lines(const std::string& text, std::size_t most) {
  if (lines_in(text) <= most) return text;
  std::size_t end = 0;
  for (std::size_t i = 0; i < most; ++i) end = text.find('\n', end) + 1;
  std::string kept = text.substr(0, end - 1);
  constexpr std::string_view kDots = " ...";
  const std::size_t last = kept.rfind('\n') + 1;  // 0 if there is none
  if (kept.size() - last + kDots.size() > BriefText::kWidth) {
    kept.resize(last + BriefText::kWidth - kDots.size());
  }
  return kept.append(kDots) + "\n";
}

}  // namespace

void BriefText::add(const std::string& lines, Rank rank, std::string_view name) {
  std::size_t begin = 0;
  while (begin < lines.size()) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size());
    items_.push_back({std::string(name), lines.substr(begin, end - begin) + "\n", rank});
    begin = end + 1;
  }
}

void BriefText::add_table(const std::string& table, Rank rank, std::string_view rows) {
  const std::size_t body = table.find('\n', table.find('\n') + 1) + 1;
  const std::size_t first = items_.size();
  add(table.substr(0, body), Rank::always);
  const std::size_t head = items_.size();
  add(table.substr(body), rank, rows);
  const std::size_t end = items_.size();
  add("\n", Rank::always);
  ++tables_;
  for (std::size_t i = first; i < items_.size(); ++i) {
    items_[i].table = tables_;
    items_[i].frame = i < head || i >= end;
  }
}

/// Takes out the heads of tables without a row.
void BriefText::keep_frames(std::vector<bool>& kept, std::size_t& lines) const {
  std::vector<bool> has_row(static_cast<std::size_t>(tables_) + 1, false);
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (kept[i] && !items_[i].frame) has_row[static_cast<std::size_t>(items_[i].table)] = true;
  }
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (!kept[i] || !items_[i].frame || has_row[static_cast<std::size_t>(items_[i].table)])
      continue;
    kept[i] = false;
    lines -= lines_in(items_[i].lines);
  }
}

void BriefText::add_line(std::string_view title, const std::string& words, Rank rank) {
  std::string lines = titled_line(title, words);
  if (rank == Rank::always) lines = first_lines(lines, kMostOfOne);
  items_.push_back({std::string(title), std::move(lines), rank});
}

void BriefText::add_words(const std::string& words) {
  items_.push_back({{}, first_lines(wrapped(words, kWidth, 2) + "\n", kMostOfOne), Rank::always});
}

std::string BriefText::text() const {
  std::size_t lines = 0;
  for (const Item& item : items_) lines += lines_in(item.lines);
  std::vector<bool> kept(items_.size(), true);
  std::vector<std::size_t> out;
  std::size_t room = kMostLines;
  if (lines > room) room -= 2;  // for what is left out
  for (Rank rank = Rank::detail; rank != Rank::always && lines > room;
       rank = static_cast<Rank>(static_cast<int>(rank) - 1)) {
    for (std::size_t i = items_.size(); i-- > 0 && lines > room;) {
      if (items_[i].rank != rank) continue;
      kept[i] = false;
      lines -= lines_in(items_[i].lines);
      out.push_back(i);
      keep_frames(kept, lines);
    }
  }
  // Where a table went with its head there is room again.
  for (auto i = out.rbegin(); i != out.rend(); ++i) {
    const std::size_t more = lines_in(items_[*i].lines);
    if (items_[*i].table != 0 || lines + more > room) continue;
    kept[*i] = true;
    lines += more;
  }
  std::vector<std::string> names;
  std::string text;
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (kept[i]) {
      text += items_[i].lines;
    } else if (!items_[i].frame) {
      names.push_back(items_[i].name);
    }
  }
  if (names.empty()) return text;
  const auto told = [&](const std::string& name) {
    const auto count = std::ranges::count(names, name);
    return count > 1 ? fmt::format("{} ({})", name, count) : name;
  };
  const std::string all = listed(each_once(names, [](const std::string& n) { return n; }), told);
  const std::string left =
      first_lines(titled_line("left out", fmt::format("--format json has all: {}", all)), 2);
  // Before what is said last, the verdict.
  const std::string& last = items_.back().lines;
  return text.insert(kept.back() ? text.size() - last.size() : text.size(), left);
}

}  // namespace tpm::fit
