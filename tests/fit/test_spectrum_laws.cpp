// Spectra of 9 frequencies, from closed forms that share nothing with the laws: the law that is
// recommended has the parameters that made them, and no more.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "tpm/base/random.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpm/fit/verdict.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

using Complex = std::complex<double>;

/// 2 % of log-normal noise.
Selection select_for(const std::function<Complex(Complex)>& modulus) {
  base::Random random(5);
  Spectrum spectrum;
  for (int i = 0; i < 9; ++i) {
    const double omega = std::pow(10.0, -2.0 + 0.5 * i);
    const Complex g = modulus({0.0, omega});
    spectrum.frequency_Hz.push_back(omega / (2.0 * std::numbers::pi));
    spectrum.storage.push_back(g.real() * std::exp(0.02 * random.normal()));
    spectrum.loss.push_back(g.imag() * std::exp(0.02 * random.normal()));
  }
  SelectionOptions options;
  options.held_out = false;
  return select_law(MaterialFunction{"made", std::move(spectrum), {}, {}}, options);
}

struct MadeSpectrum {
  const char* law;
  int parameters;
  std::function<Complex(Complex)> modulus;
};

}  // namespace

TEST_CASE("a spectrum of 18 readings gets the law that made it", "[select][spectrum]") {
  const std::vector<MadeSpectrum> all{
      {"linear-1", 3, [](Complex s) { return 500.0 + 1000.0 * s / (1.0 + s); }},
      {"linear-2", 5,
       [](Complex s) {
         return 200.0 + 100.0 * s / (1.0 + 0.1 * s) + 6000.0 * s / (1.0 + 10.0 * s);
       }},
      {"linear-fzener", 4,
       [](Complex s) { return 500.0 + 1000.0 * std::sqrt(s) / (1.0 + std::sqrt(s)); }},
      {"linear-fkelvin_voigt2", 4,
       [](Complex s) { return 300.0 * std::pow(s, 0.6) + 500.0 * std::pow(s, 0.15); }},
      {"linear-fmaxwell2", 4,
       [](Complex s) { return 1.0 / (std::pow(s, -0.7) / 300.0 + std::pow(s, -0.15) / 500.0); }}};
  for (const MadeSpectrum& made : all) {
    INFO(made.law);
    const Selection s = select_for(made.modulus);
    const Candidate& chosen = s.candidates[s.recommended];
    CHECK(law_name(chosen.law) == made.law);
    CHECK(std::ssize(chosen.fit.parameters) == made.parameters);
    CHECK(chosen.identified);
    CHECK_FALSE(s.preferred);
  }
}

TEST_CASE("a dashpot beside or behind a spring-pot is an order of 1 and no bound",
          "[select][spectrum]") {
  const MadeSpectrum beside{"linear-fkelvin_voigt2", 4,
                            [](Complex s) { return 300.0 * s + 500.0 * std::pow(s, 0.15); }};
  const MadeSpectrum behind{"linear-fmaxwell2", 4, [](Complex s) {
                              return 1.0 / (1.0 / (300.0 * s) + std::pow(s, -0.15) / 500.0);
                            }};
  for (const MadeSpectrum& made : {beside, behind}) {
    INFO(made.law);
    const Selection s = select_for(made.modulus);
    const Candidate& chosen = s.candidates[s.recommended];
    CHECK(law_name(chosen.law) == made.law);
    CHECK_FALSE(s.preferred);
    for (const ParameterResult& p : chosen.fit.parameters) {
      if (p.parameter.name != "alpha") continue;
      INFO(verdict_text(p));
      CHECK(p.estimate > 0.99);
      CHECK((!p.upper || *p.upper > 0.999));
    }
  }
}
