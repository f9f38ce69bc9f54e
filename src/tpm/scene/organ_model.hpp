#pragma once
#include <memory>

#include "tpm/model/model.hpp"
#include "tpm/network/quasistatic.hpp"
#include "tpm/scene/scene.hpp"

namespace tpm {

/// The quasi-static network of a scene as a model of experiments: the probe stands on the organ's
/// contact sphere, along its inward normal. The parameters are those of the paper's element, for
/// every bond; the scene's own material is not used.
///
/// The spacing x scales the whole organ, probe path included (geometric similarity): with s = x /
/// x_scene a depth u answers with s^a F(u / s), where a = 1 under the `paper` law of spacing and
/// a = 2 under `continuum`, because the stiffness of a bond then grows with x.
class OrganModel final : public Model {
 public:
  /// @param tissue stands (require_standing) and has a contact sphere that is free
  /// Throws Error(bad_input) for one without.
  explicit OrganModel(std::shared_ptr<const Tissue> tissue);

  [[nodiscard]] std::string_view name() const override { return "organ"; }
  [[nodiscard]] std::span<const ParameterDescription> parameters() const override {
    return kTpmParameterTable;
  }
  [[nodiscard]] Response respond(const Protocol& protocol, std::span<const double> times_s,
                                 std::span<const double> parameters, Want want) const override;
  [[nodiscard]] Response respond_along(const Protocol& protocol, std::span<const double> times_s,
                                       std::span<const double> parameters,
                                       const Eigen::MatrixXd& along) const override;
  [[nodiscard]] std::unique_ptr<Model> scout() const override;

 private:
  std::shared_ptr<const Tissue> tissue_;
  BondSystem bonds_;
  Freedom freedom_;
  Probe probe_;
};

}  // namespace tpm
