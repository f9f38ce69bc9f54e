#include "tpmkit/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/quantity_pattern.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm {
using namespace base;

namespace {

/// Units in which the project writes numbers. Of those with one size the first gives its symbol to
/// all.
struct ListedUnit {
  std::string_view symbol;
  Dimension dimension;
  double to_si;
};

constexpr double kPerTurn = 0.15915494309189535;  // 1/(2 pi)
constexpr double kDegree = 0.017453292519943295;  // pi/180
constexpr double kMercury = 133.322387415;        // Pa in 1 mmHg
constexpr double kGram = 9.80665e-3, kMinute = 60.0, kHour = 3600.0, kInch = 0.0254, kFoot = 0.3048;
constexpr double kPoundForce = 4.4482216152605;  // N, exactly
constexpr double kPsi = kPoundForce / (kInch * kInch);

constexpr auto kListed = std::to_array<ListedUnit>({
    {"", Dimension::dimensionless, 1.0},
    {"%", Dimension::dimensionless, 1e-2},
    {"s", Dimension::time, 1.0},
    {"ms", Dimension::time, 1e-3},
    {"us", Dimension::time, 1e-6},
    {"min", Dimension::time, kMinute},
    {"h", Dimension::time, kHour},
    {"m", Dimension::length, 1.0},
    {"cm", Dimension::length, 1e-2},
    {"mm", Dimension::length, 1e-3},
    {"um", Dimension::length, 1e-6},
    {"nm", Dimension::length, 1e-9},
    {"in", Dimension::length, kInch},
    {"m^2", Dimension::area, 1.0},
    {"cm^2", Dimension::area, 1e-4},
    {"mm^2", Dimension::area, 1e-6},
    {"N", Dimension::force, 1.0},
    {"mN", Dimension::force, 1e-3},
    {"uN", Dimension::force, 1e-6},
    {"nN", Dimension::force, 1e-9},
    {"pN", Dimension::force, 1e-12},
    {"kN", Dimension::force, 1e3},
    {"gf", Dimension::force, kGram},
    {"kgf", Dimension::force, 1e3 * kGram},
    {"lbf", Dimension::force, kPoundForce},
    {"Pa", Dimension::stress, 1.0},
    {"kPa", Dimension::stress, 1e3},
    {"MPa", Dimension::stress, 1e6},
    {"GPa", Dimension::stress, 1e9},
    {"mmHg", Dimension::stress, kMercury},
    {"psi", Dimension::stress, kPsi},
    {"Pa s", Dimension::viscosity, 1.0},
    {"kPa s", Dimension::viscosity, 1e3},
    {"m/s", Dimension::speed, 1.0},
    {"mm/s", Dimension::speed, 1e-3},
    {"um/s", Dimension::speed, 1e-6},
    {"mm/min", Dimension::speed, 1e-3 / kMinute},
    {"Hz", Dimension::frequency, 1.0},
    {"kHz", Dimension::frequency, 1e3},
    {"rad/s", Dimension::frequency, kPerTurn},
    {"N/m", Dimension::stiffness, 1.0},
    {"N/mm", Dimension::stiffness, 1e3},
    {"rad", Dimension::angle, 1.0},
    {"deg", Dimension::angle, kDegree},
    {"1/Pa", Dimension::compliance, 1.0},
    {"1/kPa", Dimension::compliance, 1e-3},
    {"1/MPa", Dimension::compliance, 1e-6},
});

/// Powers of metre, kilogram, second and radian.
using Powers = std::array<int, 4>;

struct BaseUnit {
  std::string_view name;
  Powers powers;
  double to_si;
  bool prefixed;  ///< takes the prefixes of the SI
};

constexpr Powers kNone{0, 0, 0, 0}, kTimePowers{0, 0, 1, 0}, kForcePowers{1, 1, -2, 0},
    kStressPowers{-1, 1, -2, 0}, kAnglePowers{0, 0, 0, 1};

constexpr auto kBases = std::to_array<BaseUnit>({
    {"1", kNone, 1.0, false},
    {"-", kNone, 1.0, false},
    {"%", kNone, 1e-2, false},
    {"percent", kNone, 1e-2, false},
    {"s", kTimePowers, 1.0, true},
    {"sec", kTimePowers, 1.0, false},
    {"secs", kTimePowers, 1.0, false},
    {"second", kTimePowers, 1.0, false},
    {"seconds", kTimePowers, 1.0, false},
    {"sek", kTimePowers, 1.0, false},
    {"Sek", kTimePowers, 1.0, false},
    {"msec", kTimePowers, 1e-3, false},
    {"min", kTimePowers, kMinute, false},
    {"mins", kTimePowers, kMinute, false},
    {"minute", kTimePowers, kMinute, false},
    {"minutes", kTimePowers, kMinute, false},
    {"h", kTimePowers, kHour, false},
    {"hr", kTimePowers, kHour, false},
    {"hrs", kTimePowers, kHour, false},
    {"hour", kTimePowers, kHour, false},
    {"hours", kTimePowers, kHour, false},
    {"m", {1, 0, 0, 0}, 1.0, true},
    {"N", kForcePowers, 1.0, true},
    {"newton", kForcePowers, 1.0, false},
    {"daN", kForcePowers, 10.0, false},
    {"dyn", kForcePowers, 1e-5, false},
    {"gf", kForcePowers, kGram, true},
    {"Pa", kStressPowers, 1.0, true},
    {"bar", kStressPowers, 1e5, true},
    {"mmHg", kStressPowers, kMercury, false},
    {"in", {1, 0, 0, 0}, kInch, false},
    {"inch", {1, 0, 0, 0}, kInch, false},
    {"inches", {1, 0, 0, 0}, kInch, false},
    {"\"", {1, 0, 0, 0}, kInch, false},
    {"ft", {1, 0, 0, 0}, kFoot, false},
    {"mil", {1, 0, 0, 0}, 1e-3 * kInch, false},
    {"micron", {1, 0, 0, 0}, 1e-6, false},
    {"microns", {1, 0, 0, 0}, 1e-6, false},
    {"lbf", kForcePowers, kPoundForce, false},
    {"ozf", kForcePowers, kPoundForce / 16.0, false},
    {"psi", kStressPowers, kPsi, false},
    {"ksi", kStressPowers, 1e3 * kPsi, false},
    {"Pas", {-1, 1, -1, 0}, 1.0, true},
    {"Hz", {0, 0, -1, 0}, 1.0, true},
    {"rad", kAnglePowers, 1.0, true},
    {"deg", kAnglePowers, kDegree, false},
    {"degree", kAnglePowers, kDegree, false},
    {"degrees", kAnglePowers, kDegree, false},
});

struct Prefix {
  char letter;
  double factor;
};

constexpr auto kPrefixes = std::to_array<Prefix>({{'f', 1e-15},
                                                  {'p', 1e-12},
                                                  {'n', 1e-9},
                                                  {'u', 1e-6},
                                                  {'m', 1e-3},
                                                  {'c', 1e-2},
                                                  {'d', 1e-1},
                                                  {'h', 1e2},
                                                  {'k', 1e3},
                                                  {'M', 1e6},
                                                  {'G', 1e9}});

struct PhysicalDimension {
  Powers powers;
  Dimension dimension;
  double to_si;  ///< of what the powers say: a turn is 2 pi radians
};

constexpr auto kDimensions = std::to_array<PhysicalDimension>({
    {kNone, Dimension::dimensionless, 1.0},
    {kTimePowers, Dimension::time, 1.0},
    {{1, 0, 0, 0}, Dimension::length, 1.0},
    {{2, 0, 0, 0}, Dimension::area, 1.0},
    {kForcePowers, Dimension::force, 1.0},
    {kStressPowers, Dimension::stress, 1.0},
    {{-1, 1, -1, 0}, Dimension::viscosity, 1.0},
    {{1, 0, -1, 0}, Dimension::speed, 1.0},
    {{0, 0, -1, 0}, Dimension::frequency, 1.0},
    {{0, 0, -1, 1}, Dimension::frequency, kPerTurn},
    {{0, 1, -2, 0}, Dimension::stiffness, 1.0},
    {kAnglePowers, Dimension::angle, 1.0},
    {{1, -1, 2, 0}, Dimension::compliance, 1.0},
});

constexpr std::string_view kAnyBlank = " \t\r\n";

/// Symbols beside plain letters as plain letters: "\u00B5m" is "um", "s\u207B\u00B9" is "s^-1".
std::string plain_letters(std::string_view text) {
  constexpr auto kWritten = std::to_array<std::pair<std::string_view, std::string_view>>({
      {"\xC2\xB5", "u"},      // micro sign
      {"\xCE\xBC", "u"},      // Greek mu
      {"\xC2\xB7", "."},      // middle dot
      {"\xE2\x8B\x85", "."},  // dot operator
      {"*", "."},
      {"\xC2\xB0", "deg"},
      {"\xE2\x81\xBB\xC2\xB9", "^-1"},  // superscripts
      {"\xE2\x81\xBB\xC2\xB2", "^-2"},
      {"\xC2\xB2", "^2"},
  });
  std::string plain;
  while (!text.empty()) {
    const auto* written = std::find_if(kWritten.begin(), kWritten.end(),
                                       [&](const auto& w) { return text.starts_with(w.first); });
    const std::size_t length = written == kWritten.end() ? 1 : written->first.size();
    plain += written == kWritten.end() ? text.substr(0, 1) : written->second;
    text.remove_prefix(length);
  }
  return plain;
}

/// A unit as a product of powers.
struct Product {
  Powers powers = kNone;
  double to_si = 1.0;
};

std::optional<Product> named_unit(std::string_view name) {
  const auto base = [](std::string_view wanted) {
    return std::find_if(kBases.begin(), kBases.end(),
                        [wanted](const BaseUnit& b) { return b.name == wanted; });
  };
  if (const auto* whole = base(name); whole != kBases.end()) {
    return Product{whole->powers, whole->to_si};
  }
  const auto* rest = name.size() > 1 ? base(name.substr(1)) : kBases.end();
  if (rest == kBases.end() || !rest->prefixed) return std::nullopt;
  for (const Prefix& prefix : kPrefixes) {
    if (prefix.letter == name.front()) return Product{rest->powers, prefix.factor * rest->to_si};
  }
  return std::nullopt;
}

/// "mm^2", "mm2", "s^-1", "kPa".
std::optional<Product> factor_unit(std::string_view text) {
  std::string_view name = text;
  int power = 1;
  const auto digits = text.find_first_of("^0123456789-", 1);
  if (digits != std::string_view::npos) {
    name = text.substr(0, digits);
    std::string_view exponent = text.substr(digits);
    if (exponent.starts_with('^')) exponent.remove_prefix(1);
    const char* end = exponent.data() + exponent.size();
    const auto parsed = std::from_chars(exponent.data(), end, power);
    if (parsed.ec != std::errc{} || parsed.ptr != end || std::abs(power) > 3) return std::nullopt;
  }
  auto unit = named_unit(name);
  if (!unit || power == 1) return unit;
  if (power == 0 || unit->powers == kNone) return std::nullopt;  // "10" is a number
  unit->to_si = std::pow(unit->to_si, power);
  for (int& p : unit->powers) p *= power;
  return unit;
}

/// Factors with spaces or dots between them; each slash divides by the factor behind it.
std::optional<Product> product_unit(std::string_view text) {
  Product product;
  bool divides = false;
  while (true) {
    const auto stop = text.find_first_of(" ./");
    const auto factor = factor_unit(text.substr(0, stop));
    if (!factor) return std::nullopt;
    product.to_si *= divides ? 1.0 / factor->to_si : factor->to_si;
    for (std::size_t i = 0; i < product.powers.size(); ++i) {
      product.powers[i] += divides ? -factor->powers[i] : factor->powers[i];
    }
    if (stop == std::string_view::npos) return product;
    const auto next = text.find_first_not_of(' ', stop);
    divides = next != std::string_view::npos && text[next] == '/';
    const bool sign = next != std::string_view::npos && (text[next] == '/' || text[next] == '.');
    const auto begin = sign ? text.find_first_not_of(' ', next + 1) : next;
    if (begin == std::string_view::npos) return std::nullopt;
    text.remove_prefix(begin);
  }
}

std::optional<Unit> find_unit(std::string_view text) {
  const std::string plain = plain_letters(trimmed(text, kAnyBlank));
  if (plain.empty()) return Unit{"", Dimension::dimensionless, 1.0};
  const auto product = product_unit(plain);
  if (!product) return std::nullopt;
  const auto* dimension =
      std::find_if(kDimensions.begin(), kDimensions.end(),
                   [&](const PhysicalDimension& d) { return d.powers == product->powers; });
  if (dimension == kDimensions.end()) return std::nullopt;
  constexpr double kSame = 1e-12;  // of the products, which round
  const double to_si = product->to_si * dimension->to_si;
  for (const ListedUnit& listed : kListed) {
    if (listed.dimension != dimension->dimension) continue;
    if (std::abs(listed.to_si - to_si) > kSame * to_si) continue;
    return Unit{std::string(listed.symbol), listed.dimension, listed.to_si};
  }
  return Unit{plain, dimension->dimension, to_si};
}

std::string known_units(std::optional<Dimension> dimension) {
  std::vector<std::string_view> symbols;
  for (const ListedUnit& unit : kListed) {
    if (!unit.symbol.empty() && (!dimension || unit.dimension == *dimension)) {
      symbols.push_back(unit.symbol);
    }
  }
  return fmt::format("{}", fmt::join(symbols, ", "));
}

struct DimensionWord {
  Dimension meaning;
  std::string_view text, si;
};

constexpr auto kDimensionWords = std::to_array<DimensionWord>({
    {Dimension::dimensionless, "dimensionless", ""},
    {Dimension::time, "time", "s"},
    {Dimension::length, "length", "m"},
    {Dimension::area, "area", "m^2"},
    {Dimension::force, "force", "N"},
    {Dimension::stress, "stress or modulus", "Pa"},
    {Dimension::viscosity, "viscosity", "Pa s"},
    {Dimension::speed, "speed", "m/s"},
    {Dimension::frequency, "frequency", "Hz"},
    {Dimension::stiffness, "stiffness", "N/m"},
    {Dimension::angle, "angle", "rad"},
    {Dimension::compliance, "compliance", "1/Pa"},
});

/// The names of units with the same powers, as a regular expression.
struct NamePattern {
  Powers powers;
  std::string names;
};

std::vector<NamePattern> name_patterns() {
  std::string letters;
  for (const Prefix& prefix : kPrefixes) letters += prefix.letter;
  std::vector<NamePattern> patterns;
  for (const BaseUnit& base : kBases) {
    auto same = std::find_if(patterns.begin(), patterns.end(),
                             [&](const NamePattern& p) { return p.powers == base.powers; });
    if (same == patterns.end()) same = patterns.insert(same, {base.powers, ""});
    if (!same->names.empty()) same->names += '|';
    if (base.prefixed) same->names += fmt::format("[{}]?", letters);
    same->names += base.name;
  }
  return patterns;
}

Powers quotient(const Powers& above, const Powers& below) {
  Powers powers = above;
  for (std::size_t i = 0; i < powers.size(); ++i) powers[i] -= below[i];
  return powers;
}

/// A unit of a dimension by one name or as a quotient of two, as a regular expression.
std::string unit_pattern(Dimension dimension) {
  static const std::vector<NamePattern> all = name_patterns();
  std::string pattern;
  const auto add = [&](const std::string& more) {
    pattern += fmt::format("{}{}", pattern.empty() ? "" : "|", more);
  };
  for (const PhysicalDimension& known : kDimensions) {
    if (known.dimension != dimension) continue;
    for (const NamePattern& above : all) {
      if (above.powers == known.powers) add(above.names);
      for (const NamePattern& below : all) {
        if (quotient(above.powers, below.powers) != known.powers) continue;
        add(fmt::format("(?:{})/(?:{})", above.names, below.names));
      }
    }
  }
  return pattern;
}

}  // namespace

