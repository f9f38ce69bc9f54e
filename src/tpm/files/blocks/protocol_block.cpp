#include "tpm/files/blocks/protocol_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

constexpr ProtocolKey kDepthKey{"depth", Dimension::length, &ProtocolBlock::depth_m, false};
constexpr ProtocolKey kRateKey{"rate", Dimension::speed, &ProtocolBlock::rate_m_per_s, false};
constexpr ProtocolKey kHoldKey{"hold", Dimension::time, &ProtocolBlock::hold_s, true};
constexpr ProtocolKey kStepHoldKey{"hold", Dimension::time, &ProtocolBlock::hold_s, false};
constexpr ProtocolKey kLoadKey{"load", Dimension::force, &ProtocolBlock::load_N, false};
constexpr ProtocolKey kDurationKey{"duration", Dimension::time, &ProtocolBlock::duration_s, false};

void read_knots(const Json& list, const DocumentPlace& place, ProtocolBlock& block) {
  const bool by_depth = list.front().contains("depth");
  const char* key = by_depth ? "depth" : "load";
  std::vector<Knot>& knots = block.knots;
  block.drive = by_depth ? Drive::displacement : Drive::force;
  for (const Json& entry : list) {
    const DocumentPlace here = place.key(std::to_string(knots.size()));
    if (entry.size() != 2 || !entry.contains(key)) {
      throw bad_input(here.where, "is another thing than the first",
                      fmt::format("a time and a {}, as in the first", key));
    }
    knots.push_back(
        {quantity_at(entry, "time", Dimension::time, here),
         quantity_at(entry, key, by_depth ? Dimension::length : Dimension::force, here)});
  }
}

double in_range(double value, const ProtocolKey& key, const DocumentPlace& at_key) {
  if (key.may_be_zero ? value >= 0.0 : value > 0.0) return value;
  throw bad_input(
      at_key.where, fmt::format("{} {}", shortest(value), si_symbol(key.dimension)),
      key.may_be_zero ? fmt::format("0 {} or more", si_symbol(key.dimension)) : "a value above 0");
}

/// Throws unless a number is there and in range.
double number_of(const ProtocolBlock& block, const ProtocolKey& key, const DocumentPlace& place) {
  const std::optional<double>& value = block.*key.value;
  if (value) return in_range(*value, key, place.key(key.text));
  throw bad_input(
      place.key(key.text).where, "is missing",
      fmt::format("a {} for '{}'", key.text, entry_of(kProtocolKindWords, block.kind).text));
}

/// Of a list of quantities, or of one.
std::vector<double> numbers_of(const Json& list, const ProtocolKey& key, const DocumentPlace& at) {
  if (!list.is_array()) {
    return {in_range(quantity_of(list, key.dimension, at.where), key, at)};
  }
  std::vector<double> values;
  values.reserve(list.size());
  for (const Json& entry : list) {
    const DocumentPlace here = at.key(std::to_string(values.size()));
    values.push_back(in_range(quantity_of(entry, key.dimension, here.where), key, here));
  }
  return values;
}

void require_known_keys(const Json& block, const DocumentPlace& place, ProtocolKind kind,
                        Openness openness, std::vector<std::string_view> names,
                        std::vector<std::string_view> others) {
  if (openness == Openness::open) {
    others.insert(others.begin(), names.begin(), names.end());
    names.clear();
  }
  require_keys_of(block, entry_of(kProtocolKindWords, kind).text, names, others, place);
}

Protocol protocol_of_knots(const std::vector<Knot>& knots, Drive drive,
                           const DocumentPlace& place) {
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (knots[i].time_s >= knots[i - 1].time_s) continue;
    throw bad_input(place.key(std::to_string(i)).where, "is earlier than the one before",
                    "times that do not fall");
  }
  if (!(knots.back().time_s > knots.front().time_s)) {
    throw bad_input(place.where, "take no time", "a last knot later than the first");
  }
  return {drive, knots, place.where};
}

}  // namespace

