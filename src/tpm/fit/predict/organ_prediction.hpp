#pragma once
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/fit/predict/organ_bonds.hpp"
#include "tpm/fit/predict/organ_material.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {

/// An organ that answers in place of the law that was put on it (tpm material), as a model of the
/// law's parameters. With theta_B the logarithms of the bonds' parameters and theta_L the
/// coordinates of the law's uncertainty,
///
///     theta_B = theta_B0 + D (theta_L - theta_L0),   D = (J'J)^-1 J' L   (put_on_organ),
///
/// to first order the material that a fit to the changed law would have found. The organ feels the
/// depth beyond the law's contact, and the law's offset is added to its force.
class OrganOfLaw final : public Model {
 public:
  /// @param scene of the organ, with the fitted material
  /// @param natural fitted values of the bonds' parameters, SI
  /// @param follows D: a row for each of them, a column for each place of the law's uncertainty
  OrganOfLaw(Json scene, SceneOrgan organ, FittedBonds bonds, std::vector<double> natural,
             Eigen::MatrixXd follows, LawFile law);

  [[nodiscard]] std::string_view name() const override { return "organ of a law"; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override {
    return law_model_.parameters();
  }
  /// Times after the end of the protocol are not predicted: NaN. A load is answered at the surface
  /// only: Error(bad_input) for a contact or an offset beside it. The derivative by the contact is
  /// a central difference over 1e-3 of the largest depth, the others are those of the network.
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;

  /// The same organ, balanced to another tolerance (OrganModel).
  [[nodiscard]] OrganOfLaw at_tolerance(double tolerance) const;

  /// Another organ with the same bonds.
  [[nodiscard]] OrganOfLaw with(SceneOrgan organ) const;

  [[nodiscard]] const Json& scene() const { return scene_; }
  [[nodiscard]] const Organ& spheres_of_scene() const { return organ_.tissue->network.organ; }
  [[nodiscard]] const LawFile& law() const { return law_; }
  /// True if the bonds' relaxation times follow the law's; else they are kept, and the uncertainty
  /// of the law's times reaches the answer only as far as the moduli take it up.
  [[nodiscard]] bool times_follow() const { return bonds_.has_times(); }
  [[nodiscard]] std::size_t spheres() const { return organ_.tissue->network.organ.size(); }

 private:
  [[nodiscard]] std::vector<double> natural_at(std::span<const double> parameters) const;

  Json scene_;
  SceneOrgan organ_;
  FittedBonds bonds_;
  std::vector<double> natural_;
  Eigen::MatrixXd follows_;
  LawFile law_;
  LawModel law_model_;
};

/// The organ of a result of put_on_organ.
[[nodiscard]] OrganOfLaw organ_of_law(const OrganMaterial& material, std::string_view where);

/// The same from the material.json that tpm material writes. Throws Error(bad_input) for another
/// document, and for a law without uncertainty.
[[nodiscard]] OrganOfLaw organ_of_law(const Json& material, std::string_view where);

/// True if a file is a scene or a material.json, and not a law.
[[nodiscard]] bool is_organ_document(const Json& document);

/// From a scene.json, whose material.json stands beside it, or from a material.json itself. Throws
/// Error(bad_input) if there is none, and if the scene's tissue is not the one that was fitted.
[[nodiscard]] OrganOfLaw read_organ_of_law(const std::filesystem::path& path);

/// predict_law for an organ. What the organ cannot reproduce of the law is not in the band.
[[nodiscard]] LawPrediction predict_organ(const OrganOfLaw& organ, const Protocol& protocol,
                                          std::span<const double> times_s,
                                          const PredictionOptions& options);

/// predict_recording for an organ: along the ramp and hold of the recording, in straight pieces
/// within 0.2 % of its depth. Contact and offset of another recording are found by Gauss-Newton
/// steps from those of the law.
[[nodiscard]] LawPrediction predict_organ(const OrganOfLaw& organ,
                                          const PreparedRecording& recording,
                                          const PredictionOptions& options);

}  // namespace tpm::fit
