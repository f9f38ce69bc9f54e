#pragma once
// Simulated validations whose model error is known: how often |E| <= U, how often [E - U, E + U]
// holds it, and how often a verdict is wrong. Shared by the slow test and by the program that
// prints reports/validation.
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "coverage_studies.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/validate/calibration_covariance.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::test {

/// A ramp and hold on a material of 60 + 45 exp(-t / 2 s) N/m.
struct StudyTest {
  int rest = 40;            ///< readings before the drive moves
  double start_mm = 0.0;    ///< depth there
  double contact_mm = 0.0;  ///< depth at which contact begins
  double depth_mm = 4.0;    ///< at the end of the ramp
  double rate_mm_per_s = 1.0;
  double hold_s = 20.0;
  double interval_s = 0.1;
};

struct StudyNoise {
  double sigma_N = 2e-3;
  double phi = 0.0;
  double zero_N = 4e-3;      ///< zero error of the force cell
  double force_scale = 0.0;  ///< relative error of the force
};

inline LawSpec study_law() {
  LawSpec law = parse_law_name("linear-1", "study");
  law.reference = 4e-3;
  return law;
}

/// @param stiffer factor of the forces
/// @param slow_branch stiffness of a second branch of 12 s, N/m
inline Recording study_recording(const StudyTest& test, const StudyNoise& noise, Random& random,
                                 double stiffer = 1.0, double slow_branch = 0.0) {
  LawSpec law = parse_law_name("linear-2", "study");
  law.reference = 4e-3;
  const std::vector<double> values{60.0, 45.0, slow_branch, 2.0, 12.0, 1e-3 * test.contact_mm, 0.0};
  Recording r;
  r.header.id = "study";
  const double ramp_s = (test.depth_mm - test.start_mm) / test.rate_mm_per_s;
  const int count =
      test.rest + static_cast<int>(std::lround((ramp_s + test.hold_s) / test.interval_s));
  const double moves_s = (test.rest - 1) * test.interval_s;
  for (int i = 0; i < count; ++i) {
    const double t = i * test.interval_s;
    r.time_s.push_back(t);
    const double gone = std::clamp((t - moves_s) / ramp_s, 0.0, 1.0);
    r.drive.push_back(1e-3 * (test.start_mm + gone * (test.depth_mm - test.start_mm)));
  }
  Protocol motion = measured_history(Drive::displacement, r.time_s, r.drive);
  motion.set_equilibrium_at_start(true);
  const Response force = LawModel(law).respond(motion, r.time_s, values, Want::values);
  double e = random.normal();
  for (Eigen::Index i = 0; i < force.value.size(); ++i) {
    r.response.push_back(stiffer * (1.0 + noise.force_scale) * force.value[i] + noise.zero_N +
                         noise.sigma_N * e);
    e = noise.phi * e + std::sqrt(1.0 - noise.phi * noise.phi) * random.normal();
  }
  return r;
}

/// Fitted, with what tpm validate takes for the covariance where it finds the recordings.
inline LawFile study_fit(const std::vector<PreparedRecording>& recordings) {
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = 4e-3;
  setup.starts = 2;
  const LawFile law =
      fitted_law(run_fit(recording_config(study_law(), recordings, setup), data_sets(recordings)));
  return with_calibration_covariance(law, recordings).value();
}

/// A law from `count` recordings of the calibration's protocol.
inline LawFile study_calibration(int count, const StudyNoise& noise, Random& random,
                                 double slow_branch = 0.0, double scale_limit = 0.0) {
  std::vector<PreparedRecording> recordings;
  StudyNoise own = noise;
  own.force_scale = scale_limit * (2.0 * random.uniform() - 1.0);  // one instrument
  for (int i = 0; i < count; ++i) {
    recordings.push_back(prepare_recording("calibration " + std::to_string(i),
                                           study_recording({}, own, random, 1.0, slow_branch)));
  }
  return study_fit(recordings);
}

/// The validation's protocol: faster and less deep.
inline StudyTest study_validation(int rest, double contact_mm) {
  StudyTest test;
  test.rest = rest;
  test.start_mm = contact_mm == 0.0 ? 0.0 : -0.3;
  test.contact_mm = contact_mm;
  test.depth_mm = 3.0 + contact_mm;
  test.rate_mm_per_s = 4.0;
  return test;
}

