#include "tpm/files/blocks/protocol_block.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Number = std::optional<double> ProtocolBlock::*;

/// A number of a protocol.
struct NumberKey {
  const char* name;
  Dimension dimension;
  Range range;
  Number value;
  std::vector<double> ProtocolLists::*list;
  const char* sentence;
  const char* example;
};

constexpr NumberKey kDepthOfPush{"depth",
                                 Dimension::length,
                                 kAboveZero,
                                 &ProtocolBlock::depth_m,
                                 &ProtocolLists::depths_m,
                                 "how deep the tissue is indented",
                                 "8 mm"};
constexpr NumberKey kRateOfPush{"rate",
                                Dimension::speed,
                                kAboveZero,
                                &ProtocolBlock::rate_m_per_s,
                                &ProtocolLists::rates_m_per_s,
                                "speed of the ramp",
                                "4 mm/s"};
constexpr NumberKey kHold{"hold",
                          Dimension::time,
                          kZeroOrMore,
                          &ProtocolBlock::hold_s,
                          &ProtocolLists::holds_s,
                          "how long the depth is held",
                          "30 s"};
constexpr NumberKey kStepHold{"hold",
                              Dimension::time,
                              kAboveZero,
                              &ProtocolBlock::hold_s,
                              &ProtocolLists::holds_s,
                              "how long the depth is held",
                              "30 s"};
constexpr NumberKey kLoad{
    "load",      Dimension::force, kAboveZero, &ProtocolBlock::load_N, &ProtocolLists::loads_N,
    "the force", "0.1 N"};
constexpr NumberKey kDuration{"duration",
                              Dimension::time,
                              kAboveZero,
                              &ProtocolBlock::duration_s,
                              &ProtocolLists::durations_s,
                              "how long the load is kept",
                              "30 s"};

std::vector<NumberKey> numbers_of(ProtocolKind kind) {
  switch (kind) {
    case ProtocolKind::ramp_hold:
      return {kDepthOfPush, kRateOfPush, kHold};
    case ProtocolKind::step_hold:
      return {kDepthOfPush, kStepHold};
    case ProtocolKind::creep:
      return {kLoad, kDuration};
    case ProtocolKind::knots:
      break;
  }
  return {};
}

constexpr const char* kAlike = "a time and a depth each, or a time and a load each";
constexpr const char* kNoFall = "times that do not fall";
constexpr const char* kTakesTime = "a last knot later than the first";

/// A corner as a file says it.
struct KnotKeys {
  double time_s = 0.0;
  std::optional<double> depth_m, load_N;
};

const Block<KnotKeys>& knot_block() {
  static const Block<KnotKeys> block(
      "knot", "a corner of the history",
      {required(key("time", &KnotKeys::time_s, quantity(Dimension::time), "when")),
       key("depth", &KnotKeys::depth_m, quantity(Dimension::length), "how deep"),
       key("load", &KnotKeys::load_N, quantity(Dimension::force), "the force")});
  return block;
}

/// The corners, which set the block's drive, too.
Key<ProtocolBlock> knots_key() {
  constexpr std::size_t kMost = 100'000;
  const auto corners = list(knot_block().type(), {.fewest = 2, .most = kMost});
  Form form = *corners.form;
  form.rules = {kAlike, kNoFall, kTakesTime};
  const auto read = [corners](ProtocolBlock& block, const Json& value, const DocumentPlace& place) {
    const std::vector<KnotKeys> all = corners.read(value, place);
    const bool by_depth = all.front().depth_m.has_value();
    block.drive = by_depth ? Drive::displacement : Drive::force;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const KnotKeys& one = all[i];
      if (one.depth_m.has_value() != by_depth || one.load_N.has_value() == by_depth) {
        throw bad_input(place.key(std::to_string(i)).where, "is another thing than the first",
                        kAlike);
      }
      block.knots.push_back({one.time_s, by_depth ? *one.depth_m : *one.load_N});
    }
  };
  const auto write = [corners](const ProtocolBlock& block) {
    return corners.write(mapped<KnotKeys>(block.knots, [&](const Knot& knot) {
      return block.drive == Drive::displacement ? KnotKeys{knot.time_s, knot.value, {}}
                                                : KnotKeys{knot.time_s, {}, knot.value};
    }));
  };
  return required(Key<ProtocolBlock>{
      {.name = "knots",
       .form = shared(std::move(form)),
       .sentence = "corners of a history that is linear between them; two at one time are a jump"},
      read,
      write});
}

std::vector<Key<ProtocolBlock>> keys_of(ProtocolKind kind) {
  std::vector<Key<ProtocolBlock>> keys;
  for (const NumberKey& n : numbers_of(kind)) {
    keys.push_back(required(
        with_example(key(n.name, n.value, quantity(n.dimension, n.range), n.sentence), n.example)));
  }
  if (kind == ProtocolKind::knots) keys.push_back(knots_key());
  return keys;
}

double in_range(const ProtocolBlock& block, const NumberKey& key, const DocumentPlace& place) {
  const std::optional<double>& value = block.*key.value;
  const std::string_view unit = si_symbol(key.dimension);
  if (!value) {
    throw bad_input(
        place.key(key.name).where, "is missing",
        fmt::format("a {} for '{}'", key.name, entry_of(kProtocolKindWords, block.kind).text));
  }
  if (key.range.holds(*value)) return *value;
  throw bad_input(place.key(key.name).where, fmt::format("{} {}", shortest(*value), unit),
                  key.range.words(unit));
}