std::vector<ProtocolKey> protocol_keys(ProtocolKind kind) {
  switch (kind) {
    case ProtocolKind::ramp_hold:
      return {kDepthKey, kRateKey, kHoldKey};
    case ProtocolKind::step_hold:
      return {kDepthKey, kStepHoldKey};
    case ProtocolKind::creep:
      return {kLoadKey, kDurationKey};
    case ProtocolKind::knots:
      break;
  }
  return {};
}

std::optional<double>* ProtocolBlock::find(std::string_view key) {
  for (const ProtocolKey& known : protocol_keys(kind)) {
    if (known.text == key) return &(this->*known.value);
  }
  return nullptr;
}

double ProtocolBlock::number(std::string_view key, const DocumentPlace& place) const {
  for (const ProtocolKey& known : protocol_keys(kind)) {
    if (known.text == key) return number_of(*this, known, place);
  }
  throw std::logic_error("no such key of a protocol");
}

Protocol ProtocolBlock::protocol(const DocumentPlace& place) const {
  std::array<double, 3> number{};  // in the order of the keys
  std::size_t count = 0;
  for (const ProtocolKey& key : protocol_keys(kind))
    number.at(count++) = number_of(*this, key, place);
  switch (kind) {
    case ProtocolKind::ramp_hold:
      return ramp_and_hold(number[0], number[1], number[2]);
    case ProtocolKind::step_hold:
      return step_and_hold(number[0], number[1]);
    case ProtocolKind::creep:
      return creep(number[0], number[1]);
    case ProtocolKind::knots:
      break;
  }
  return protocol_of_knots(knots, drive, place.key("knots"));
}

ProtocolBlock parse_protocol_block(const Json& block, const DocumentPlace& place, Openness openness,
                                   std::optional<ProtocolKind> kind) {
  ProtocolBlock parsed;
  parsed.kind = kind ? *kind
                     : parse_word(kProtocolKindWords, "protocol", block.value("kind", ""),
                                  place.key("kind").where);
  const bool by_knots = parsed.kind == ProtocolKind::knots;
  const std::vector<ProtocolKey> keys = protocol_keys(parsed.kind);
  std::vector<std::string_view> names;
  for (const ProtocolKey& key : keys) names.push_back(key.text);
  if (by_knots) names.emplace_back("knots");
  require_known_keys(block, place, parsed.kind, openness, std::move(names), {});
  for (const ProtocolKey& key : keys) {
    if (!block.contains(key.text)) continue;
    parsed.*key.value = quantity_at(block, key.text, key.dimension, place);
  }
  if (by_knots && block.contains("knots"))
    read_knots(block.at("knots"), place.key("knots"), parsed);
  return parsed;
}

std::vector<ProtocolBlock> parse_protocol_lists(const Json& block, const DocumentPlace& place,
                                                ProtocolKind kind, Openness openness,
                                                std::initializer_list<ProtocolKeyName> renamed,
                                                const std::vector<std::string_view>& others) {
  constexpr std::size_t kMost = 100'000;
  const std::vector<ProtocolKey> keys = protocol_keys(kind);
  std::vector<std::string_view> names;
  for (const ProtocolKey& key : keys) {
    const auto* other = std::find_if(renamed.begin(), renamed.end(),
                                     [&](const ProtocolKeyName& n) { return n.key == key.text; });
    names.push_back(other == renamed.end() ? key.text : other->in_file);
  }
  require_known_keys(block, place, kind, openness, names, others);
  std::vector<ProtocolBlock> all(1);
  all.front().kind = kind;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (!block.contains(names[k])) continue;
    const std::vector<double> values =
        numbers_of(block.at(std::string(names[k])), keys[k], place.key(names[k]));
    if (values.size() > kMost / std::max<std::size_t>(1, all.size())) {
      throw bad_input(place.where,
                      fmt::format("{} times {} experiments", all.size(), values.size()),
                      fmt::format("at most {}", kMost));
    }
    std::vector<ProtocolBlock> longer;
    longer.reserve(all.size() * values.size());
    for (const ProtocolBlock& one : all) {
      for (const double value : values) {
        longer.push_back(one);
        longer.back().*keys[k].value = value;
      }
    }
    all = std::move(longer);
  }
  return all;
}

}  // namespace tpm::files
