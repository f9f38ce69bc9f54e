// Compares the derivatives of a configuration of a fit with finite differences
// (reports/fits/report.md):
//   measure_gradients CONFIG [RANDOM_POINTS [SEED]]
// Exit code 1 if a derivative is wrong, or more than half of them are undecided.
#include <charconv>
#include <cstdint>
#include <limits>

#include "gradient_check.hpp"
#include "program.hpp"
#include "tpm/fit/likelihood/config.hpp"
#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace {

std::uint64_t whole_number(const std::string& text, std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size() && value <= most) return value;
  throw tpm::Error(tpm::ExitCode::usage, "measure_gradients", "'" + text + "'",
                   fmt::format("a whole number up to {}", most));
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tpm::fit;
  bool passed = true;
  const int code = tpm::test::measured(
      argc, argv, 1, 3, "measure_gradients CONFIG [RANDOM_POINTS [SEED]]",
      [&passed](const std::vector<std::string>& words) {
        GradientCheckOptions wanted;
        constexpr std::uint64_t kMostPoints = 1000;
        if (words.size() > 1) {
          wanted.random_points = static_cast<int>(whole_number(words[1], kMostPoints));
        }
        if (words.size() > 2) {
          wanted.seed = whole_number(words[2], std::numeric_limits<std::uint64_t>::max());
        }
        const ExperimentResiduals function(read_fit_config(words[0]));
        const GradientCheck check =
            check_gradient(function, searched_parameters(function.config()), wanted);
        fmt::print("{}", to_terminal_text(check));
        passed = check.passed();
      });
  return code == 0 && !passed ? 1 : code;
}
