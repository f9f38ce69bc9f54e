#include "tpm/scene/experiment_scene.hpp"

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/scene/experiment_blocks.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

double tolerance_of(const Json& scene, bool inertial, const DocumentPlace& place) {
  const double tolerance = scene.value("tolerance", inertial ? 1e-5 : 1e-6);
  if (tolerance >= 1e-12 && tolerance <= 0.1) return tolerance;
  throw bad_input(place.key("tolerance").where, shortest(tolerance), "1e-12 to 0.1");
}

void require_masses(const std::vector<SceneContact>& contacts, const DocumentPlace& place) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!contacts[i].is_tool() || contacts[i].mass_kg) continue;
    throw bad_input(place.key(std::to_string(i)).key("mass_kg").where, "is missing",
                    "the tool's mass in a scene of the formulation 'inertial'");
  }
}

}  // namespace

ExperimentScene parse_experiment(const Json& scene, std::string_view where,
                                 const std::filesystem::path& folder) {
  Tissue tissue = parse_tissue(scene, where, folder);
  const DocumentPlace place{std::string(where)};
  if (!scene.contains("protocol")) {
    throw bad_input(place.key("protocol").where, "is missing",
                    "what is done to the tissue, such as {\"kind\": \"ramp_hold\", \"depth\": \"8 "
                    "mm\", \"rate\": \"4 mm/s\", \"hold\": \"29 s\"}");
  }
  std::vector<SceneContact> contacts = parse_contacts(
      scene.value("contacts", Json::array({{{"kind", "sphere"}}})), tissue, place.key("contacts"));
  Protocol protocol = parse_scene_protocol(scene.at("protocol"), place.key("protocol"));
  require_possible(protocol, contacts, tissue, place.key("protocol"));
  Formulation formulation =
      parse_formulation(scene.value("formulation", Json::object()), place.key("formulation"));
  formulation.tolerance = tolerance_of(scene, formulation.inertial(), place);
  Outputs outputs =
      parse_outputs(scene.value("outputs", Json::object()), protocol, place.key("outputs"));
  if (formulation.inertial()) require_masses(contacts, place.key("contacts"));
  require_standing(tissue, where);
  tissue.unused_blocks.clear();
  return {std::move(tissue), std::move(contacts), std::move(protocol),
          formulation,       std::move(outputs),  to_text(scene)};
}

ExperimentScene read_experiment(const std::filesystem::path& scene) {
  ExperimentScene read = parse_experiment(read_json(scene), scene.string(), scene.parent_path());
  read.text = read_file(scene);
  return read;
}

}  // namespace tpm
