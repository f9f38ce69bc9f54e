#include "tpm/files/unit_words.hpp"

#include <algorithm>
#include <array>

#include "tpmkit/units.hpp"

namespace tpm::files {
namespace {

struct UnitWord {
  std::string_view written, unit;
};

/// In small letters. Not those that the case tells apart, as mPa and MPa.
constexpr auto kUnitWords = std::to_array<UnitWord>({
    {"sec", "s"},          {"secs", "s"},         {"second", "s"},        {"seconds", "s"},
    {"sek", "s"},          {"sekunde", "s"},      {"sekunden", "s"},      {"seconde", "s"},
    {"secondes", "s"},     {"segundo", "s"},      {"segundos", "s"},      {"secondi", "s"},
    {"msec", "ms"},        {"millisecond", "ms"}, {"milliseconds", "ms"}, {"millisekunden", "ms"},
    {"mins", "min"},       {"minute", "min"},     {"minutes", "min"},     {"minuten", "min"},
    {"hour", "h"},         {"hours", "h"},        {"stunden", "h"},       {"newton", "N"},
    {"newtons", "N"},      {"millinewton", "mN"}, {"millinewtons", "mN"}, {"kilonewton", "kN"},
    {"kilonewtons", "kN"}, {"kn", "kN"},          {"lbf", "lbf"},         {"meter", "m"},
    {"meters", "m"},       {"metre", "m"},        {"metres", "m"},        {"millimeter", "mm"},
    {"millimeters", "mm"}, {"millimetre", "mm"},  {"millimetres", "mm"},  {"mm", "mm"},
    {"micrometer", "um"},  {"micrometers", "um"}, {"micrometre", "um"},   {"micrometres", "um"},
    {"mikrometer", "um"},  {"nanometer", "nm"},   {"nanometers", "nm"},   {"nanometre", "nm"},
    {"nanometres", "nm"},  {"inch", "in"},        {"inches", "in"},       {"micron", "um"},
    {"microns", "um"},     {"psi", "psi"},        {"kpa", "kPa"},         {"pascal", "Pa"},
    {"percent", "%"},      {"prozent", "%"},
});

constexpr auto kWeights = std::to_array<UnitWord>({
    {"g", "gf"},
    {"gr", "gf"},
    {"gram", "gf"},
    {"grams", "gf"},
    {"gramm", "gf"},
    {"kg", "kgf"},
    {"kp", "kgf"},
    {"kilogram", "kgf"},
    {"kilograms", "kgf"},
    {"kilogramm", "kgf"},
    {"mg", "mgf"},
    {"lb", "lbf"},
    {"lbs", "lbf"},
    {"pound", "lbf"},
    {"pounds", "lbf"},
    {"oz", "ozf"},
});

std::string in_small_letters(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return small;
}

}  // namespace

std::string written_unit(std::string_view text) {
  std::string_view name = text;
  while (name.size() > 1 && name.ends_with('.')) name.remove_suffix(1);
  if (name.empty() || is_unit(name)) return std::string(name);
  const std::string small = in_small_letters(name);
  const auto known = std::ranges::find(kUnitWords, small, &UnitWord::written);
  return std::string(known == kUnitWords.end() ? text : known->unit);
}

std::optional<std::string> force_of_weight(std::string_view text) {
  if (text.empty() || is_unit(text)) return std::nullopt;
  const auto known = std::ranges::find(kWeights, in_small_letters(text), &UnitWord::written);
  if (known == kWeights.end()) return std::nullopt;
  return std::string(known->unit);
}

}  // namespace tpm::files
