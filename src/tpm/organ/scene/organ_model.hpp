#pragma once
#include <memory>
#include <vector>

#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/model.hpp"

namespace tpm::organ {

/// The quasi-static network of a scene as a model of experiments: the probe stands on the organ's
/// contact sphere, along its inward normal. Where the scene has the paper's element, the parameters
/// are its own, for every bond, and the scene's values are not used. Else they are those of the
/// scene's material by the names of its table (bond_material.hpp); its regions and their materials
/// stay what they are.
///
/// With the paper's element the spacing x scales the whole organ, probe path included (geometric
/// similarity): with s = x / x_scene a depth u answers with s^a F(u / s), where a = 1 under the
/// `paper` law of spacing and a = 2 under `continuum`, because the stiffness of a bond then grows
/// with x.
class OrganModel final : public Model {
 public:
  static constexpr double kTolerance = 1e-6;

  /// @param tissue stands (require_standing) and has a contact sphere that is free
  /// @param tolerance of the response, in parts of its largest value
  /// Throws Error(bad_input) for one without.
  explicit OrganModel(std::shared_ptr<const Tissue> tissue, double tolerance = kTolerance);

  [[nodiscard]] std::string_view name() const override { return "organ"; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override { return table_; }
  [[nodiscard]] std::pair<double, double> range(std::size_t parameter) const override;
  /// The parameters are those of the paper's element.
  [[nodiscard]] bool has_element() const { return element_; }
  /// The scene's own values of the parameters, SI; those of the paper for its element.
  [[nodiscard]] std::vector<double> own_values() const;
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;
  [[nodiscard]] Response respond_along(const Protocol& protocol, std::span<const double> times_s,
                                       std::span<const double> parameters,
                                       const Eigen::MatrixXd& along) const override;
  [[nodiscard]] std::unique_ptr<Model> surrogate() const override;

 private:
  [[nodiscard]] Response respond_by_element(const Protocol& protocol,
                                            std::span<const double> times_s,
                                            std::span<const double> parameters,
                                            const Eigen::MatrixXd& along) const;
  [[nodiscard]] Response respond_by_table(const Protocol& protocol, std::span<const double> times_s,
                                          std::span<const double> parameters,
                                          const Eigen::MatrixXd& along) const;
  /// The scene's materials with values of the first.
  [[nodiscard]] MaterialField materials_with(std::span<const double> parameters) const;

  std::shared_ptr<const Tissue> tissue_;
  double tolerance_;
  bool element_;                          ///< the paper's, without regions
  std::vector<MaterialParameter> names_;  ///< of the material's table
  std::vector<ParameterDescription> table_;
  BondSystem bonds_;
  Constraints constraints_;
  Probe probe_;
};

}  // namespace tpm::organ
