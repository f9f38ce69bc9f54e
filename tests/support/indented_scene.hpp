#pragma once
// A patch glued to a punch on an organ that stands on its far side, for both equilibrium solvers.
#include <catch2/catch.hpp>

#include "indentation.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver_surface.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::organ {
/// A network that stands on its far side while a patch is pushed along a direction.
struct IndentedScene {
  IndentedScene(Organ organ, double patch_radius, double far_thickness,
                const Eigen::Vector3d& direction = Eigen::Vector3d::UnitZ())
      : network(build_network(std::move(organ), {}, "scene")),
        bonds(network, TpmParameters{}),
        constraints(network.organ.size()) {
    const Organ& body = network.organ;
    Eigen::Index front = 0;
    (body.position.transpose() * direction).minCoeff(&front);
    if (body.contact) front = static_cast<Eigen::Index>(*body.contact);
    push.direction = direction;
    push.patch = surface_patch(body, body.position.col(front), patch_radius);
    for (const std::size_t i : push.patch) constraints.fix(i);
    for (const std::size_t i : far_side(body, direction, far_thickness)) constraints.fix(i);
  }
  Network network;
  BondSystem bonds;
  Constraints constraints;
  PatchIndentation push;
  [[nodiscard]] const Positions& rest() const { return network.organ.position; }
};

inline Organ solid_liver(std::size_t count) {
  SolidRequest request;
  request.count = count;
  return fill_solid(liver_surface(LiverShape{}), request);
}

/// Demands the same force and positions of the direct and the iterative solver, to 1e-8.
inline void compare_solvers(IndentedScene scene) {
  scene.push.strides = 2;
  scene.push.tolerance_N = 1e-12;  // both are looked at to 1e-8 of the depth
  Equilibrium direct(scene.bonds, scene.constraints);
  LargeEquilibrium large(scene.bonds, scene.constraints, scene.rest());
  const auto a =
      indent(scene.bonds, scene.constraints, scene.rest(), scene.push, finder_of(direct));
  const auto b = indent(scene.bonds, scene.constraints, scene.rest(), scene.push, finder_of(large));
  CAPTURE(scene.network.organ.name, a.newton_steps, b.newton_steps, large.work().iterations);
  CHECK(a.force_N > 0.0);
  CHECK_THAT(b.force_N, Catch::Matchers::WithinRel(a.force_N, 1e-8));
  CHECK((a.position - b.position).cwiseAbs().maxCoeff() < 1e-8 * scene.push.depth_m);
  CHECK(b.residual_N <= scene.push.tolerance_N);
  CHECK(b.imbalance_N < 1e-10 * b.force_N);
}

}  // namespace tpm::organ
