#include "tpm/files/instrument.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

std::string limit_expected(std::string_view own) {
  return fmt::format(
      "a limit such as \"0.5 % of {}\"{} or an amount with its unit, and \"(standard)\" or \"(k = "
      "2)\" if it is an uncertainty",
      own, own == "reading" ? ", \"0.1 % of range\"" : "");
}

/// Divisor of the limit; removes its words from the text.
double divisor_of(std::string_view& text, std::string_view where, std::string_view own) {
  text = trimmed(text);
  if (!text.ends_with(')')) return std::numbers::sqrt3;
  const auto open = text.rfind('(');
  if (open == std::string_view::npos)
    throw bad_input(where, "an unopened bracket", limit_expected(own));
  const std::string_view inside = trimmed(text.substr(open + 1, text.size() - open - 2));
  text = trimmed(text.substr(0, open));
  if (inside == "standard" || inside == "standard uncertainty" || inside == "k = 1" ||
      inside == "k=1") {
    return 1.0;
  }
  if (inside == "k = 2" || inside == "k=2") return 2.0;
  throw bad_input(where, fmt::format("'({})'", printable(inside)), limit_expected(own));
}

void add_part(ChannelUncertainty& u, std::string_view text, Dimension dimension,
              std::optional<double> range, std::string_view where, std::string_view own) {
  const double divisor = divisor_of(text, where, own);
  const std::string of_own_words = fmt::format("of {}", own);
  constexpr std::string_view kRange = "of range";
  const bool of_own = text.ends_with(of_own_words),
             of_range = own == "reading" && text.ends_with(kRange);
  if (!of_own && !of_range) {
    if (text.find('%') != std::string_view::npos) {
      throw bad_input(where, fmt::format("'{}' says a share of what", printable(text)),
                      limit_expected(own));
    }
    const double limit = parse_quantity(text, dimension, where) / divisor;
    if (limit < 0.0) throw bad_input(where, "is negative", "0 or more");
    u.absolute = std::hypot(u.absolute, limit);
    return;
  }
  const std::string_view share_text =
      trimmed(text.substr(0, text.size() - (of_own ? of_own_words.size() : kRange.size())));
  std::string packed(share_text);
  std::erase(packed, ' ');
  const std::optional<double> share = find_share(packed);
  if (!share || !packed.ends_with('%') || *share < 0.0) {
    throw bad_input(where, fmt::format("'{}'", printable(text)), limit_expected(own));
  }
  if (of_own) {
    u.relative = std::hypot(u.relative, *share / divisor);
    return;
  }
  if (!range) {
    throw bad_input(where, "a share of a range that is not stated",
                    "\"force_range\" or \"depth_range\" beside it, such as \"10 N\"");
  }
  u.absolute = std::hypot(u.absolute, *share * *range / divisor);
}

}  // namespace

ChannelUncertainty parse_channel_uncertainty(std::string_view text, Dimension dimension,
                                             std::optional<double> range, std::string_view where,
                                             std::string_view own) {
  ChannelUncertainty u;
  // A plus sign within a number is no mark between parts: "1e+2 um".
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const bool end = i == text.size();
    const bool between =
        !end && text[i] == '+' && i > 0 && text[i - 1] != 'e' && text[i - 1] != 'E';
    if (!end && !between) continue;
    add_part(u, text.substr(begin, i - begin), dimension, range, where, own);
    begin = i + 1;
  }
  return u;
}