std::string base::quantity_pattern(Dimension dimension, int sign) {
  constexpr std::string_view kDigits = "(?:[0-9]+\\.?[0-9]*|\\.[0-9]+)(?:[eE][-+]?[0-9]+)?";
  constexpr std::string_view kSpace = "[ \\t\\r\\n]*", kNotZero = "(?=[0.]*[1-9])";
  const std::string number =
      fmt::format("{}{}{}", sign < 0 ? "-?" : "", sign > 0 ? kNotZero : "", kDigits);
  // The unit begins with what is no digit; powers, points, blanks and letters of other alphabets
  // are left to the reader.
  const std::string unit = fmt::format(
      "(?:(?:{})|[A-Za-z%\"][^\\t\\r\\n]*[^-A-Za-z%\"/\\t\\r\\n][^\\t\\r\\n]*|[^ "
      "-~\\t\\r\\n][^\\t\\r\\n]*)",
      unit_pattern(dimension));
  return fmt::format("^{0}(?:[+]?{1}[ \\t]+{2}|{1}{2}{3}){0}$", kSpace, number, unit,
                     dimension == Dimension::dimensionless ? fmt::format("|[+]?{}", number) : "");
}

std::string_view dimension_name(Dimension dimension) noexcept {
  return entry_of(kDimensionWords, dimension).text;
}

