#pragma once
#include <string_view>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm::base {

/// Values that an option with a list of rising values accepts.
struct RisingValues {
  Dimension dimension = Dimension::dimensionless;
  int most = 0;                      ///< values of a range
  std::string_view called, example;  ///< for messages: "times", "\"0.1 s, 1 s\""
};

/// Reads "0.1 s, 1 s, 10 s", or "1 ms : 1000 s : 13" for that many values at equal ratios.
/// Throws Error(usage) naming the option; values must be finite, above 0 and rise.
[[nodiscard]] std::vector<double> parse_rising(std::string_view text, const RisingValues& accepted,
                                               std::string_view option);

}  // namespace tpm::base