Instrument read_instrument(const Json& block, Dimension response, Dimension drive,
                           std::string_view where) {
  if (!block.is_object()) throw bad_input(where, "is no object", "an object with \"id\"");
  constexpr auto kKeys = std::to_array<std::string_view>(
      {"id", "force", "depth", "time", "zero", "resolution", "noise", "force_range", "depth_range",
       "probe", "probe_radius", "radius"});
  Instrument instrument;
  for (const auto& [key, value] : block.items()) {
    const bool known = std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
    const std::string here = fmt::format("{}/{}", where, printable(key));
    if (!known) {
      const std::vector<std::string> keys(kKeys.begin(), kKeys.end());
      throw bad_input(here, "unknown key" + did_you_mean(key, keys),
                      fmt::format("one of {}", fmt::join(keys, ", ")));
    }
    if (!value.is_string()) throw bad_input(here, "is no text", limit_expected("reading"));
    instrument.stated[key] = value.get<std::string>();
  }
  const auto text = [&](const char* key) {
    const auto found = instrument.stated.find(key);
    return found == instrument.stated.end() ? nullptr : &found->second;
  };
  const auto at = [&](const char* key) { return fmt::format("{}/{}", where, key); };
  if (text("id") == nullptr || text("id")->empty()) {
    throw bad_input(at("id"), "is missing", "the name of the instrument");
  }
  instrument.id = *text("id");
  const auto range = [&](const char* key, Dimension dimension) -> std::optional<double> {
    if (text(key) == nullptr) return std::nullopt;
    const double value = parse_quantity(*text(key), dimension, at(key));
    if (!(value > 0.0)) throw bad_input(at(key), "is not positive", "above 0");
    return value;
  };
  const auto channel = [&](const char* key, Dimension dimension,
                           std::optional<double> of) -> std::optional<ChannelUncertainty> {
    if (text(key) == nullptr) return std::nullopt;
    return parse_channel_uncertainty(*text(key), dimension, of, at(key));
  };
  instrument.force = channel("force", response, range("force_range", response));
  instrument.depth = channel("depth", drive, range("depth_range", drive));
  instrument.time = channel("time", Dimension::time, std::nullopt);
  if (const auto zero = channel("zero", response, range("force_range", response))) {
    if (zero->relative > 0.0) {
      throw bad_input(at("zero"), "is a share of a reading", "an amount, or a share of the range");
    }
    instrument.zero = zero->absolute;
  }
  instrument.resolution = range("resolution", response);
  instrument.noise = range("noise", response);
  const bool indents = (response == Dimension::force && drive == Dimension::length) ||
                       (response == Dimension::length && drive == Dimension::force);
  for (const char* key : {"probe", "probe_radius", "radius"}) {
    if (text(key) == nullptr || indents) continue;
    throw bad_input(at(key), "of a recording that is no force over a depth",
                    "a probe where one indents");
  }
  if (text("probe") != nullptr) instrument.probe = *text("probe");
  instrument.probe_radius = range("probe_radius", Dimension::length);
  if (text("radius") != nullptr) {
    const ChannelUncertainty u = parse_channel_uncertainty(*text("radius"), Dimension::length,
                                                           std::nullopt, at("radius"), "radius");
    if (u.absolute > 0.0 && !instrument.probe_radius) {
      throw bad_input(at("radius"), "an amount of a radius that is not stated",
                      "\"probe_radius\" beside it, such as \"2 mm\", or \"0.5 % of radius\"");
    }
    instrument.radius = std::hypot(u.relative, u.absolute / instrument.probe_radius.value_or(1.0));
  }
  return instrument;
}

std::string Instrument::probe_id() const {
  return probe.empty() ? "instrument " + id : "probe " + probe;
}

double Instrument::reading_floor() const {
  return std::max(noise.value_or(0.0), resolution.value_or(0.0) / std::sqrt(12.0));
}

std::optional<Json> instrument_beside(const std::filesystem::path& recording) {
  std::filesystem::path description = recording;
  description.replace_extension(".json");
  std::error_code none;  // its name may be too long where that of the recording is not
  if (!std::filesystem::exists(description, none)) return std::nullopt;
  const Json json = read_json(description);
  if (!json.is_object() || !json.contains("instrument")) return std::nullopt;
  return json.at("instrument");
}

}  // namespace tpm::files
