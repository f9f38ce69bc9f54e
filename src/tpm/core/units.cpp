#include "tpm/core/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

struct Spelling {
  std::string_view text;
  std::string_view symbol;
  Dimension dimension;
  double to_si;
};

constexpr auto kSpellings = std::to_array<Spelling>({
    {"", "", Dimension::dimensionless, 1.0},
    {"1", "", Dimension::dimensionless, 1.0},
    {"-", "", Dimension::dimensionless, 1.0},
    {"%", "%", Dimension::dimensionless, 1e-2},
    {"s", "s", Dimension::time, 1.0},
    {"sec", "s", Dimension::time, 1.0},
    {"ms", "ms", Dimension::time, 1e-3},
    {"us", "us", Dimension::time, 1e-6},
    {"min", "min", Dimension::time, 60.0},
    {"h", "h", Dimension::time, 3600.0},
    {"m", "m", Dimension::length, 1.0},
    {"cm", "cm", Dimension::length, 1e-2},
    {"mm", "mm", Dimension::length, 1e-3},
    {"um", "um", Dimension::length, 1e-6},
    {"\xC2\xB5m", "um", Dimension::length, 1e-6},
    {"\xCE\xBCm", "um", Dimension::length, 1e-6},
    {"nm", "nm", Dimension::length, 1e-9},
    {"m^2", "m^2", Dimension::area, 1.0},
    {"cm^2", "cm^2", Dimension::area, 1e-4},
    {"mm^2", "mm^2", Dimension::area, 1e-6},
    {"mm2", "mm^2", Dimension::area, 1e-6},
    {"mm\xC2\xB2", "mm^2", Dimension::area, 1e-6},
    {"N", "N", Dimension::force, 1.0},
    {"mN", "mN", Dimension::force, 1e-3},
    {"uN", "uN", Dimension::force, 1e-6},
    {"kN", "kN", Dimension::force, 1e3},
    {"gf", "gf", Dimension::force, 9.80665e-3},
    {"kgf", "kgf", Dimension::force, 9.80665},
    {"Pa", "Pa", Dimension::stress, 1.0},
    {"kPa", "kPa", Dimension::stress, 1e3},
    {"MPa", "MPa", Dimension::stress, 1e6},
    {"N/m^2", "Pa", Dimension::stress, 1.0},
    {"N/mm^2", "MPa", Dimension::stress, 1e6},
    {"Pa s", "Pa s", Dimension::viscosity, 1.0},
    {"Pa.s", "Pa s", Dimension::viscosity, 1.0},
    {"Pa*s", "Pa s", Dimension::viscosity, 1.0},
    {"Pas", "Pa s", Dimension::viscosity, 1.0},
    {"Pa\xC2\xB7s", "Pa s", Dimension::viscosity, 1.0},
    {"kPa s", "kPa s", Dimension::viscosity, 1e3},
    {"kPa.s", "kPa s", Dimension::viscosity, 1e3},
    {"m/s", "m/s", Dimension::speed, 1.0},
    {"mm/s", "mm/s", Dimension::speed, 1e-3},
    {"um/s", "um/s", Dimension::speed, 1e-6},
    {"mm/min", "mm/min", Dimension::speed, 1e-3 / 60.0},
    {"Hz", "Hz", Dimension::frequency, 1.0},
    {"kHz", "kHz", Dimension::frequency, 1e3},
    {"1/s", "Hz", Dimension::frequency, 1.0},
    {"rad/s", "rad/s", Dimension::frequency, 0.15915494309189535},
    {"N/m", "N/m", Dimension::stiffness, 1.0},
    {"mN/mm", "N/m", Dimension::stiffness, 1.0},
    {"N/mm", "N/mm", Dimension::stiffness, 1e3},
    {"kN/m", "N/mm", Dimension::stiffness, 1e3},
});

std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kSpace = " \t\r\n";
  const auto first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

const Spelling* find_spelling(std::string_view text) {
  for (const Spelling& s : kSpellings) {
    if (s.text == text) return &s;
  }
  return nullptr;
}

