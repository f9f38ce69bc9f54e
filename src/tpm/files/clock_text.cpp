#include "tpm/files/clock_text.hpp"

#include <algorithm>
#include <charconv>

#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

constexpr double kPerMinute = 60.0, kPerHour = 3600.0, kPerDay = 86400.0;

/// A whole number of at most `most` digits.
std::optional<int> find_count(std::string_view text, std::size_t most) {
  int count = 0;
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, count);
  const bool whole = parsed.ec == std::errc{} && parsed.ptr == end && count >= 0;
  return whole && !text.empty() && text.size() <= most && text.front() != '-' ? std::optional(count)
                                                                              : std::nullopt;
}

/// "PM" at the end, taken away; none without such a mark.
std::optional<bool> take_half_of_day(std::string_view& text) {
  if (text.size() < 3) return std::nullopt;
  const char half = text[text.size() - 2];
  const char letter = text.back();
  const bool marked = letter == 'M' || letter == 'm';
  const bool am = half == 'A' || half == 'a', pm = half == 'P' || half == 'p';
  if (!marked || (!am && !pm)) return std::nullopt;
  text.remove_suffix(2);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return pm;
}

bool is_date(std::string_view text) {
  return !text.empty() && text.size() <= 10 &&
         text.find_first_not_of("0123456789-./") == std::string_view::npos &&
         text.find_first_of("-./") != std::string_view::npos;
}

}  // namespace

std::optional<double> find_clock_seconds(std::string_view field) {
  constexpr std::size_t kLongest = 40;
  if (field.size() > kLongest || field.find(':') == std::string_view::npos) return std::nullopt;
  std::string_view text = field;
  const auto pm = take_half_of_day(text);
  const auto blank = text.find_first_of(" T");
  if (blank != std::string_view::npos) {
    if (!is_date(text.substr(0, blank))) return std::nullopt;
    text.remove_prefix(blank + 1);
  }
  if (text.ends_with('Z')) text.remove_suffix(1);
  const auto first = text.find(':');
  if (first == std::string_view::npos) return std::nullopt;
  const auto second = text.find(':', first + 1);
  const bool three = second != std::string_view::npos;
  const auto high = find_count(text.substr(0, first), 4);
  if (!high) return std::nullopt;
  std::string last(text.substr((three ? second : first) + 1));
  std::replace(last.begin(), last.end(), ',', '.');
  const auto low = find_number(last);
  const bool plain = !last.empty() && last.find_first_not_of("0123456789.") == std::string::npos;
  if (!low || !plain || *low >= kPerMinute + 1.0) return std::nullopt;
  if (!three) {
    const bool minutes = last.find('.') != std::string::npos;
    return minutes ? std::optional(*high * kPerMinute + *low) : std::nullopt;
  }
  const auto middle = find_count(text.substr(first + 1, second - first - 1), 2);
  if (!middle || *middle > 59) return std::nullopt;
  constexpr int kNoon = 12;
  int hours = *high;
  if (pm) hours = hours % kNoon + (*pm ? kNoon : 0);
  return hours * kPerHour + *middle * kPerMinute + *low;
}

bool is_clock_text(std::string_view field) {
  return find_clock_seconds(field).has_value();
}

void unwrap_midnights(std::span<double> seconds) {
  double days = 0.0;
  for (std::size_t i = 1; i < seconds.size(); ++i) {
    if (seconds[i] + days < seconds[i - 1] - 0.5 * kPerDay) days += kPerDay;
    seconds[i] += days;
  }
}

}  // namespace tpm::files
