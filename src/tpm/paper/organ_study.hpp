#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/files/keys/file_kind.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::paper {

/// A tissue that the paper's experiments are done on.
struct StudyTissue {
  std::string name;  ///< "inner layer fixed"
  std::string
      scene;  ///< file of the organ, as the configuration names it; empty: star, closed form
};

/// One fit of the study: the same data and parameters for every tissue.
struct StudyFit {
  std::string name;                ///< "relaxation"
  std::vector<FitConfig> configs;  ///< of each tissue

  /// The experiment that it is about; none where data of several are fitted together.
  [[nodiscard]] std::optional<ProtocolChoice::Kind> experiment() const;
};

/// Parameters at which all tissues are compared: the first tissue's fit, with parameters fixed if
/// so wished.
struct StudyMaterial {
  std::string name;
  std::size_t fit = 0;  ///< place in OrganStudyConfig::fits
  Hypothesis fixed;     ///< no values: the fit as it is
};

/// One experiment of which a curve is computed, SI.
struct StudyCondition {
  ProtocolChoice::Kind kind = ProtocolChoice::Kind::static_;  ///< static_, ramp_hold or creep
  double depth_m = 0.0;        ///< ramp_hold: held; static_: the curve's end
  double rate_m_per_s = 0.0;   ///< ramp_hold
  double load_N = 0.0;         ///< creep
  double duration_s = 0.0;     ///< ramp_hold: of the hold; creep: of the load
  std::vector<double> read_m;  ///< static_: depths of the tables, within the curve
};

/// Everything that decides a study (schemas/organ_experiments.schema.json).
struct OrganStudyConfig {
  std::string title, description;
  std::vector<StudyTissue> tissues;  ///< the first is what the others are compared with
  std::vector<StudyFit> fits;
  std::vector<StudyMaterial> materials;
  std::vector<StudyCondition> conditions;
};

/// The declaration of its keys.
[[nodiscard]] const FileKind& organ_study_kind();

/// Reads and checks a configuration and the scenes that it names. Throws Error(bad_input) with the
/// file and the key.
[[nodiscard]] OrganStudyConfig read_organ_study(const std::filesystem::path& path);
/// @param folder that scenes and data sets in the document are relative to
[[nodiscard]] OrganStudyConfig parse_organ_study(const Json& document, std::string_view where,
                                                 const std::filesystem::path& folder);

/// The response at one place of a curve.
struct StudyReading {
  std::string label;      ///< "peak", "end", "instantaneous", or the depth of a static force
  double x = 0.0;         ///< depth, m (static), or time, s
  double response = 0.0;  ///< N, or m (creep)
  /// Over the first tissue's response at the same material, less 1; none for that tissue itself,
  /// and none where the tissues have materials of their own.
  std::optional<double> against_first;
};

/// A tissue's answer to one experiment.
struct StudyCurve {
  std::size_t tissue = 0, condition = 0;  ///< places in OrganStudyConfig
  std::vector<double> x, response;        ///< as in StudyReading, rising x; empty if `failure`
  std::vector<StudyReading> readings;
  std::string failure;  ///< why the tissue gives no answer; empty if it does
};

/// The curves of all tissues and conditions at one material, or of each tissue at its own.
struct StudyCurves {
  std::string material;  ///< name of the StudyMaterial; "own fit"
  /// Of StudyMaterial; none where every tissue has its own.
  std::optional<TpmVector> parameters;
  std::vector<StudyCurve> curves;  ///< conditions outermost, tissues in their order

  /// Throws std::out_of_range if there is none.
  [[nodiscard]] const StudyCurve& at(std::size_t condition, std::size_t tissue) const;
};

/// One tissue's fit.
struct TissueFit {
  std::size_t fit = 0, tissue = 0;  ///< places in OrganStudyConfig
  std::optional<FitResult> result;
  std::string failure;  ///< why there is none
};

/// The readings of one experiment, and how they were imposed.
struct StudyData {
  ProtocolChoice protocol;
  PointSet points;
};

struct OrganStudy {
  OrganStudyConfig config;
  std::vector<StudyData> data;      ///< of the fits to one experiment alone
  std::vector<TissueFit> fits;      ///< fits outermost, tissues in their order
  std::vector<StudyCurves> curves;  ///< of each material, then own fits

  [[nodiscard]] const TissueFit& fit(std::size_t fit, std::size_t tissue) const {
    return fits.at(fit * config.tissues.size() + tissue);
  }
};

/// Fits every tissue to every set of data and computes the curves. A fit or a curve that a tissue
/// cannot give (Error(numerical): it buckles, say) is recorded with its reason; all other errors
/// end the study. Deterministic.
[[nodiscard]] OrganStudy run_organ_study(const OrganStudyConfig& config);

/// The answers of all tissues to all conditions at one material. No FitResult is needed.
[[nodiscard]] StudyCurves curves_at(const OrganStudyConfig& config, const std::string& name,
                                    const TpmVector& parameters);

/// One answer: the curve, and its readings without `against_first`.
[[nodiscard]] StudyCurve study_curve(const OrganStudyConfig& config, std::size_t condition,
                                     std::size_t tissue, const TpmVector& parameters);

/// Machine-readable, keys in docs/json.md; 5 significant digits, which is what the
/// organ's runs and searches are good for.
[[nodiscard]] Json to_json(const OrganStudy& study);
/// A point of an answer to an experiment: where it is and the response, under keys with units.
[[nodiscard]] Json point_json(const StudyCondition& condition, double x, double response);

}  // namespace tpm::paper
