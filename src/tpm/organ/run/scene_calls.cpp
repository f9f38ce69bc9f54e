// Declared in tpmkit/scene.hpp.
#include "tpm/files/json.hpp"
#include "tpm/files/replacement.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpmkit/scene.hpp"

namespace tpm::organ {

Scene::Scene(std::shared_ptr<const ExperimentScene> scene,
             std::shared_ptr<const RunNetwork> network)
    : scene_(std::move(scene)), network_(std::move(network)) {
  if (!network_) network_ = std::make_shared<const RunNetwork>(network_to_run(*scene_));
}

Scene::Scene(const std::filesystem::path& file)
    : Scene(std::make_shared<const ExperimentScene>(read_experiment(file)), nullptr) {}

Scene Scene::parse(std::string_view json, const std::filesystem::path& folder) {
  ExperimentScene scene = parse_experiment(parse_json(json, "scene"), "scene", folder);
  scene.text = std::string(json);
  return {std::make_shared<const ExperimentScene>(std::move(scene)), nullptr};
}

Scene::Scene(const ExperimentScene& scene, const RunNetwork& network)
    : scene_(std::shared_ptr<const ExperimentScene>(), &scene),
      network_(std::shared_ptr<const RunNetwork>(), &network) {}

const std::string& Scene::title() const {
  return scene_->tissue.title;
}

const Organ& Scene::organ() const {
  return network_->network.organ;
}

std::size_t Scene::bonds() const {
  return network_->network.bonds.size();
}

const Protocol& Scene::protocol() const {
  return scene_->protocol;
}

std::size_t Scene::contact() const {
  return scene_->probe().sphere;
}

const Eigen::Vector3d& Scene::direction() const {
  return scene_->probe().direction;
}

const std::string& Scene::formulation() const {
  return scene_->formulation.kind;
}

BondElement Scene::element() const {
  return scene_->tissue.element("Scene::element()");
}

double Scene::stiffness_N_per_m(double relaxation_factor) const {
  return contact_stiffness_N_per_m(network_->driven.bonds, network_->driven.rest,
                                   network_->driven.constraints, scene_->probe(),
                                   relaxation_factor);
}

double Scene::instantaneous_stiffness_N_per_m() const {
  return stiffness_N_per_m(0.0);
}

double Scene::equilibrium_stiffness_N_per_m() const {
  return stiffness_N_per_m(1.0);
}

Trajectory Scene::run(const std::vector<double>& times_s, bool with_field) const {
  return run_scene(*scene_, times_s, with_field);
}

std::vector<std::filesystem::path> Scene::simulate(const std::filesystem::path& result) const {
  (void)Replacement(result);  // before a long run, not after it: can the result be written?
  const SimulationRun run = tpm::organ::simulate(*scene_, *network_);
  return {result, write_simulation(*scene_, *network_, run, result)};
}

}  // namespace tpm::organ
