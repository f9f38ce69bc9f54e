#include "tpm/files/import/jpk_channel.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

/// How one sample is stored.
struct StoredNumber {
  std::string_view word;  ///< "encoder.type" of the file, or "type" where there is no encoder
  std::size_t bytes;
  double (*decode)(std::uint64_t bits);
};

template <typename Integer>
double integer_of(std::uint64_t bits) {
  return static_cast<double>(static_cast<Integer>(bits));
}

double float_of(std::uint64_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
}

double double_of(std::uint64_t bits) {
  return std::bit_cast<double>(bits);
}

constexpr std::array<StoredNumber, 10> kStoredNumbers{{
    {"signedshort", 2, integer_of<std::int16_t>},
    {"unsignedshort", 2, integer_of<std::uint16_t>},
    {"signedinteger", 4, integer_of<std::int32_t>},
    {"unsignedinteger", 4, integer_of<std::uint32_t>},
    {"signedlong", 8, integer_of<std::int64_t>},
    {"unsignedlong", 8, integer_of<std::uint64_t>},
    {"float", 4, float_of},
    {"float-data", 4, float_of},
    {"double", 8, double_of},
    {"double-data", 8, double_of},
}};

std::string key_of(const std::string& channel, std::string_view rest) {
  return fmt::format("channel.{}.{}", channel, rest);
}

/// The block of a channel's encoder; empty if its samples are plain numbers.
std::string encoder_block(const JpkProperties& properties, const std::string& channel) {
  for (const char* block : {"data.encoder.", "encoder."}) {
    std::string key = key_of(channel, block);
    if (properties.find(key + "type")) return key;
  }
  return {};
}

const StoredNumber& encoding_of(const JpkProperties& properties, const std::string& channel,
                                const std::string& encoder) {
  const std::string key = encoder.empty() ? key_of(channel, "data.type") : encoder + "type";
  std::string word =
      encoder.empty() ? properties.find_any({key, key_of(channel, "type")}).value_or("of no type")
                      : properties.text(key);
  constexpr std::string_view kLimited = "-limited";  // marks samples that were cut off; same bytes
  if (word.ends_with(kLimited)) word.resize(word.size() - kLimited.size());
  for (const StoredNumber& encoding : kStoredNumbers) {
    if (encoding.word == word) return encoding;
  }
  throw bad_input(properties.place_of(key),
                  fmt::format("samples stored as '{}' are not read", printable(word)),
                  "short, integer, long, float or double");
}

void require_linear(const JpkProperties& properties, const std::string& scaling) {
  for (const auto& [key, only] : {std::pair{"type", "linear"}, {"style", "offsetmultiplier"}}) {
    const std::string value = properties.find(scaling + key).value_or(only);
    if (value == only) continue;
    throw bad_input(properties.place_of(scaling + key), fmt::format("'{}'", printable(value)),
                    fmt::format("'{}': other scalings are not read", only));
  }
}

JpkConversion scaling_of(const JpkProperties& properties, const std::string& scaling) {
  require_linear(properties, scaling);
  return {properties.number(scaling + "multiplier"), properties.number(scaling + "offset")};
}

/// From what is stored to a slot, through the slots between.
JpkConversion conversion_to(const JpkProperties& properties, const std::string& channel,
                            std::string slot) {
  const std::string base = properties.text(key_of(channel, "conversion-set.conversions.base"));
  JpkConversion chain;
  for (int step = 0; slot != base; ++step) {
    const std::string block =
        key_of(channel, fmt::format("conversion-set.conversion.{}.", printable(slot, 200)));
    constexpr int kLongestChain = 16;
    if (step == kLongestChain) {
      throw bad_input(properties.place_of(block + "base-calibration-slot"),
                      "conversions refer to each other in a circle",
                      fmt::format("a chain that ends at '{}'", printable(base)));
    }
    const JpkConversion inner = scaling_of(properties, block + "scaling.");
    chain = {chain.multiplier * inner.multiplier, chain(inner.offset)};
    slot = properties.text(block + "base-calibration-slot");
  }
  return chain;
}

std::vector<std::string> slot_words(std::string_view text) {
  std::vector<std::string> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (end > 0) words.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

}  // namespace

bool has_jpk_channel(const JpkProperties& properties, const std::string& channel) {
  return properties.find(key_of(channel, "data.file.name")).has_value();
}

std::optional<JpkConversion> find_jpk_conversion(const JpkProperties& properties,
                                                 const std::string& channel,
                                                 std::string_view unit) {
  const std::string set = key_of(channel, "conversion-set.");
  std::vector<std::string> slots =
      slot_words(properties.find(set + "conversions.list").value_or(""));
  slots.insert(slots.begin(), properties.find(set + "conversions.default").value_or(""));
  for (const std::string& slot : slots) {
    const std::string block = fmt::format("{}conversion.{}.", set, slot);
    if (properties.find(block + "defined").value_or("false") != "true") continue;
    const auto found = properties.find_any({block + "scaling.unit.unit", block + "scaling.unit"});
    if (found == unit) return conversion_to(properties, channel, slot);
  }
  return std::nullopt;
}

std::vector<double> read_jpk_channel(const ZipArchive& archive, const std::string& folder,
                                     const JpkProperties& properties, const std::string& channel,
                                     std::size_t samples) {
  const std::string encoder = encoder_block(properties, channel);
  const StoredNumber& encoding = encoding_of(properties, channel, encoder);
  const JpkConversion decoded =
      encoder.empty() ? JpkConversion{} : scaling_of(properties, encoder + "scaling.");
  const std::string member = folder + properties.text(key_of(channel, "data.file.name"));
  const std::size_t size = samples * encoding.bytes;
  const std::string bytes = archive.read(member, size);
  const std::string place = fmt::format("{}: {}", archive.file(), printable(member, 120));
  if (bytes.size() != size) {
    throw bad_input(place, fmt::format("holds {} bytes", bytes.size()),
                    fmt::format("{}: {} samples of {} bytes", size, samples, encoding.bytes));
  }
  std::vector<double> values(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    std::uint64_t bits = 0;
    for (std::size_t b = 0; b < encoding.bytes; ++b) {
      bits = bits << 8U | static_cast<unsigned char>(bytes[i * encoding.bytes + b]);
    }
    values[i] = decoded(encoding.decode(bits));
    if (!std::isfinite(values[i])) {
      throw bad_input(place, fmt::format("sample {} is not finite", i + 1), "numbers");
    }
  }
  return values;
}

}  // namespace tpm::files
