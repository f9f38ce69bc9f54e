#include "tpm/sweep/sweep_outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <utility>

#include "tpm/base/enum_names.hpp"
#include "tpmkit/error.hpp"

namespace tpm::sweep {
namespace {

using Kind = SweepOutput::Kind;

using When = OutputForm::When;

constexpr std::array<OutputForm, 9> kOutputWords{{
    {Kind::lambda1, "lambda1", "Pa", "lambda1 at the imposed depth", When::fixed},
    {Kind::peak_force, "peak_force", "N", "largest force of the indentation", When::fixed},
    {Kind::end_force, "end_force", "N", "force at the end of the indentation", When::fixed},
    {Kind::force_at, "force_at", "N", "force at a time", When::at},
    {Kind::force_over, "force_over", "N", "force over time", When::over},
    {Kind::instantaneous_creep_depth, "instantaneous_creep_depth", "m", "depth just after the load",
     When::fixed},
    {Kind::creep_depth, "creep_depth", "m", "depth at the end of the load", When::fixed},
    {Kind::creep_depth_at, "creep_depth_at", "m", "depth under the load at a time", When::at},
    {Kind::creep_depth_over, "creep_depth_over", "m", "depth under the load over time", When::over},
}};

constexpr std::uint64_t kMostTimes = 100'000;

/// A text with a unit, or a plain number where there is none.
double quantity(const Json& value, Dimension dimension, const DocumentPlace& place) {
  return parse_quantity(value.is_number() ? value.dump() : value.get<std::string>(), dimension,
                        place.where);
}

std::vector<double> rising_times(const ValueKeys& said, const DocumentPlace& place) {
  const CountedValues places = values_of(said, Dimension::time, place);
  if (places.count > kMostTimes) {
    throw bad_input(place.where, "too many times", fmt::format("at most {}", kMostTimes));
  }
  std::vector<double> times;
  for (std::uint64_t i = 0; i < places.count; ++i) times.push_back(places.values.at(i));
  if (std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) != times.end()) {
    throw bad_input(place.where, "times that do not rise", "rising times");
  }
  return times;
}

}  // namespace

std::span<const OutputForm> output_forms() {
  return kOutputWords;
}

std::vector<SweepOutput> outputs_of(const std::vector<SweepOutputKeys>& outputs,
                                    const DocumentPlace& place) {
  std::vector<SweepOutput> found;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const SweepOutputKeys& said = outputs[i];
    if (!said.kind) continue;
    const OutputForm& form = entry_of(kOutputWords, *said.kind);
    SweepOutput output{
        *said.kind, {said.name, std::string(form.unit), std::string(form.words), {}}, said.time_s};
    if (form.when == When::over) {
      output.variable.times_s =
          rising_times(said.times, place.key(std::to_string(i)).key(form.text));
    }
    found.push_back(std::move(output));
  }
  return found;
}

SweepRange range_of(const ValueKeys& said, Dimension dimension, const DocumentPlace& place) {
  const auto end = [&](const Json& value, const char* key) {
    if (value.is_null()) throw bad_input(place.where, fmt::format("no '{}'", key), "two ends");
    return quantity(value, dimension, place.key(key));
  };
  const SweepRange range{end(said.from, "from"), end(said.to, "to"),
                         said.scale.value_or(AxisScale::linear)};
  if (range.scale == AxisScale::logarithmic && !(range.from > 0.0 && range.to > 0.0)) {
    throw bad_input(place.where, "a logarithmic range with an end that is not above 0",
                    "two ends above 0");
  }
  return range;
}

CountedValues values_of(const ValueKeys& said, Dimension dimension, const DocumentPlace& place) {
  const bool has_range = !said.from.is_null() || !said.to.is_null() || said.count || said.scale;
  if (said.values.empty() != has_range) {
    throw bad_input(place.where, has_range ? "values and a range" : "no values",
                    "'values', or 'from', 'to' and 'count'");
  }
  if (!has_range) {
    std::vector<double> values;
    const DocumentPlace at = place.key("values");
    for (const Json& value : said.values) {
      values.push_back(quantity(value, dimension, at.key(std::to_string(values.size()))));
    }
    return {ParameterValues::list(std::move(values)), said.values.size()};
  }
  const SweepRange range = range_of(said, dimension, place);
  if (!said.count) throw bad_input(place.where, "no 'count'", "how many values");
  return {ParameterValues::range(range.from, range.to, *said.count, range.scale), *said.count};
}

void require_identifier(const std::string& name, std::string_view where) {
  const auto letter = [](char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  const bool good = !name.empty() && letter(name.front()) && std::ranges::all_of(name, [&](char c) {
    return letter(c) || std::isdigit(static_cast<unsigned char>(c)) != 0;
  });
  if (good) return;
  throw bad_input(where, fmt::format("'{}' cannot be a name", printable(name)),
                  "letters, digits and _, no digit first");
}

}  // namespace tpm::sweep