/// A slow test without its rest and the first steps of its ramp.
inline Recording study_recording_without_rest() {
  Random random(11);
  StudyNoise noise;
  noise.sigma_N = 2e-4;
  StudyTest slow;
  slow.rate_mm_per_s = 0.5;
  Recording cut = study_recording(slow, noise, random);
  constexpr std::ptrdiff_t kGone = 42;
  for (auto* column : {&cut.time_s, &cut.drive, &cut.response}) {
    column->erase(column->begin(), column->begin() + kGone);
  }
  return cut;
}

/// A law from recordings of specimens whose forces differ by these factors, as a request that has
/// found them.
inline ValidationRequest study_of_specimens(const std::vector<double>& stiffer,
                                            const StudyNoise& noise, Random& random) {
  std::vector<PreparedRecording> recordings;
  for (const double factor : stiffer) {
    recordings.push_back(prepare_recording("specimen " + std::to_string(recordings.size()),
                                           study_recording({}, noise, random, factor)));
  }
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = study_fit(recordings);
  for (PreparedRecording& r : recordings) {
    std::string name = r.name;
    request.calibration.files.push_back({std::move(name), "", std::move(r), ""});
  }
  request.new_specimen = true;
  return request;
}

/// Specimens whose stiffness scatters about 1, and recordings of new ones of their population.
inline Validation study_new_specimens(int calibrations, int validations, double spread,
                                      const StudyNoise& noise, Random& random,
                                      bool new_specimen = true) {
  std::vector<double> factors;
  for (int i = 0; i < calibrations; ++i) factors.push_back(1.0 + spread * random.normal());
  ValidationRequest request = study_of_specimens(factors, noise, random);
  request.new_specimen = new_specimen;
  request.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  for (int i = 0; i < validations; ++i) {
    const double factor = 1.0 + spread * random.normal();
    request.recordings.push_back(
        prepare_recording("new " + std::to_string(i),
                          study_recording(study_validation(40, 0.4), noise, random, factor)));
  }
  return validate(request);
}

inline const QuantityComparison& study_quantity(const RecordingComparison& r, QuantityKind kind) {
  return *std::ranges::find_if(
      r.quantities, [kind](const QuantityComparison& q) { return q.quantity.kind == kind; });
}

/// Counts, for peak and end of the hold.
struct StudyCounts {
  Count peak, end;
  void add(const RecordingComparison& r, double peak_error, double end_error) {
    const auto holds = [&](QuantityKind kind, double delta) {
      const QuantityComparison& q = study_quantity(r, kind);
      return std::abs(q.e.error - delta) <= q.e.expanded();
    };
    peak.add(holds(QuantityKind::peak, peak_error));
    end.add(holds(QuantityKind::end_of_hold, end_error));
  }
};

/// The true difference S - T of a law and a material, read as the comparison reads them.
struct TrueErrors {
  double peak = 0.0, end = 0.0;
};
inline TrueErrors true_errors(const LawFile& law, const StudyTest& test, double stiffer,
                              double slow_branch = 0.0) {
  Random unused(0);
  StudyNoise clean;
  clean.sigma_N = clean.zero_N = 0.0;
  const PreparedRecording truth =
      prepare_recording("truth", study_recording(test, clean, unused, stiffer, slow_branch));
  ComparisonOptions options;
  options.quantities = {{QuantityKind::peak}, {QuantityKind::end_of_hold}};
  LawFile placed = law;
  const RecordingParts parts = parts_of(truth);
  const LawAlong along(placed, truth);
  const Eigen::VectorXd s = along.at(1e-3 * test.contact_mm).value;
  const auto t = Eigen::VectorXd::Map(truth.recording.response.data(), s.size());
  const auto difference = [&](QuantityKind kind) {
    return read_quantity({kind}, parts, truth.recording, 0.0, s)->value -
           read_quantity({kind}, parts, truth.recording, 0.0, t)->value;
  };
  return {difference(QuantityKind::peak), difference(QuantityKind::end_of_hold)};
}

}  // namespace tpm::test