Protocol protocol_of_knots(const std::vector<Knot>& knots, Drive drive,
                           const DocumentPlace& place) {
  for (std::size_t i = 1; i < knots.size(); ++i) {
    if (knots[i].time_s >= knots[i - 1].time_s) continue;
    throw bad_input(place.key(std::to_string(i)).where, "is earlier than the one before", kNoFall);
  }
  if (!(knots.back().time_s > knots.front().time_s)) {
    throw bad_input(place.where, "take no time", kTakesTime);
  }
  return {drive, knots, place.where};
}

/// The form of a block whose place in the file says its kind.
Form form_of_kind(ProtocolKind kind, Openness openness) {
  Form form{.type = Form::Type::block};
  form.keys = mapped<KeyForm>(keys_of(kind), &Key<ProtocolBlock>::form);
  return openness == Openness::open ? with_open_keys(std::move(form)) : form;
}

}  // namespace

const Kinds<ProtocolBlock, ProtocolKind>& protocol_kinds() {
  const auto kind = [](ProtocolKind meaning, const char* sentence) {
    return Kind<ProtocolBlock, ProtocolKind>{
        meaning, std::string(entry_of(kProtocolKindWords, meaning).text), sentence,
        keys_of(meaning)};
  };
  static const Kinds<ProtocolBlock, ProtocolKind> kinds(
      {.name = "protocol", .sentence = "what is imposed, from rest on"}, &ProtocolBlock::kind,
      {kind(ProtocolKind::ramp_hold, "a ramp to a depth, which is then held"),
       kind(ProtocolKind::step_hold, "a jump to a depth, which is then held"),
       kind(ProtocolKind::creep, "a load, applied as a step and kept"),
       kind(ProtocolKind::knots, "a history that is linear between corners")});
  return kinds;
}

std::optional<double>* ProtocolBlock::find(std::string_view key) {
  for (const NumberKey& known : numbers_of(kind)) {
    if (known.name == key) return &(this->*known.value);
  }
  return nullptr;
}

double ProtocolBlock::number(std::string_view key, const DocumentPlace& place) const {
  for (const NumberKey& known : numbers_of(kind)) {
    if (known.name == key) return in_range(*this, known, place);
  }
  throw std::logic_error("no such key of a protocol");
}

Protocol ProtocolBlock::protocol(const DocumentPlace& place) const {
  std::vector<double> number;  // in the order of the keys
  for (const NumberKey& key : numbers_of(kind)) number.push_back(in_range(*this, key, place));
  try {
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
  } catch (const Error& error) {  // knows neither the file nor the key
    throw error.within(place.where);
  }
  return protocol_of_knots(knots, drive, place.key("knots"));
}

ProtocolBlock parse_protocol_block(const Json& block, const DocumentPlace& place, Openness openness,
                                   std::optional<ProtocolKind> kind) {
  if (!kind) {
    const Form& form = *protocol_kinds().form();
    require_form(block, openness == Openness::open ? with_open_keys(form) : form, place,
                 Numbers::also_si);
    return protocol_kinds().made(block, place);
  }
  require_form(block, form_of_kind(*kind, openness), place, Numbers::also_si);
  ProtocolBlock parsed;
  parsed.kind = *kind;
  read_keys(protocol_kinds().keys(*kind), block, place, parsed);
  return parsed;
}

std::vector<Key<ProtocolLists>> protocol_list_keys(ProtocolKind kind,
                                                   std::initializer_list<ProtocolKeyName> renamed) {
  std::vector<Key<ProtocolLists>> keys;
  for (const NumberKey& n : numbers_of(kind)) {
    const auto* other = std::find_if(renamed.begin(), renamed.end(), [&](const ProtocolKeyName& r) {
      return r.key == std::string_view(n.name);
    });
    const std::string name(other == renamed.end() ? n.name : other->in_file);
    const auto values = list(quantity(n.dimension, n.range), {.fewest = 1, .one_too = true});
    keys.push_back(required(with_example(key(name, n.list, values, n.sentence), n.example)));
  }
  return keys;
}

std::vector<ProtocolBlock> combinations(ProtocolKind kind, const ProtocolLists& lists,
                                        const DocumentPlace& place) {
  constexpr std::size_t kMost = 100'000;
  std::vector<ProtocolBlock> all(1);
  all.front().kind = kind;
  for (const NumberKey& n : numbers_of(kind)) {
    const std::vector<double>& values = lists.*n.list;
    if (values.empty()) continue;
    if (values.size() > kMost / all.size()) {
      throw bad_input(place.where,
                      fmt::format("{} times {} experiments", all.size(), values.size()),
                      fmt::format("at most {}", kMost));
    }
    std::vector<ProtocolBlock> longer;
    longer.reserve(all.size() * values.size());
    for (const ProtocolBlock& one : all) {
      for (const double value : values) {
        longer.push_back(one);
        longer.back().*n.value = value;
      }
    }
    all = std::move(longer);
  }
  return all;
}

}  // namespace tpm::files
