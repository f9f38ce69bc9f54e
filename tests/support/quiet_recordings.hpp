#pragma once
// Recordings with little noise, of the material of validation_studies.hpp.
#include "validation_studies.hpp"

namespace tpm::test {

inline LawFile quiet_law() {
  Random random(3);
  StudyNoise noise;
  noise.sigma_N = 2e-4;
  return study_calibration(1, noise, random);
}

inline PreparedRecording quiet_recording(double stiffer, std::uint64_t seed = 5) {
  Random random(seed);
  StudyNoise noise;
  noise.sigma_N = 2e-4;
  return prepare_recording("validation",
                           study_recording(study_validation(200, 0.0), noise, random, stiffer));
}

/// 0.1 N within 1 s on the material of the studies, held for 20 s; depths scatter by 2 um.
inline PreparedRecording creep_recording(const LawFile& law, double stiffer, std::uint64_t seed) {
  Recording r;
  r.header.id = "creep";
  r.drive_quantity = Quantity::load;
  r.response_quantity = Quantity::indentation_depth;
  for (int i = 0; i <= 500; ++i) {
    const double t = 0.05 * i;
    r.time_s.push_back(t);
    r.drive.push_back(0.1 * std::clamp(t - 4.0, 0.0, 1.0));
  }
  Protocol load = measured_history(Drive::force, r.time_s, r.drive);
  load.set_equilibrium_at_start(true);
  std::vector<double> values{60.0, 45.0, 2.0, 0.0, 0.0};
  const Response depth = LawModel(law.spec).respond(load, r.time_s, values, Want::values);
  Random random(seed);
  for (const double d : depth.value)
    r.response.push_back(d / stiffer + 2e-6 * random.normal() + 3e-5);
  PreparedRecording prepared;
  prepared.name = "creep";
  prepared.recording = std::move(r);
  prepared.to_s = prepared.recording.time_s.back();
  return prepared;
}

inline ValidationRequest request_for(const LawFile& law, PreparedRecording recording) {
  ValidationRequest request;
  request.law_file = "law.json";
  request.law = law;
  request.recordings = {std::move(recording)};
  return request;
}

}  // namespace tpm::test
