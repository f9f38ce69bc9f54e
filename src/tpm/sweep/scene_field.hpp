#pragma once
#include <string>
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/bond_material.hpp"

namespace tpm::sweep {

/// A number of a scene that a sweep sets: `material.tau2`, a parameter of the first material by its
/// name in the table (parameters_of), or a JSON pointer to a number, such as /protocol/depth.
class SceneField {
 public:
  /// @param material the scene's first
  /// Throws Error(bad_input) for a target that is no number of the scene.
  SceneField(const Json& scene, const BondMaterial& material, const std::string& target,
             std::string_view where);

  [[nodiscard]] Dimension dimension() const { return dimension_; }
  [[nodiscard]] bool of_protocol() const;
  /// Of the material, the protocol or the integrator: spheres and bonds stay.
  [[nodiscard]] bool is_light() const;
  /// Of the protocol or the relaxation time: what a shared plan answers to without being made anew.
  [[nodiscard]] bool is_shared() const;

  /// A text with a unit in files.
  [[nodiscard]] bool is_quantity() const { return quantity_; }

  /// Puts an SI value where the field stands; each leaves the fields of the others alone. In a
  /// scene a quantity becomes a number (quantity_of). Throws Error(bad_input) for a fraction where
  /// the scene has a whole number, and for a value out of the range of a material's parameter.
  void set(Json& scene, double value) const;
  void set(BondMaterial& material, double value) const;
  void set(ProtocolBlock& protocol, double value) const;

 private:
  std::string target_, parameter_;  ///< parameter_: its name in the table; empty: a pointer
  Json::json_pointer pointer_;
  Dimension dimension_ = Dimension::dimensionless;
  bool quantity_ = false, whole_ = false;
};

}  // namespace tpm::sweep
