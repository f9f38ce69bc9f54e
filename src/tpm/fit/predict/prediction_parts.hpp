#pragma once
// Parts that predictions of a law, of an organ and of a recording share.
#include "tpm/fit/fit.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpmkit/model.hpp"

namespace tpm::fit {

/// A linear root of a covariance: covariance = root root'. Singular ones are allowed.
[[nodiscard]] Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance);

/// The uncertain coordinates of a prediction and the root of their covariance. Contact and offset
/// of the recording itself stand among them where they matter.
struct UncertainCoordinates {
  std::vector<std::size_t> place;
  std::vector<Coordinate> coordinate;
  Eigen::MatrixXd root;  ///< coordinates x independent directions
};

/// The law without the recording's contact point and offset.
[[nodiscard]] LawFile at_surface(const LawFile& law);

/// Those of the fit that apply: without the recording's own contact and offset unless they are
/// the ones of the fit.
[[nodiscard]] UncertainCoordinates fitted_coordinates(const LawFile& law, Placement placement);

/// Leaves a parameter of the law out of what is uncertain of it.
void leave_out(UncertainCoordinates& u, std::size_t place);

/// True if recordings of a stretch were fitted together with slack lengths of their own: the law
/// has their mean.
[[nodiscard]] bool has_own_slack(const LawFile& law);

/// d response / d coordinate of those places.
[[nodiscard]] Eigen::MatrixXd coordinate_slopes(const Response& response,
                                                const UncertainCoordinates& u,
                                                std::span<const double> values);

/// Scatter of a new reading at an answer; none if it is not known there.
[[nodiscard]] std::optional<double> reading_sigma(const ReadingNoise& noise, double answer,
                                                  std::optional<double> own_sd);

/// Level and quantile. Throws Error(bad_input) for options out of range.
[[nodiscard]] LawPrediction begin_prediction(const LawFile& law, const PredictionOptions& options);

/// The answer of a model of the law's parameters, with both bands.
/// @param u uncertain among them
void fill_prediction(LawPrediction& p, const Model& model, const LawFile& law,
                     const Protocol& protocol, const UncertainCoordinates& u,
                     const std::vector<double>& values, std::span<const double> own_sd,
                     const PredictionOptions& options);

/// predict_law with a model of the law's parameters that stands for the law.
[[nodiscard]] LawPrediction predict_by(const Model& model, const LawFile& law,
                                       const Protocol& protocol, std::span<const double> times_s,
                                       const PredictionOptions& options);

/// Throws Error(bad_input) if a recording does not have the drive and the response of a law.
void require_quantities_of(const LawFile& law, const PreparedRecording& recording);

/// Contact and offset of a recording for a fixed material, and which parameters those are.
struct OwnPlacement {
  std::vector<double> values;      ///< of the whole law
  std::vector<std::size_t> place;  ///< of what was found
  FittedFile drifting = {};        ///< its drift, if the rests tell one
};
/// All parameters of the law as they were fitted to this recording, told by its SHA-256; none if it
/// is not among the fitted files, or if the law file does not say where it was placed.
[[nodiscard]] std::optional<std::vector<double>> values_in_fit(const LawFile& law,
                                                               const PreparedRecording& recording);
/// For the law itself, with the starts of a fit.
/// @param held contact and zero that are held
[[nodiscard]] OwnPlacement place_recording(const LawFile& law, const PreparedRecording& recording,
                                           const PredictionOptions& held = {});

/// predict_recording with such a model along a given motion.
/// @param place finds contact and offset where they are the recording's own
[[nodiscard]] LawPrediction predict_recording_by(const Model& model, const LawFile& law,
                                                 const PreparedRecording& recording,
                                                 const Protocol& motion,
                                                 const std::function<OwnPlacement()>& place,
                                                 const PredictionOptions& options);

}  // namespace tpm::fit
