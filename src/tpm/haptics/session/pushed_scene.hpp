#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/haptics/session/session.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::haptics {

[[nodiscard]] TissueShape shape_of(const Network& network, std::size_t contact,
                                   const Eigen::Vector3d& push);

/// Spheres of its scene's tissue that a session moves: one, or a patch that moves together.
[[nodiscard]] SceneContact moved_contact(const HilSession& session, const Tissue& tissue);

/// The network of a session's scene, pushed at its contact.
struct PushedScene {
  /// Throws Error(bad_input) for a network that does not stand.
  explicit PushedScene(const HilSession& session);
  [[nodiscard]] const Positions& rest() const { return tissue.network.organ.position; }
  /// Name and shape; the model is still to come.
  [[nodiscard]] LoopModel begun(std::string_view kind, std::string_view how) const;
  [[nodiscard]] std::unique_ptr<ServoNetwork> network(double period_s) const;

  [[nodiscard]] const Probe& probe() const { return contact.probe; }
  /// Throws Error(bad_input) for a patch: the session's model knows one sphere.
  [[nodiscard]] std::size_t only_sphere() const;

  std::string model, contact_place;  ///< of the session
  Tissue tissue;
  SceneContact contact;
  double deepest_m;  ///< of the session, with some room for an operator that goes deeper
};

}  // namespace tpm::haptics
