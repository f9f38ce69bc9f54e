#include "tpm/organ/scene/experiment_scene.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/renamed_names.hpp"
#include "tpm/organ/scene/experiment_blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

double tolerance_of(const Json& scene, bool masses, const DocumentPlace& place) {
  const double tolerance = scene.value("tolerance", masses ? 1e-5 : 1e-6);
  if (tolerance >= 1e-12 && tolerance <= 0.1) return tolerance;
  throw bad_input(place.key("tolerance").where, shortest(tolerance), "1e-12 to 0.1");
}

void require_masses(const std::vector<SceneContact>& contacts, std::string_view kind,
                    const DocumentPlace& place) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!contacts[i].is_tool() || contacts[i].mass_kg) continue;
    throw bad_input(place.key(std::to_string(i)).key("mass_kg").where, "is missing",
                    fmt::format("the tool's mass in a scene of the formulation '{}'", kind));
  }
}

}  // namespace

ExperimentScene parse_experiment(const Json& scene, std::string_view where,
                                 const std::filesystem::path& folder) {
  return parse_checked_experiment(checked(scene, "scene", where), where, folder);
}

ExperimentScene parse_checked_experiment(const Json& scene, std::string_view where,
                                         const std::filesystem::path& folder) {
  Tissue tissue = parse_checked_tissue(scene, where, folder);
  const DocumentPlace place{std::string(where)};
  if (!scene.contains("protocol")) {
    throw bad_input(place.key("protocol").where, "is missing",
                    "what is done to the tissue, such as {\"kind\": \"ramp_hold\", \"depth\": \"8 "
                    "mm\", \"rate\": \"4 mm/s\", \"hold\": \"29 s\"}");
  }
  const DocumentPlace at_contacts = place.key("contacts");
  std::vector<SceneContact> contacts =
      scene.contains("contacts")
          ? parse_contacts(scene.at("contacts"), tissue, at_contacts)
          : std::vector<SceneContact>{usual_contact(tissue, at_contacts.key("0"))};
  const DocumentPlace at_protocol = place.key("protocol");
  Protocol protocol = parse_protocol_block(scene.at("protocol"), at_protocol, Openness::complete)
                          .protocol(at_protocol);
  require_possible(protocol, contacts, tissue, at_protocol);
  FormulationChoice formulation =
      parse_formulation(scene.value("formulation", Json::object()), place.key("formulation"));
  formulation.tolerance = tolerance_of(scene, formulation.masses, place);
  Outputs outputs =
      parse_outputs(scene.value("outputs", Json::object()), protocol, place.key("outputs"));
  if (formulation.masses) require_masses(contacts, formulation.kind, place.key("contacts"));
  require_standing(tissue, where);
  tissue.unused_blocks.clear();
  return {std::move(tissue),      std::move(contacts), std::move(protocol),
          std::move(formulation), std::move(outputs),  to_text(scene)};
}

ExperimentScene read_experiment(const std::filesystem::path& scene) {
  ExperimentScene read = parse_experiment(read_json(scene), scene.string(), scene.parent_path());
  read.text = read_file(scene);
  return read;
}

}  // namespace tpm::organ
