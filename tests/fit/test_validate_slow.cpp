// A smaller part of tests/measure/validation.cpp: how often tpm validate is right, by simulation.
#include <catch2/catch.hpp>

#include "validation_studies.hpp"

namespace tpm::fit {

TEST_CASE("|E| <= U without a model error, and [E - U, E + U] holds a known one", "[validate]") {
  constexpr int kExperiments = 200;
  constexpr double kStiffer = 1.05;
  constexpr double kSuspicious = 1e-3;
  for (const double phi : {0.0, 0.9}) {
    test::StudyNoise noise;
    noise.phi = phi;
    Random random(71);
    test::StudyCounts none, known;
    LawFile right = test::study_calibration(1, noise, random);
    right.values = {60.0, 45.0, 2.0, 0.0, 0.0};
    const test::StudyTest protocol = test::study_validation(20, 0.4);
    const test::TrueErrors delta = test::true_errors(right, protocol, kStiffer);
    for (int i = 0; i < kExperiments; ++i) {
      const LawFile law = test::study_calibration(1, noise, random);
      const auto compared = [&](double stiffer) {
        ComparisonOptions options;
        options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
        return compare_with_recording(
            law,
            prepare_recording("validation",
                              test::study_recording(protocol, noise, random, stiffer)),
            options);
      };
      none.add(compared(1.0), 0.0, 0.0);
      known.add(compared(kStiffer), delta.peak, delta.end);
    }
    CAPTURE(phi);
    for (const test::Count& count : {none.peak, none.end, known.peak, known.end}) {
      CAPTURE(count.held);
      CHECK(test::binomial_p(count, 0.95) > kSuspicious);
    }
  }
}

}  // namespace tpm::fit
