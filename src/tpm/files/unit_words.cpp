#include "tpm/files/unit_words.hpp"

#include <algorithm>
#include <array>

namespace tpm::files {
namespace {

struct UnitWord {
  std::string_view written, unit;
};

/// In small letters. Not those that the case tells apart, as mPa and MPa.
constexpr auto kUnitWords = std::to_array<UnitWord>({
    {"sec", "s"},
    {"secs", "s"},
    {"second", "s"},
    {"seconds", "s"},
    {"sek", "s"},
    {"sekunde", "s"},
    {"sekunden", "s"},
    {"seconde", "s"},
    {"secondes", "s"},
    {"segundo", "s"},
    {"segundos", "s"},
    {"secondi", "s"},
    {"msec", "ms"},
    {"millisecond", "ms"},
    {"milliseconds", "ms"},
    {"millisekunden", "ms"},
    {"mins", "min"},
    {"minute", "min"},
    {"minutes", "min"},
    {"minuten", "min"},
    {"hour", "h"},
    {"hours", "h"},
    {"stunden", "h"},
    {"newton", "N"},
    {"newtons", "N"},
    {"millinewton", "mN"},
    {"millinewtons", "mN"},
    {"kilonewton", "kN"},
    {"kilonewtons", "kN"},
    {"kn", "kN"},
    {"lbf", "lbf"},
    {"meter", "m"},
    {"meters", "m"},
    {"metre", "m"},
    {"metres", "m"},
    {"millimeter", "mm"},
    {"millimeters", "mm"},
    {"millimetre", "mm"},
    {"millimetres", "mm"},
    {"mm", "mm"},
    {"micrometer", "um"},
    {"micrometers", "um"},
    {"micrometre", "um"},
    {"micrometres", "um"},
    {"mikrometer", "um"},
    {"nanometer", "nm"},
    {"nanometers", "nm"},
    {"nanometre", "nm"},
    {"nanometres", "nm"},
    {"inch", "in"},
    {"inches", "in"},
    {"micron", "um"},
    {"microns", "um"},
    {"psi", "psi"},
    {"kpa", "kPa"},
    {"pascal", "Pa"},
    {"percent", "%"},
    {"prozent", "%"},
    {"mils", "mil"},
    {"thou", "mil"},
    {"dyne", "dyn"},
    {"dynes", "dyn"},
    {"grf", "gf"},
    {"gmf", "gf"},
    {"gram-force", "gf"},
    {"grams-force", "gf"},
    {"gram force", "gf"},
    {"grams force", "gf"},
    {"kg-f", "kgf"},
    {"kgs-f", "kgf"},
    {"lb-f", "lbf"},
    {"lbs-f", "lbf"},
    {"lbsf", "lbf"},
    {"pound-force", "lbf"},
    {"pounds-force", "lbf"},
    {"pound force", "lbf"},
    {"pounds force", "lbf"},
    {"kilogram-force", "kgf"},
    {"kilogram force", "kgf"},

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

struct RecordedUnit {
  std::string_view unit;
  Dimension dimension;
};

/// Units in which recordings of specimens are written.
constexpr auto kRecorded = std::to_array<RecordedUnit>({
    {"s", Dimension::time},      {"ms", Dimension::time},    {"us", Dimension::time},
    {"min", Dimension::time},    {"h", Dimension::time},     {"m", Dimension::length},
    {"cm", Dimension::length},   {"mm", Dimension::length},  {"um", Dimension::length},
    {"nm", Dimension::length},   {"in", Dimension::length},  {"ft", Dimension::length},
    {"mil", Dimension::length},  {"N", Dimension::force},    {"mN", Dimension::force},
    {"uN", Dimension::force},    {"nN", Dimension::force},   {"pN", Dimension::force},
    {"cN", Dimension::force},    {"daN", Dimension::force},  {"kN", Dimension::force},
    {"MN", Dimension::force},    {"gf", Dimension::force},   {"mgf", Dimension::force},
    {"kgf", Dimension::force},   {"lbf", Dimension::force},  {"ozf", Dimension::force},
    {"dyn", Dimension::force},   {"Pa", Dimension::stress},  {"mPa", Dimension::stress},
    {"hPa", Dimension::stress},  {"kPa", Dimension::stress}, {"MPa", Dimension::stress},
    {"GPa", Dimension::stress},  {"bar", Dimension::stress}, {"mbar", Dimension::stress},
    {"mmHg", Dimension::stress}, {"psi", Dimension::stress}, {"ksi", Dimension::stress},
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

std::vector<std::string> units_in_any_case(std::string_view text,
                                           const std::function<bool(Dimension)>& is_fitting) {
  const std::string small = in_small_letters(text);
  std::vector<std::string> units;
  for (const RecordedUnit& known : kRecorded) {
    if (in_small_letters(known.unit) != small || !is_fitting(known.dimension)) continue;
    units.emplace_back(known.unit);
  }
  return units;
}

}  // namespace tpm::files
