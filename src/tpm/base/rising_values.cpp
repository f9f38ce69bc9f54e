#include "tpm/base/rising_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <system_error>

#include "tpm/base/evenly.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::base {
namespace {

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

Error not_rising(const RisingValues& accepted, std::string_view option, std::string_view what) {
  return {ExitCode::usage, option, what,
          fmt::format("{} above 0 that rise, such as {}", accepted.called, accepted.example)};
}

double value_of(const std::string& text, const RisingValues& accepted, std::string_view option) {
  try {
    const double value = parse_quantity(text, accepted.dimension, option);
    if (value > 0.0 && std::isfinite(value)) return value;
  } catch (const Error& error) {
    throw error.with_code(ExitCode::usage);
  }
  throw not_rising(accepted, option, fmt::format("'{}'", printable(text)));
}

}  // namespace

std::vector<double> parse_rising(std::string_view text, const RisingValues& accepted,
                                 std::string_view option) {
  std::vector<double> values;
  const std::vector<std::string> range = parts_of(text, ':');
  if (range.size() > 1) {
    int count = 0;
    const std::string& last = range.back();
    const auto [end, error] = std::from_chars(last.data(), last.data() + last.size(), count);
    const bool whole = error == std::errc() && end == last.data() + last.size();
    if (range.size() != 3 || !whole || count < 2 || count > accepted.most) {
      throw Error(
          ExitCode::usage, option, fmt::format("'{}'", printable(text)),
          fmt::format("FIRST : LAST : COUNT, with 2 to {} {}", accepted.most, accepted.called));
    }
    const double from = value_of(range[0], accepted, option);
    const double to = value_of(range[1], accepted, option);
    if (!std::isfinite(to / from)) {
      throw not_rising(accepted, option, fmt::format("'{}'", printable(text)));
    }
    values = evenly_in_log(from, to, count);
  } else {
    for (const std::string& part : parts_of(text, ',')) {
      values.push_back(value_of(part, accepted, option));
    }
  }
  const std::string_view unit = si_symbol(accepted.dimension);
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) continue;
    throw not_rising(accepted, option,
                     fmt::format("{} {} after {} {}", significant(values[i], 4), unit,
                                 significant(values[i - 1], 4), unit));
  }
  return values;
}

}  // namespace tpm::base
