#pragma once
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/remark.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/validate/pooled.hpp"

namespace tpm::fit {

/// Properties of the recordings that a law was fitted to.
struct CalibrationData {
  struct File {
    std::string name, sha256;
    std::optional<PreparedRecording> recording;  ///< if the file was found with its SHA-256
    std::string samples_sha256 = {};  ///< of its numbers; empty: the law does not state it
  };
  std::vector<File> files;
  std::optional<Instrument> instrument;  ///< of all of them
  std::vector<Remark> remarks;           ///< what is not known, and why
};

/// Looks for the files that a law names, beside the law and in the current folder; a file counts if
/// its SHA-256 is the one in the law.
/// @param law_file path of the law, or of the organ that it was put on
/// @param digests sample_digests() of the law
/// @param ways each reads and prepares a file as a recording, such as with the options of the new
///             recordings and without; the first counts that gives the numbers that were fitted.
///             Errors of the first are told in remarks
[[nodiscard]] CalibrationData find_calibration(
    const LawFile& law, const std::filesystem::path& law_file,
    const std::vector<std::string>& digests,
    const std::vector<std::function<PreparedRecording(const std::string&)>>& ways);

/// Request of a validation: see docs/validate.md.
struct ValidationRequest {
  LawFile law;
  std::string law_file, law_sha256;
  std::vector<PreparedRecording> recordings;           ///< one or more
  std::vector<std::optional<Instrument>> instruments;  ///< of each
  CalibrationData calibration;
  std::vector<QuantityOfInterest> quantities;  ///< empty: the defaults of each recording
  std::optional<Requirement> requirement;
  PlacementRule placement = PlacementRule::held;
  bool contact_by_threshold = false;
  /// The recordings are of new specimens of the population that those of the calibration are from,
  /// each of another specimen: their spread is in u_input.
  bool new_specimen = false;
  std::optional<std::string> at;            ///< see PooledOptions::at
  std::shared_ptr<const OrganOfLaw> organ;  ///< answers in place of the law
  PickAnswer pick = nullptr;                ///< answers in place of the organ
  /// The recordings are presses of a session: what it knows of each. Empty: they are none.
  std::vector<SessionMotion> presses;
  std::vector<Remark> remarks;  ///< what is to be said with the result
  std::string session;          ///< file whose rendering is part of S; empty: none
  std::vector<RenderingError> rendering;
};

struct Validation {
  LawSpec spec;
  std::string subject;  ///< "linear kernel, ...", "... on an organ of 142 spheres"
  std::string session;  ///< file whose rendering is part of S; empty: none
  std::vector<RenderingError> rendering;
  std::string law_file, law_sha256, requirement;
  PlacementRule placement = PlacementRule::held;
  std::string u_input_from;  ///< where the covariance of the law's parameters comes from
  bool new_specimen = false;
  std::vector<SpecimenSpread>
      specimens;  ///< of a new specimen: how those of the calibration differ
  std::vector<RecordingComparison> recordings;
  std::vector<Applicability> applicability;  ///< one a recording
  std::vector<PooledQuantity> pooled;        ///< over those that the law was not fitted to
  std::vector<QuantityComparison> alone;     ///< of several recordings, what only one of them has
  std::vector<CalibrationData::File> calibration;
  ModelVerdict verdict = ModelVerdict::not_seen;
  std::vector<Remark> remarks;

  /// Exit code of a program that asked: no only where a requirement is not shown to be met.
  [[nodiscard]] bool answers_yes() const {
    return requirement.empty() || verdict == ModelVerdict::adequate;
  }
  /// The recordings are presses of a session: forces that its model answered, none measured.
  [[nodiscard]] bool of_session() const {
    return !recordings.empty() && std::ranges::all_of(recordings, [](const RecordingComparison& r) {
      return r.part.hold_asked_s.has_value();
    });
  }
};

/// u_input from with_calibration_covariance() where all recordings of the calibration were found,
/// else from the law's covariance. Throws Error(bad_input) for a law without uncertainty or
/// recordings of other quantities.
[[nodiscard]] Validation validate(const ValidationRequest& request);

/// Change of each quantity by rendering: the rendered force over that of the subject along the
/// hand's own motion, from a validation whose recordings are presses of a session.
[[nodiscard]] std::vector<RenderingError> rendering_errors(const Validation& presses);

/// "ramp from 1 s to 5.1 s, 4.04 mm deep, and hold to 25 s: the whole press"
[[nodiscard]] std::string part_words(const RecordingComparison& recording, const LawSpec& law);

/// "no model error is seen above the uncertainty", "a model error: peak force -14.2 +- 2.3 mN", ...
[[nodiscard]] std::string conclusion_words(const Validation& validation);

[[nodiscard]] std::string to_terminal_text(const Validation& validation);
[[nodiscard]] Json to_json(const Validation& validation);
/// One row a recording and quantity, then one a pooled quantity; SI. Behind those of a recording,
/// and of the means, stands the verdict of all quantities.
[[nodiscard]] std::string to_csv(const Validation& validation);

}  // namespace tpm::fit
