#pragma once
// Recordings of one material that are fitted together, and how a law file predicts them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::test {

inline LawSpec spec_of(const std::string& law, Quantity drive) {
  LawSpec spec = parse_law_name(law, "test");
  spec.drive = drive;
  const bool contact = drive == Quantity::indentation_depth;
  spec.response = contact ? Quantity::contact_force : Quantity::stress;
  spec.reference = contact ? 4e-3 : 0.2;
  return spec;
}

/// Stiffnesses of 60 and 45 N/m or 20 and 30 kPa, times of 0.5 s and more; contact and offset last.
inline std::vector<double> law_values_of(const LawSpec& spec, double contact, double offset) {
  const bool force = spec.response == Quantity::contact_force;
  std::vector<double> values;
  double time_s = 0.5;
  for (const LawParameter& p : law_parameters(spec)) {
    if (p.name == "contact") {
      values.push_back(contact);
    } else if (p.name == "offset") {
      values.push_back(offset);
    } else if (p.preset) {
      values.push_back(*p.preset);
    } else if (p.dimension == Dimension::time) {
      values.push_back(time_s);
      time_s *= 6.0;
    } else if (p.name == "exponent") {
      values.push_back(1.5);
    } else if (p.dimension == Dimension::dimensionless) {
      values.push_back(p.name == "beta" ? 0.1 : 0.4);
    } else {
      values.push_back((force ? 60.0 : 20e3) / (1.0 + 0.3 * static_cast<double>(values.size())));
    }
  }
  return values;
}

/// Slack length of the first strip; the next ones were gripped 3 % longer each.
inline double slack_length_of(int k) {
  return 1.0 + 0.03 * k;
}

/// Ramp and hold at rates, contacts (or slack lengths) and offsets of their own, with noise of 0.2
/// % of the first peak.
inline std::vector<fit::PreparedRecording> joint_recordings(const LawSpec& spec, int count) {
  std::vector<fit::PreparedRecording> recordings;
  const bool stretch = spec.drive == Quantity::relative_length;
  const bool contact_force = spec.drive == Quantity::indentation_depth;
  double sd = 0.0;
  for (int k = 0; k < count; ++k) {
    Recording r;
    r.drive_quantity = spec.drive;
    r.response_quantity = spec.response;
    r.header.sha256 = std::string(63, 'a') + std::to_string(k);
    const double contact = stretch ? slack_length_of(k) : contact_force ? 1e-3 * (1 + k) : 0.0;
    const double start = contact - (spec.drive == Quantity::strain ? 0.0 : 0.2 * spec.reference);
    for (int i = 0; i < 120; ++i) {
      const double t = 0.1 * i;
      r.time_s.push_back(t);
      r.drive.push_back(start + std::clamp(0.4 * (k + 1) * (t - 1.0), 0.0, 1.2) * spec.reference);
    }
    const std::vector<double> values =
        law_values_of(spec, contact, (contact_force ? 0.01 : 100.0) * (k + 1));
    const Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
    const Eigen::VectorXd f = LawModel(spec).respond(history, r.time_s, values, Want::values).value;
    base::Random random(100 + static_cast<std::uint64_t>(k));
    if (k == 0) sd = 0.002 * f.maxCoeff();
    for (const double y : f) r.response.push_back(y + sd * random.normal());
    recordings.push_back(
        fit::prepare_recording("recording_" + std::to_string(k) + ".csv", std::move(r)));
  }
  return recordings;
}

/// Fits a law to recordings together, writes and reads the law file, and predicts each of them.
/// @param bands check as well that the readings lie in their band
inline void check_predicted_as_fitted(const std::string& law, Quantity drive, int count,
                                      bool bands) {
  const LawSpec spec = spec_of(law, drive);
  const std::vector<fit::PreparedRecording> recordings = joint_recordings(spec, count);
  fit::SetupOptions setup;
  setup.starts = 6;
  setup.profiles = false;
  const fit::FitResult fit =
      run_fit(fit::recording_config(spec, recordings, setup), fit::data_sets(recordings));
  const LawFile made = fit::fitted_law(fit);
  CAPTURE(law, quantity_name(drive), count);
  if (!made.uncertainty) return;  // not determined: tpm predict refuses such a law
  const TempFolder folder;
  write_law(folder.path() / "law.json", made);
  const LawFile read = read_law(folder.path() / "law.json");
  const std::size_t place = read.values.size() - 2;
  if (drive == Quantity::relative_length) {  // the mean
    CHECK(std::abs(read.values[place] - 0.5 * (slack_length_of(0) + slack_length_of(count - 1))) <
          0.02);
  }
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const fit::LawPrediction p = predict_recording(read, recordings[i], {});
    REQUIRE(p.recording);
    CAPTURE(i, p.contact, p.offset);
    CHECK(p.placement == fit::Placement::fitted);
    CHECK(std::abs(p.recording->fitted.rms - fit.recordings[i].rms_residual) <=
          1e-6 * fit.recordings[i].rms_residual);
    if (!bands) continue;
    REQUIRE(p.recording->fitted.share_in_reading_band);
    CHECK(*p.recording->fitted.share_in_reading_band > 0.85);
  }
}

}  // namespace tpm::test
