#include "tpm/organ/run/simulation.hpp"

#include <cmath>

#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// A network with the contacts of a scene; tools in their order.
DrivenNetwork with_contacts(const ExperimentScene& scene, const BondSystem& bonds) {
  const Organ& organ = scene.tissue.network.organ;
  // With mass, contacts ring unless they are much stiffer; a stiffer one costs no more steps there.
  constexpr double kStifferWithMass = 100.0;
  const double usual =
      usual_contact_stiffness_N_per_m(bonds) * (scene.formulation.masses ? kStifferWithMass : 1.0);
  std::vector<Probe> driven;
  std::vector<PressedTool> tools;
  for (const SceneContact& contact : scene.contacts) {
    const Probe& probe = contact.probe;
    if (contact.is_tool()) {
      const ToolKind kind = contact.kind == ContactKind::ball ? ToolKind::sphere : ToolKind::punch;
      tools.push_back(
          {touching_tool({kind, contact.radius_m}, organ, probe.sphere, probe.direction),
           probe.share, contact.stiffness_N_per_m.value_or(usual)});
      continue;
    }
    for (const std::size_t sphere : spheres_of(contact, organ)) {
      driven.push_back({sphere, probe.direction, probe.share});
    }
  }
  return driven_network(bonds, organ, scene.tissue.constraints(), std::move(driven),
                        std::move(tools));
}

}  // namespace

RunNetwork network_to_run(const ExperimentScene& scene) {
  const Tissue& tissue = scene.tissue;
  if (!scene.formulation.mass_spring) {
    return {tissue.network, with_contacts(scene, tissue.bonds())};
  }
  const Constraints constraints = tissue.constraints();
  const double stiffness = contact_stiffness_N_per_m(tissue.bonds(), tissue.network.organ.position,
                                                     constraints, scene.probe(), 1.0);
  Network msm = msm_network(tissue.network, scene.formulation.springs);
  const BondMaterial springs = msm_material(msm, constraints, scene.probe(), stiffness);
  DrivenNetwork driven = with_contacts(scene, BondSystem(msm, springs));
  return {std::move(msm), std::move(driven)};
}

Eigen::VectorXd masses_kg(const ExperimentScene& scene, const RunNetwork& network) {
  const Organ& organ = network.network.organ;
  Eigen::VectorXd mass(network.driven.rest.cols());
  mass.head(organ.position.cols()) = sphere_masses_kg(organ, scene.formulation.density_kg_m3);
  Eigen::Index column = organ.position.cols();
  for (const SceneContact& contact : scene.contacts) {
    if (!contact.is_tool()) continue;
    if (!contact.mass_kg) throw bad_input("scene", "a tool has no mass", "mass_kg of each tool");
    mass[column++] = *contact.mass_kg;
  }
  return mass;
}

SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                       const SimulationControls& controls) {
  require_runnable(scene);
  return formulation_with<StateRunner>(scene.formulation.kind, "formulation of whole states",
                                       scene.formulation.where)
      .as<StateRunner>()
      ->simulate(scene, network, controls);
}

}  // namespace tpm::organ
