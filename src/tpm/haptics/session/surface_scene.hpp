#pragma once
#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/organ/balance/ball_on_network.hpp"

namespace tpm::haptics {

/// The scene of a session with a ball on its surface.
struct SurfaceScene {
  /// Throws Error(bad_input) as PushedScene.
  explicit SurfaceScene(const HilSession& session);

  PushedScene scene;
  BallTool ball;             ///< on the contact sphere of the scene
  Eigen::Matrix3d to_model;  ///< from the coordinates of the device, the push onto the probe's
};

/// Lets slides follow the organ: the depth of its surface, as a ball meets the spheres at rest, is
/// found along their way, averaged over a few millimetres, before the session begins. Where nothing
/// is met any more, or the flank of a sphere only, it stays what it was last. Other sessions stay
/// as they are. Throws Error(bad_input) as PushedScene.
void follow_surface(HilSession& session);

/// The model of a session of the kind `surface`; its stiffness is still to come.
[[nodiscard]] LoopModel surface_model(const HilSession& session);

}  // namespace tpm::haptics
