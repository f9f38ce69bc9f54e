// Spectra of 9 frequencies, from closed forms that share nothing with the laws: the law that is
// recommended has the parameters that made them, and no more.
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "tpm/base/random.hpp"
#include "tpm/fit/select/material_function.hpp"
#include "tpm/fit/verdict.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;

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

/// Of 34 frequencies, whose magnitude scatters by 0.7 % and whose phase by 0.25 deg.
Spectrum by_magnitude_and_phase(base::Random& random) {
  Spectrum spectrum;
  for (int i = 0; i < 34; ++i) {
    const double frequency_Hz = 0.01 * std::pow(2000.0, i / 33.0);
    const Complex s(0.0, 2.0 * std::numbers::pi * frequency_Hz);
    const Complex g =
        500.0 + 900.0 * 5.0 * s / (1.0 + 5.0 * s) + 2200.0 * 0.08 * s / (1.0 + 0.08 * s);
    const double phase = std::arg(g) + 0.25 * std::numbers::pi / 180.0 * random.normal();
    const Complex read = std::polar(std::abs(g) * (1.0 + 0.007 * random.normal()), phase);
    spectrum.frequency_Hz.push_back(frequency_Hz);
    spectrum.storage.push_back(read.real());
    spectrum.loss.push_back(read.imag());
  }
  return spectrum;
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

TEST_CASE("A spectrum whose magnitude and phase were measured is weighted by their noise",
          "[select][spectrum]") {
  constexpr int kRepetitions = 40;
  const std::map<std::string, double> truth{
      {"k_inf", 500.0}, {"k1", 2200.0}, {"k2", 900.0}, {"tau1", 0.08}, {"tau2", 5.0}};
  base::Random random(20261201);
  int missed = 0, identified = 0;
  double magnitude = 0.0, phase = 0.0;
  for (int i = 0; i < kRepetitions; ++i) {
    SelectionOptions options;
    options.held_out = false;
    options.laws = {parse_law_name("linear-2", "test")};
    const MaterialFunction function{"made", by_magnitude_and_phase(random), {}, {}, true};
    const FitResult fit = select_law(function, options).candidates.front().fit;
    magnitude += fit.config.data.front().noise.relative / kRepetitions;
    phase += fit.config.data.front().noise.angle_rad.value() / kRepetitions;
    for (const ParameterResult& p : fit.parameters) {
      const double is = truth.at(p.parameter.name);
      identified += p.verdict == Verdict::identified ? 1 : 0;
      missed += is >= p.lower.value() && is <= p.upper.value() ? 0 : 1;
    }
  }
  CHECK_THAT(magnitude, WithinRel(0.007, 0.05));
  CHECK_THAT(phase, WithinRel(0.25 * std::numbers::pi / 180.0, 0.05));
  CHECK(identified == 5 * kRepetitions);
  // 10 of 200 are expected; 95 % of such counts are at most 16 where the parameters are one draw.
  CHECK(missed <= 18);
}
