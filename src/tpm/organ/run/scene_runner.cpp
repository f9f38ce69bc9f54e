#include "tpm/organ/run/scene_runner.hpp"

#include <algorithm>

#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpm/organ/bonds/stiffness_blocks.hpp"

namespace tpm::organ {
namespace {

bool jumps(const Protocol& protocol) {
  const auto knots = protocol.knots();
  const auto jump = [](const Knot& a, const Knot& b) {
    return a.time_s == b.time_s && a.value != b.value;
  };
  return knots.front().value != 0.0 ||
         std::adjacent_find(knots.begin(), knots.end(), jump) != knots.end();
}

/// The graph of what moves, which is what is factorised.
const BlockPattern& pattern_of(const DrivenNetwork& driven) {
  return moving_graph(driven.bonds, driven.constraints)->pattern;
}

double blocks_of_solve(const BlockPattern& pattern) {
  return 2.0 * static_cast<double>(pattern.factor_blocks()) + static_cast<double>(pattern.nodes());
}

/// Operations of an evaluation of all bonds' forces with a back-solve, and of a factorisation.
OperationCount iteration_work(const DrivenNetwork& driven) {
  return OperationCount()
      .add(Operation::lane_bond, static_cast<double>(driven.bonds.size()))
      .add(Operation::lane_block, blocks_of_solve(pattern_of(driven)));
}

OperationCount factorisation_work(const DrivenNetwork& driven) {
  const auto products = static_cast<double>(pattern_of(driven).factor_products());
  return OperationCount()
      .add(Operation::bond_stiffness, static_cast<double>(driven.bonds.size()))
      .add(Operation::factor_product, products);
}

}  // namespace

OperationCount newton_iteration_work(const DrivenNetwork& driven) {
  OperationCount work = iteration_work(driven);
  work += factorisation_work(driven);
  return work;
}

OperationCount counted_work(const DrivenNetwork& driven, const QuasiStaticWork& work) {
  // Back-solves are those of all lanes, one an iteration; outputs cost an evaluation per kLanes.
  OperationCount count = iteration_work(driven).times(work.iterations);
  count.add(Operation::solve_block, blocks_of_solve(pattern_of(driven)) * work.factorisations);
  count += factorisation_work(driven).times(work.factorisations);
  return count;
}

Trajectory run_quasi_static(const ExperimentScene& scene, const RunNetwork& network,
                            const QuasiStaticOptions& options, const std::vector<double>& times_s,
                            bool with_field) {
  const DrivenNetwork& driven = network.driven;
  const QuasiStatic equations(driven.bonds, driven.rest, driven.constraints, driven.probes,
                              options);
  Trajectory result;
  ValidityWatch watch(scene);
  const Eigen::Index spheres = network.network.organ.position.cols();
  const auto see = [&](const QuasiStaticState& state) {
    watch.see(state.time_s, network.spheres(state.position));
    result.displacement.emplace_back(state.position.leftCols(spheres) -
                                     driven.rest.leftCols(spheres));
  };
  const QuasiStaticRun run =
      equations.run(scene.protocol, times_s, with_field ? QuasiStaticObserver(see) : nullptr);
  if (!with_field) watch.see(scene.protocol.end_s(), network.spheres(run.position));
  result.response = run.response;
  result.validity = watch.seen();
  result.work = counted_work(driven, run.work);
  result.steps = run.work.steps;
  result.error_estimate = run.error_estimate;
  return result;
}

Trajectory run_inertial(const ExperimentScene& scene, const RunNetwork& network,
                        const InertialOptions& options, const std::vector<double>& times_s,
                        bool with_field, const std::function<void(double)>& reached) {
  const DrivenNetwork& driven = network.driven;
  const Inertial equations(driven.bonds, driven.rest, driven.constraints, driven.probes,
                           masses_kg(scene, network), options);
  Trajectory result;
  const Eigen::Index spheres = network.network.organ.position.cols();
  const auto see = [&](const QuasiStaticState& state, const Eigen::VectorXd& /*pushes*/) {
    if (reached) reached(state.time_s);
    if (!with_field) return;
    result.displacement.emplace_back(state.position.leftCols(spheres) -
                                     driven.rest.leftCols(spheres));
  };
  const InertialRun run = equations.run(scene.protocol, times_s,
                                        with_field || reached ? InertialObserver(see) : nullptr);
  result.response = run.response;
  const BlockPattern& pattern = pattern_of(driven);
  const auto bonds = static_cast<double>(driven.bonds.size());
  const auto rates = static_cast<double>(run.work.rates);
  result.work.add(Operation::bond_force, 2.0 * bonds * rates)
      .add(Operation::dense_flop, 60.0 * static_cast<double>(driven.rest.cols()) * rates)
      .add(Operation::solve_block,
           blocks_of_solve(pattern) * static_cast<double>(run.work.newton_iterations));
  result.work += factorisation_work(driven).times(static_cast<double>(run.work.factorisations));
  result.steps = static_cast<double>(run.work.steps);
  return result;
}

void require_runnable(const ExperimentScene& scene) {
  const FormulationChoice& choice = scene.formulation;
  const Formulation& entry =
      formulation_with<SceneRunner>(choice.kind, "formulation of scenes", choice.where);
  const auto needs = [&](bool needed, bool Capabilities::*capability) {
    if (needed) require_can<SceneRunner>(entry, capability, choice.where);
  };
  const bool by_depth = scene.by_depth();
  needs(by_depth, &Capabilities::depth);
  needs(!by_depth, &Capabilities::load);
  needs(!scene.tissue.star || choice.mass_spring, &Capabilities::network);
  needs(jumps(scene.protocol), &Capabilities::jumps);
  const auto is_tool = [](const SceneContact& c) { return c.is_tool(); };
  const bool tools = std::any_of(scene.contacts.begin(), scene.contacts.end(), is_tool);
  needs(tools, &Capabilities::tools);
  const bool several =
      scene.contacts.size() > 1 || scene.contacts.front().kind == ContactKind::patch;
  needs(several, &Capabilities::several_contacts);
  needs(scene.has_own_protocols(), &Capabilities::own_protocols);
  needs(scene.dead_load_N.size() > 0, &Capabilities::dead_loads);
  for (const SceneContact& contact : scene.contacts) {
    if (!contact.protocol) continue;
    needs(contact.protocol->drive() == Drive::displacement, &Capabilities::depth);
    needs(contact.protocol->drive() == Drive::force, &Capabilities::load);
    needs(jumps(*contact.protocol), &Capabilities::jumps);
  }
  for (const MaterialNeed need : needs_of(scene.tissue.materials)) needs(true, need);
  for (const MaterialNeed need : needs_of(scene.tissue.bonds())) needs(true, need);
}

Trajectory run_scene(const ExperimentScene& scene, const std::vector<double>& times_s,
                     bool with_field) {
  require_runnable(scene);
  const Formulation& entry = scene.formulation.entry();
  if (with_field) {
    require_can<SceneRunner>(entry, &Capabilities::field, scene.formulation.where);
  }
  return entry.as<SceneRunner>()->run(scene, network_to_run(scene), times_s, with_field);
}

}  // namespace tpm::organ