std::string known_units(std::optional<Dimension> dimension) {
  std::vector<std::string_view> symbols;
  for (const Spelling& s : kSpellings) {
    if ((dimension && s.dimension != *dimension) || s.symbol.empty()) continue;
    if (std::find(symbols.begin(), symbols.end(), s.symbol) == symbols.end()) {
      symbols.push_back(s.symbol);
    }
  }
  return fmt::format("{}", fmt::join(symbols, ", "));
}

}  // namespace

std::string_view dimension_name(Dimension dimension) noexcept {
  switch (dimension) {
    case Dimension::dimensionless:
      return "dimensionless";
    case Dimension::time:
      return "time";
    case Dimension::length:
      return "length";
    case Dimension::area:
      return "area";
    case Dimension::force:
      return "force";
    case Dimension::stress:
      return "stress or modulus";
    case Dimension::viscosity:
      return "viscosity";
    case Dimension::speed:
      return "speed";
    case Dimension::frequency:
      return "frequency";
    case Dimension::stiffness:
      return "stiffness";
  }
  return "";
}

std::string_view si_symbol(Dimension dimension) noexcept {
  switch (dimension) {
    case Dimension::dimensionless:
      return "";
    case Dimension::time:
      return "s";
    case Dimension::length:
      return "m";
    case Dimension::area:
      return "m^2";
    case Dimension::force:
      return "N";
    case Dimension::stress:
      return "Pa";
    case Dimension::viscosity:
      return "Pa s";
    case Dimension::speed:
      return "m/s";
    case Dimension::frequency:
      return "Hz";
    case Dimension::stiffness:
      return "N/m";
  }
  return "";
}

Unit shown_unit(Dimension dimension) {
  std::string_view symbol = si_symbol(dimension);
  if (dimension == Dimension::length) symbol = "mm";
  if (dimension == Dimension::stress) symbol = "kPa";
  return parse_unit(symbol, dimension, {});
}

Unit parse_unit(std::string_view text, std::string_view where) {
  const Spelling* s = find_spelling(trimmed(text));
  if (s == nullptr) {
    throw bad_input(where, fmt::format("unknown unit '{}'", printable(text)),
                    known_units(std::nullopt));
  }
  return {std::string(s->symbol), s->dimension, s->to_si};
}

Unit parse_unit(std::string_view text, Dimension expected, std::string_view where) {
  const Spelling* s = find_spelling(trimmed(text));
  if (s == nullptr || s->dimension != expected) {
    const std::string units = known_units(expected);
    throw bad_input(where,
                    s == nullptr ? fmt::format("unknown unit '{}'", printable(text))
                                 : fmt::format("'{}' is a unit of {}", printable(text),
                                               dimension_name(s->dimension)),
                    fmt::format("a unit of {}{}{}", dimension_name(expected),
                                units.empty() ? "" : ": ", units));
  }
  return {std::string(s->symbol), s->dimension, s->to_si};
}

bool is_unit(std::string_view text) noexcept {
  const std::string_view t = trimmed(text);
  return !t.empty() && find_spelling(t) != nullptr;
}

std::optional<double> find_number(std::string_view text) noexcept {
  const std::string_view t = trimmed(text);
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
  const std::string_view t = trimmed(text);
  throw bad_input(where,
                  t.empty() ? std::string("empty where a number belongs")
                            : fmt::format("'{}' is not a finite number", printable(t)),
                  "a number such as 12.5 or 1.2e-3");
}

double parse_quantity(std::string_view text, Dimension expected, std::string_view where) {
  const std::string_view t = trimmed(text);
  const auto split = t.find_first_of(" \t");
  const std::string_view number = t.substr(0, split);
  const std::string_view unit =
      split == std::string_view::npos ? std::string_view{} : trimmed(t.substr(split));
  if (unit.empty() && expected != Dimension::dimensionless) {
    throw bad_input(where, fmt::format("'{}' has no unit", printable(t)),
                    fmt::format("a number and a unit of {}: {}", dimension_name(expected),
                                known_units(expected)));
  }
  const double value = parse_number(number, where);
  const double si = value * parse_unit(unit, expected, where).to_si;
  if (!std::isfinite(si)) throw bad_input(where, fmt::format("'{}' overflows", printable(t)));
  return si;
}

}  // namespace tpm
