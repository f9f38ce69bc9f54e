#include "tpm/fit/select/fixed_times.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fit {
namespace {

constexpr std::string_view kExpected =
    "times above 0 that rise, such as \"0.1 s, 1 s, 10 s\", or \"1 ms : 1000 s : 13\"";

std::vector<std::string> parts_of(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(separator, from), text.size());
    std::string_view part = text.substr(from, to - from);
    while (part.starts_with(' ')) part.remove_prefix(1);
    while (part.ends_with(' ')) part.remove_suffix(1);
    parts.emplace_back(part);
    from = to + 1;
  }
  return parts;
}

Error refused(std::string_view option, std::string_view what) {
  return {ExitCode::usage, option, what, kExpected};
}

double time_of(const std::string& text, std::string_view option) {
  try {
    const double time_s = parse_quantity(text, Dimension::time, option);
    if (time_s > 0.0 && std::isfinite(time_s)) return time_s;
  } catch (const Error& error) {
    throw error.with_code(ExitCode::usage);
  }
  throw refused(option, fmt::format("'{}'", printable(text)));
}

}  // namespace

std::vector<double> parse_times(std::string_view text, std::string_view option) {
  std::vector<double> times_s;
  const std::vector<std::string> range = parts_of(text, ':');
  if (range.size() > 1) {
    int count = 0;
    const std::string& last = range.back();
    const auto [end, error] = std::from_chars(last.data(), last.data() + last.size(), count);
    const bool whole = error == std::errc() && end == last.data() + last.size();
    if (range.size() != 3 || !whole || count < 2 || count > kMostBranches) {
      throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)),
                  fmt::format("FIRST : LAST : COUNT, with 2 to {} times", kMostBranches));
    }
    const double first = time_of(range[0], option), ratio = time_of(range[1], option) / first;
    for (int i = 0; i < count; ++i) {
      times_s.push_back(first * std::pow(ratio, static_cast<double>(i) / (count - 1)));
    }
  } else {
    for (const std::string& part : parts_of(text, ',')) times_s.push_back(time_of(part, option));
  }
  for (std::size_t i = 1; i < times_s.size(); ++i) {
    if (times_s[i] > times_s[i - 1]) continue;
    throw refused(option, fmt::format("{} s after {} s", significant(times_s[i], 4),
                                      significant(times_s[i - 1], 4)));
  }
  return times_s;
}

LawSpec law_of_times(const std::optional<LawSpec>& law, std::span<const double> times_s,
                     std::string_view option) {
  if (!law) {
    LawSpec spec;
    spec.branches = static_cast<int>(times_s.size());
    return spec;
  }
  const bool parallel = law->form == BranchForm::parallel && law->fractional == Fractional::none;
  if (parallel && static_cast<std::size_t>(law->branches) == times_s.size()) return *law;
  throw Error(ExitCode::usage, option,
              fmt::format("{} times for the law {}", times_s.size(), law_name(*law)),
              "a law with as many parallel branches, or no --law");
}

std::optional<double> stated_time(const std::string& parameter, std::span<const double> times_s) {
  constexpr std::string_view kTime = "tau";
  if (!parameter.starts_with(kTime) || parameter.size() == kTime.size()) return std::nullopt;
  std::size_t number = 0;
  const char* from = parameter.data() + kTime.size();
  const char* end = parameter.data() + parameter.size();
  const auto [stop, error] = std::from_chars(from, end, number);
  if (error != std::errc() || stop != end || number < 1 || number > times_s.size()) {
    return std::nullopt;
  }
  return times_s[number - 1];
}

}  // namespace tpm::fit
