#include "tpm/base/sized_unit.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"

namespace tpm::base {
namespace {

struct PrefixedUnit {
  const char* prefix;
  double factor;
};

// Those that parse_unit() reads.
constexpr auto kSizedPrefixes = std::to_array<PrefixedUnit>({{"f", 1e-15},
                                                             {"p", 1e-12},
                                                             {"n", 1e-9},
                                                             {"u", 1e-6},
                                                             {"m", 1e-3},
                                                             {"", 1.0},
                                                             {"k", 1e3},
                                                             {"M", 1e6},
                                                             {"G", 1e9}});

/// Nobody says kiloseconds or megametres, and a prefix of a square counts twice.
double largest_factor(Dimension dimension) {
  switch (dimension) {
    case Dimension::time:
    case Dimension::length:
    case Dimension::speed:
      return 1.0;
    case Dimension::dimensionless:
    case Dimension::area:
    case Dimension::angle:
    case Dimension::compliance:
      return 0.0;  // no prefix at all
    case Dimension::force:
    case Dimension::stress:
    case Dimension::viscosity:
    case Dimension::frequency:
    case Dimension::stiffness:
      break;
  }
  return 1e9;
}

/// True if a unit that carries the dimension of what changes is a rate of it ("mN/s", a force).
bool per_second(const Unit& unit) {
  return unit.symbol.ends_with("/s") && unit.dimension != Dimension::speed;
}

}  // namespace

Unit sized_unit(const Unit& usual, double si) {
  constexpr double kLeast = 0.1, kMost = 1e4;
  const double size = std::abs(si);
  if (!(size > 0.0) || !std::isfinite(size)) return usual;
  if (size / usual.to_si >= kLeast && size / usual.to_si < kMost) return usual;
  const double most = largest_factor(usual.dimension);
  // A rate, "mN/s", is sized as what changes; "Pa s^alpha" carries the dimension of what it
  // resembles, but is no unit of it.
  const std::string_view rate = per_second(usual) ? "/s" : "";
  const std::string changing = usual.symbol.substr(0, usual.symbol.size() - rate.size());
  if (most == 0.0 || !is_unit(changing)) return usual;
  if (parse_unit(changing, {}).dimension != usual.dimension) return usual;
  const std::string_view symbol = si_symbol(usual.dimension);
  const PrefixedUnit* chosen = &kSizedPrefixes.front();
  for (const PrefixedUnit& unit : kSizedPrefixes) {
    // A value that rounds up to the next prefix is written with that one.
    if (unit.factor <= most && size * (1.0 + 5e-5) >= unit.factor) chosen = &unit;
  }
  Unit unit = parse_unit(fmt::format("{}{}", chosen->prefix, symbol), usual.dimension, {});
  unit.symbol += rate;
  return unit;
}

std::string sized_text(const Unit& usual, double si, int digits) {
  const Unit unit = sized_unit(usual, si);
  return with_unit(significant(si / unit.to_si, digits), unit);
}

std::string sized_text(Dimension dimension, double si, int digits) {
  return sized_text(shown_unit(dimension), si, digits);
}

}  // namespace tpm::base
