// The relaxation fit against an independent implementation and optimiser:
// scripts/judge_relaxation.py (numpy and scipy, no code shared), to 5 digits in chi-square, E and
// eta1, at three ramp rates.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "tpm/fit/fit.hpp"

using namespace tpm;
using Catch::Matchers::WithinRel;

namespace {

/// A python3 that has scipy: the one on the path may be a version manager's without it.
std::string python_with_scipy() {
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    const std::string probe = fmt::format("{} -c 'import scipy' 2>/dev/null", python);
    if (std::system(probe.c_str()) == 0) return python;
  }
  FAIL("no python3 with scipy; Debian: python3-scipy");
  return {};
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  REQUIRE(pipe != nullptr);
  std::string text;
  for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get())) {
    text += static_cast<char>(c);
  }
  return text;
}

}  // namespace

TEST_CASE("an independent optimiser finds the same minimum of the relaxation problem") {
  const std::string source = TPM_TEST_SOURCE_DIR;
  const std::string python = python_with_scipy();
  FitConfig config = read_fit_config(source + "/configs/liver_relaxation.json");
  config.profiles = false;
  config.hypotheses.clear();
  for (const int rate : {1, 2, 4}) {
    CAPTURE(rate);
    config.data[0].protocol.rate_m_per_s = rate * 1e-3;
    const FitResult fit = run_fit(config);
    const std::string command = fmt::format(
        "{0} '{1}/scripts/judge_relaxation.py' '{1}/data/evren_relaxation.csv' --rate {2}", python,
        source, rate);
    const Json judge = parse_json(output_of(command), "judge");
    CHECK_THAT(fit.chi_square, WithinRel(judge.at("chi_square").get<double>(), 1e-5));
    CHECK_THAT(fit.best.natural[0], WithinRel(judge.at("E_Pa").get<double>(), 1e-5));
    CHECK_THAT(fit.best.natural[1], WithinRel(judge.at("eta1_Pa_s").get<double>(), 1e-5));
  }
}
