#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/law.hpp"

namespace tpm::fit {

/// Relaxation times that a user states: "0.1 s, 1 s, 10 s", or "1 ms : 1000 s : 13" for that many
/// at equal ratios. With the times given, G(t) and the responses of linear and Hertz kernels are
/// linear in all that is left, so that a fit has one minimum.
/// Throws Error(usage) naming the option; times must be above 0 and rise.
[[nodiscard]] std::vector<double> parse_times(std::string_view text, std::string_view option);

/// The law whose times these are: `law` with as many parallel branches, or linear-N if none is
/// named. Throws Error(usage) for a law with another number of branches, or without parallel ones.
[[nodiscard]] LawSpec law_of_times(const std::optional<LawSpec>& law,
                                   std::span<const double> times_s, std::string_view option);

/// The stated value of "tau3"; none if no times were stated, or for another parameter.
[[nodiscard]] std::optional<double> stated_time(const std::string& parameter,
                                                std::span<const double> times_s);

}  // namespace tpm::fit
