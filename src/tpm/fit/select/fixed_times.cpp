#include "tpm/fit/select/fixed_times.hpp"

#include <fmt/format.h>

#include <charconv>
#include <system_error>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/rising_values.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::fit {

std::vector<double> parse_times(std::string_view text, std::string_view option) {
  return parse_rising(
      text,
      {Dimension::time, kMostBranches, "times", "\"0.1 s, 1 s, 10 s\", or \"1 ms : 1000 s : 13\""},
      option);
}

LawSpec law_of_times(const std::optional<LawSpec>& law, std::span<const double> times_s,
                     std::string_view option) {
  if (!law) {
    LawSpec spec;
    spec.branches = static_cast<int>(times_s.size());
    return spec;
  }
  const bool parallel = law->form == BranchForm::parallel && law->fractional == Fractional::none;
  if (parallel && static_cast<std::size_t>(law->branches) == times_s.size()) return *law;
  throw Error(ExitCode::usage, option,
              fmt::format("{} times for the law {}", times_s.size(), law_name(*law)),
              "a law with as many parallel branches, or no --laws");
}

std::optional<double> stated_time(const std::string& parameter, std::span<const double> times_s) {
  constexpr std::string_view kTime = "tau";
  if (!parameter.starts_with(kTime) || parameter.size() == kTime.size()) return std::nullopt;
  std::size_t number = 0;
  const char* from = parameter.data() + kTime.size();
  const char* end = parameter.data() + parameter.size();
  const auto [stop, error] = std::from_chars(from, end, number);
  if (error != std::errc() || stop != end || number < 1 || number > times_s.size()) {
    return std::nullopt;
  }
  return times_s[number - 1];
}

}  // namespace tpm::fit
