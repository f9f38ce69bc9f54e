#include "tpm/files/import/jpk_segment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

constexpr std::string_view kBlank = " \t\f";

/// Takes the next line off `text`, without its end.
std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line.substr(std::min(line.find_first_not_of(kBlank), line.size()));
}

bool is_continued(std::string_view line) {
  const std::size_t last = line.find_last_not_of('\\');
  const std::size_t backslashes = line.size() - (last == std::string_view::npos ? 0 : last + 1);
  return backslashes % 2 == 1;
}

/// Where the key of a line ends: at a separator that is not escaped.
std::size_t end_of_key(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\') {
      ++i;
    } else if (line[i] == '=' || line[i] == ':' || kBlank.find(line[i]) != kBlank.npos) {
      return i;
    }
  }
  return line.size();
}

/// Without the backslashes. What the importer reads is ASCII: \uXXXX in comments stays as it is.
std::string unescaped(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape = text[i] == '\\' && i + 1 < text.size() && text[i + 1] != 'u';
    plain += text[escape ? ++i : i];
  }
  return plain;
}

std::string_view value_after(std::string_view line, std::size_t key_end) {
  const auto skip_blank = [&line](std::size_t at) {
    return std::min(line.find_first_not_of(kBlank, at), line.size());
  };
  std::size_t at = skip_blank(key_end);
  if (at < line.size() && (line[at] == '=' || line[at] == ':')) at = skip_blank(at + 1);
  return line.substr(at);
}

}  // namespace

PropertyMap parse_properties(std::string_view text) {
  PropertyMap properties;
  while (!text.empty()) {
    std::string line(next_line(text));
    if (line.empty() || line.front() == '#' || line.front() == '!') continue;
    while (is_continued(line)) {
      line.pop_back();
      line += next_line(text);
    }
    const std::size_t end = end_of_key(line);
    properties[unescaped(std::string_view(line).substr(0, end))] =
        unescaped(value_after(line, end));
  }
  return properties;
}

JpkProperties::JpkProperties(PropertyMap own, const PropertyMap& shared, std::string place)
    : own_(std::move(own)), shared_(&shared), place_(std::move(place)) {
  for (const auto& [key, number] : own_) {
    if (!key.ends_with(".*")) continue;
    const std::string_view path = std::string_view(key).substr(0, key.size() - 2);
    const std::size_t dot = path.rfind('.');
    if (dot == std::string_view::npos) continue;
    references_.push_back({std::string(path.substr(0, dot + 1)),
                           fmt::format("{}.{}.", path.substr(dot + 1), number)});
  }
}

std::optional<std::string> JpkProperties::find(std::string_view key) const {
  if (const auto own = own_.find(key); own != own_.end()) return own->second;
  for (const Reference& reference : references_) {
    if (!key.starts_with(reference.head)) continue;
    const auto shared =
        shared_->find(reference.block + std::string(key.substr(reference.head.size())));
    if (shared != shared_->end()) return shared->second;
  }
  return std::nullopt;
}

std::optional<std::string> JpkProperties::find_any(std::initializer_list<std::string> keys) const {
  for (const std::string& key : keys) {
    if (auto value = find(key)) return value;
  }
  return std::nullopt;
}

std::string JpkProperties::text(std::string_view key) const {
  if (auto value = find(key)) return *std::move(value);
  throw bad_input(place_of(key), "is missing", "a complete JPK force file");
}

double JpkProperties::number(std::string_view key) const {
  return parse_number(text(key), place_of(key));
}

std::string JpkProperties::place_of(std::string_view key) const {
  return fmt::format("{}: key {}", place_, printable(key, 120));
}

namespace {

/// Storage of one sample.
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
