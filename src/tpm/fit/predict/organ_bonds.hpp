#pragma once
// The organ of a scene as a model, and the parameters of its bonds that tpm material fits.
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/scene/organ_model.hpp"

namespace tpm::fit {

/// The organ of a scene, driven at the sphere and in the direction of the scene's contact; without
/// a contact at the organ's contact sphere.
struct SceneOrgan {
  std::shared_ptr<const Tissue> tissue;
  std::shared_ptr<const OrganModel> model;
};

/// @param folder that a mesh path is relative to
/// Throws Error(bad_input) for a scene with other contacts than one of the kind sphere, and for an
/// organ that does not stand.
[[nodiscard]] SceneOrgan organ_of_scene(const Json& scene, std::string_view where,
                                        const std::filesystem::path& folder);

/// The parameters of a material that are fitted together, in this order: Einf, every g_j, with
/// `times` every tau_j, and those of the potential's shape (the stiffening length s). The others
/// follow: the lateral modulus is the instantaneous radial one, and a kernel that stiffens is the
/// function of the potential.
class FittedBonds {
 public:
  /// @param form material with the branches and the shapes; the values of what is fitted are not
  /// used
  FittedBonds(BondMaterial form, bool times) : form_(std::move(form)), times_(times) {}

  /// "Einf", "g1", "tau1", "stiffening".
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] std::size_t size() const { return names().size(); }
  /// True if relaxation times are among them.
  [[nodiscard]] bool has_times() const { return times_; }

  /// @param natural one value for each name, SI
  [[nodiscard]] BondMaterial material(std::span<const double> natural) const;

  /// The values of a model's parameters with this material.
  [[nodiscard]] static std::vector<double> values(const OrganModel& model,
                                                  const BondMaterial& material);

  /// Change of a model's parameters (rows) with each of these (columns).
  [[nodiscard]] Eigen::MatrixXd along(const OrganModel& model) const;

 private:
  BondMaterial form_;
  bool times_;
};

}  // namespace tpm::fit