std::string_view si_symbol(Dimension dimension) noexcept {
  return entry_of(kDimensionWords, dimension).si;
}

Unit shown_unit(Dimension dimension) {
  std::string_view symbol = si_symbol(dimension);
  if (dimension == Dimension::length) symbol = "mm";
  if (dimension == Dimension::stress) symbol = "kPa";
  return parse_unit(symbol, dimension, {});
}

Unit parse_unit(std::string_view text, std::string_view where) {
  if (auto unit = find_unit(text)) return *std::move(unit);
  throw bad_input(where, fmt::format("unknown unit '{}'", printable(text)),
                  known_units(std::nullopt));
}

Unit parse_unit(std::string_view text, Dimension expected, std::string_view where) {
  auto unit = find_unit(text);
  if (unit && unit->dimension == expected) return *std::move(unit);
  const std::string units = known_units(expected);
  throw bad_input(
      where,
      unit ? fmt::format("'{}' is a unit of {}", printable(text), dimension_name(unit->dimension))
           : fmt::format("unknown unit '{}'", printable(text)),
      fmt::format("a unit of {}{}{}", dimension_name(expected), units.empty() ? "" : ": ", units));
}

bool is_unit(std::string_view text) {
  return !trimmed(text, kAnyBlank).empty() && find_unit(text).has_value();
}

