#include "tpm/base/text.hpp"

#include <fmt/format.h>

#include <utf8.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace tpm::base {

std::string shortest(double value) {
  return fmt::format("{}", value);
}

std::string significant(double value, int digits) {
  return fmt::format("{:.{}g}", value, digits);
}

double rounded(double value, int digits) {
  if (!std::isfinite(value)) return value;
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  double result = value;
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

std::string fixed(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

std::string for_terminal(std::string_view text, LineEnds line_ends) {
  const auto plain = [&](char c) {
    const auto u = static_cast<unsigned char>(c);
    constexpr unsigned char kSpace = 0x20, kDelete = 0x7f;
    return (u >= kSpace && u < kDelete) || c == '\t' || (c == '\n' && line_ends == LineEnds::kept);
  };
  if (std::all_of(text.begin(), text.end(), plain)) return std::string(text);
  std::string valid;
  utf8::replace_invalid(text.begin(), text.end(), std::back_inserter(valid), U'?');
  std::string safe;
  for (auto at = valid.cbegin(); at != valid.cend();) {
    const auto begin = at;
    const std::uint32_t c = utf8::next(at, valid.cend());
    const bool line_end = c == '\n' && line_ends == LineEnds::kept;
    const bool control = (c < 0x20 && c != '\t' && !line_end) || (c >= 0x7f && c < 0xa0);
    const bool turns_direction = c == 0x061c || (c >= 0x200e && c <= 0x200f) ||
                                 (c >= 0x2028 && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069);
    if (control || turns_direction) {
      fmt::format_to(std::back_inserter(safe), "\\u{:04x}", c);
    } else {
      safe.append(begin, at);
    }
  }
  return safe;
}

std::string_view trimmed(std::string_view text, std::string_view blanks) noexcept {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string shell_quoted(std::string_view word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./:=@%+,-";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) {
    return std::string(word);
  }
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string shell_word(std::string_view name) {
  return shell_quoted(name.starts_with('-') ? "./" + std::string(name) : std::string(name));
}

std::string with_arguments_for_options(std::string_view message) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto begins_word = [&](std::size_t at) {
    constexpr std::string_view kBefore = " (\"'";
    return at == 0 || kBefore.find(message[at - 1]) != std::string_view::npos;
  };
  std::string text;
  bool in_command = false;
  for (std::size_t at = 0; at < message.size();) {
    constexpr std::string_view kCommand = "tpm ", kOption = "--", kEnds = ";,)";
    const std::string_view rest = message.substr(at);
    if (kEnds.find(rest.front()) != std::string_view::npos) in_command = false;
    if (rest.starts_with(kCommand) && begins_word(at)) in_command = true;
    const bool option = rest.starts_with(kOption) && begins_word(at) && rest.size() > 2 &&
                        is_letter(rest[2]) && !in_command;
    if (!option) {
      text += message[at++];
      continue;
    }
    for (at += kOption.size(); at < message.size(); ++at) {
      const char c = message[at];
      const bool joins = c == '-' && at + 1 < message.size() && is_letter(message[at + 1]);
      if (!is_letter(c) && !joins) break;
      text += joins ? '_' : c;
    }
  }
  return text;
}

std::string probability(double p) {
  return p < 1e-4 ? significant(p, 2) : fixed(p, 4);
}

}  // namespace tpm::base
