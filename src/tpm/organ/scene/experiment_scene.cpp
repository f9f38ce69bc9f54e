#include "tpm/organ/scene/experiment_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/files/file.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

void require_masses(const std::vector<SceneContact>& contacts, std::string_view kind,
                    const DocumentPlace& place) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!contacts[i].is_tool() || contacts[i].mass_kg) continue;
    throw bad_input(place.key(std::to_string(i)).key("mass_kg").where, "is missing",
                    fmt::format("the tool's mass in a scene of the formulation '{}'", kind));
  }
}

}  // namespace

void require_one_protocol(const Json& scene, const DocumentPlace& place) {
  if (!scene.is_object() || !scene.contains("organ") || !scene.contains("contacts")) return;
  const Json& contacts = scene.at("contacts");
  if (!contacts.is_array()) return;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!contacts[i].is_object() || !contacts[i].contains("protocol")) continue;
    throw bad_input(place.key("contacts").key(std::to_string(i)).key("protocol").where,
                    "is of one contact alone",
                    "one protocol for all, in the scene's block 'protocol'");
  }
}

ExperimentScene parse_experiment(const Json& scene, std::string_view where,
                                 const std::filesystem::path& folder) {
  return parse_checked_experiment(checked(scene, scene_kind(), where), where, folder);
}

ExperimentScene parse_checked_experiment(const Json& scene, std::string_view where,
                                         const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  const SceneKeys keys = scene_block().read(scene, place, Numbers::also_si);
  Tissue tissue = tissue_of(keys, where, folder);
  const DocumentPlace at_protocol = place.key("protocol");
  const bool first_has_own =
      keys.contacts && !keys.contacts->empty() && keys.contacts->front().protocol.has_value();
  if (!keys.protocol && !first_has_own) {
    throw bad_input(at_protocol.where, "is missing",
                    "what is done to the tissue, such as {\"kind\": \"ramp_hold\", \"depth\": \"8 "
                    "mm\", \"rate\": \"4 mm/s\", \"hold\": \"29 s\"}");
  }
  if (keys.protocol && first_has_own) {
    throw bad_input(at_protocol.where, "is of no contact",
                    "none beside contacts with protocols of their own");
  }
  const DocumentPlace at_contacts = place.key("contacts");
  std::vector<SceneContact> contacts =
      keys.contacts ? contacts_of(*keys.contacts, tissue, at_contacts, folder)
                    : std::vector<SceneContact>{usual_contact(tissue, at_contacts.key("0"))};
  std::optional<Protocol> common;
  if (keys.protocol) common = protocol_of(*keys.protocol, at_protocol, folder);
  Protocol protocol = protocol_of_scene(common, contacts, at_contacts);
  require_possible(protocol, contacts, tissue, at_protocol);
  FormulationChoice formulation =
      formulation_of(keys.formulation.value_or(FormulationKeys{}), place.key("formulation"));
  formulation.tolerance = keys.tolerance.value_or(formulation.masses ? 1e-5 : 1e-6);
  Outputs outputs = outputs_of(keys.outputs.value_or(OutputKeys{}), protocol, place.key("outputs"));
  if (formulation.masses) require_masses(contacts, formulation.kind, at_contacts);
  require_standing(tissue, where);
  tissue.unused_blocks.clear();
  DeadLoads dead = loads_of(keys.loads.value_or(std::vector<LoadKeys>{}), tissue.network.organ,
                            place.key("loads"));
  return {std::move(tissue),  std::move(contacts), std::move(protocol),     std::move(formulation),
          std::move(outputs), to_text(scene),      std::move(dead.force_N), std::move(dead.words)};
}

bool ExperimentScene::has_own_protocols() const {
  return std::any_of(contacts.begin() + 1, contacts.end(),
                     [](const SceneContact& contact) { return contact.protocol.has_value(); });
}

bool ExperimentScene::imposes_depth(const SceneContact& contact) const {
  return contact.protocol.value_or(protocol).drive() == Drive::displacement;
}

ExperimentScene read_experiment(const std::filesystem::path& scene) {
  ExperimentScene read = parse_experiment(read_json(scene), scene.string(), scene.parent_path());
  read.text = read_file(scene);
  return read;
}

}  // namespace tpm::organ