std::string units_of(Dimension dimension) {
  return known_units(dimension);
}

std::optional<double> find_number(std::string_view text) noexcept {
  const std::string_view t = trimmed(text, kAnyBlank);
  double value = 0.0;
  const char* begin = t.data();
  const char* end = begin + t.size();
  if (begin != end && *begin == '+') ++begin;  // from_chars takes no plus sign
  const auto [stop, status] = std::from_chars(begin, end, value);
  if (status != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

double parse_number(std::string_view text, std::string_view where) {
  if (const auto value = find_number(text)) return *value;
  const std::string_view t = trimmed(text, kAnyBlank);
  throw bad_input(where,
                  t.empty() ? std::string("empty where a number belongs")
                            : fmt::format("'{}' is not a finite number", printable(t)),
                  "a number such as 12.5 or 1.2e-3");
}

std::optional<double> base::find_share(std::string_view text) {
  constexpr double kPercent = 100.0;
  const bool percent = text.ends_with('%');
  if (percent) text.remove_suffix(1);
  std::optional<double> share = find_number(text);
  if (share && percent) *share /= kPercent;
  return share;
}

std::string base::with_unit(std::string_view number, const Unit& unit) {
  if (unit.symbol.empty()) return std::string(number);
  return fmt::format("{} {}", number, unit.symbol);
}

QuantityText base::split_quantity(std::string_view text) {
  const std::string_view t = trimmed(text, kAnyBlank);
  std::size_t split = std::min(t.find_first_of(" \t"), t.size());
  if (split == t.size()) {  // "4mm": the unit begins where the number ends
    double number = 0.0;
    const auto end = std::from_chars(t.data(), t.data() + t.size(), number).ptr;
    if (end != t.data()) split = static_cast<std::size_t>(end - t.data());
  }
  return {t.substr(0, split), trimmed(t.substr(split), kAnyBlank)};
}

double parse_quantity(std::string_view text, Dimension expected, std::string_view where) {
  const auto [number, unit] = split_quantity(text);
  if (unit.empty() && expected != Dimension::dimensionless) {
    throw bad_input(where, fmt::format("'{}' has no unit", printable(trimmed(text, kAnyBlank))),
                    fmt::format("a number and a unit of {}: {}", dimension_name(expected),
                                known_units(expected)));
  }
  const double value = parse_number(number, where);
  const double si = value * parse_unit(unit, expected, where).to_si;
  if (!std::isfinite(si))
    throw bad_input(where, fmt::format("'{}' overflows", printable(trimmed(text, kAnyBlank))));
  return si;
}

}  // namespace tpm
