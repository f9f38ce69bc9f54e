#include "tpm/organ/run/simulation.hpp"

#include <algorithm>
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
  const Constraints constraints = scene.tissue.constraints();
  Loading loading;
  std::optional<Organ> sagged;
  if (scene.dead_load_N.size() > 0) {
    loading.dead_N = scene.dead_load_N;
    loading.unloaded = organ.position;
    sagged = organ;
    sagged->position = loaded_positions(bonds, organ.position, constraints, loading.dead_N);
  }
  const Organ& at_start = sagged ? *sagged : organ;
  std::vector<Probe> driven;
  std::vector<PressedTool> tools;
  for (std::size_t i = 0; i < scene.contacts.size(); ++i) {
    const SceneContact& contact = scene.contacts[i];
    const Probe& probe = contact.probe;
    std::size_t group = 0;
    if (i > 0 && contact.protocol) {
      loading.beside.push_back({{}, *contact.protocol});
      group = loading.beside.size();
    }
    if (contact.is_tool()) {
      const ToolKind kind = contact.kind == ContactKind::ball ? ToolKind::sphere : ToolKind::punch;
      tools.push_back(
          {touching_tool({kind, contact.radius_m}, at_start, probe.sphere, probe.direction),
           probe.share, contact.stiffness_N_per_m.value_or(usual), group});
      continue;
    }
    auto& of_group = group == 0 ? driven : loading.beside.back().probes;
    for (const std::size_t sphere : spheres_of(contact, organ)) {
      of_group.push_back({sphere, probe.direction, probe.share});
    }
  }
  return driven_network(bonds, at_start, constraints, std::move(driven), std::move(tools),
                        std::move(loading));
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

Eigen::VectorXd masses_kg(const ExperimentScene& scene, const RunNetwork& network,
                          std::optional<double> of_imposed_kg) {
  const Organ& organ = network.network.organ;
  Eigen::VectorXd mass(network.driven.rest.cols());
  mass.head(organ.position.cols()) = sphere_masses_kg(organ, scene.formulation.density_kg_m3);
  Eigen::Index column = organ.position.cols();
  for (const SceneContact& contact : scene.contacts) {
    if (!contact.is_tool()) continue;
    std::optional<double> own = contact.mass_kg;
    if (!own && scene.imposes_depth(contact)) own = of_imposed_kg;
    if (!own) throw bad_input("scene", "a tool has no mass", "mass_kg of each tool");
    mass[column++] = *own;
  }
  return mass;
}

const CurvePoint& largest_point(const std::vector<CurvePoint>& curve, double tolerance) {
  double most = std::abs(curve.back().response);
  for (const CurvePoint& p : curve) {
    if (counts(p)) most = std::max(most, std::abs(p.response));
  }
  const auto first = std::ranges::find_if(curve, [&](const CurvePoint& p) {
    return counts(p) && std::abs(p.response) >= (1.0 - tolerance) * most;
  });
  return first == curve.end() ? curve.back() : *first;
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
