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

SweepOutput plain_output(const std::string& word) {
  const OutputForm& entry = *find_entry(kOutputWords, word);
  return {entry.meaning, {word, std::string(entry.unit), std::string(entry.words), {}}, 0.0};
}

SweepOutput timed_output(const Json& object, const DocumentPlace& place) {
  const auto entry = std::find_if(kOutputWords.begin(), kOutputWords.end(), [&](const auto& word) {
    return word.when != When::fixed && object.contains(std::string(word.text));
  });
  const std::string key(entry->text);
  const DocumentPlace here = place.key(key);
  SweepOutput output{entry->meaning,
                     {object.at("name").get<std::string>(),
                      std::string(entry->unit),
                      std::string(entry->words),
                      {}},
                     0.0};
  const Json& when = object.at(key);
  if (entry->when == When::at) {
    output.time_s = quantity(when, Dimension::time, here);
    return output;
  }
  const CountedValues places = parse_values(when, Dimension::time, here);
  auto& times = output.variable.times_s;
  if (places.count > kMostTimes) {
    throw bad_input(here.where, "too many times", fmt::format("at most {}", kMostTimes));
  }
  for (std::uint64_t i = 0; i < places.count; ++i) times.push_back(places.values.at(i));
  if (std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) != times.end()) {
    throw bad_input(here.where, "times that do not rise", "rising times");
  }
  return output;
}

}  // namespace

std::span<const OutputForm> output_forms() {
  return kOutputWords;
}

std::vector<SweepOutput> parse_sweep_outputs(const Json& list, const DocumentPlace& place) {
  std::vector<SweepOutput> outputs;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const DocumentPlace here = place.key(std::to_string(i));
    if (list[i].is_object() && list[i].contains("formula")) continue;
    outputs.push_back(list[i].is_string() ? plain_output(list[i].get<std::string>())
                                          : timed_output(list[i], here));
  }
  return outputs;
}

std::vector<double> parse_list(const Json& list, Dimension dimension, const DocumentPlace& place) {
  std::vector<double> values;
  for (const Json& value : list) {
    values.push_back(quantity(value, dimension, place.key(std::to_string(values.size()))));
  }
  return values;
}

SweepRange parse_range(const Json& object, Dimension dimension, const DocumentPlace& place) {
  for (const char* key : {"from", "to"}) {
    if (!object.contains(key))
      throw bad_input(place.where, fmt::format("no '{}'", key), "two ends");
  }
  const SweepRange range{
      quantity(object.at("from"), dimension, place.key("from")),
      quantity(object.at("to"), dimension, place.key("to")),
      object.value("scale", "linear") == "log" ? AxisScale::logarithmic : AxisScale::linear};
  if (range.scale == AxisScale::logarithmic && !(range.from > 0.0 && range.to > 0.0)) {
    throw bad_input(place.where, "a logarithmic range with an end that is not above 0",
                    "two ends above 0");
  }
  return range;
}

CountedValues parse_values(const Json& object, Dimension dimension, const DocumentPlace& place) {
  const bool has_range = object.contains("from") || object.contains("to") ||
                         object.contains("count") || object.contains("scale");
  if (object.contains("values") == has_range) {
    throw bad_input(place.where, has_range ? "values and a range" : "no values",
                    "'values', or 'from', 'to' and 'count'");
  }
  if (object.contains("values")) {
    auto values = parse_list(object.at("values"), dimension, place.key("values"));
    const std::uint64_t count = values.size();
    return {ParameterValues::list(std::move(values)), count};
  }
  const SweepRange range = parse_range(object, dimension, place);
  if (!object.contains("count")) throw bad_input(place.where, "no 'count'", "how many values");
  const auto count = object.at("count").get<std::uint64_t>();
  return {ParameterValues::range(range.from, range.to, count, range.scale), count};
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
