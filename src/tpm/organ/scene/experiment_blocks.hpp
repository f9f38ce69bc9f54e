#pragma once
// The blocks of a scene that say what is done to the tissue: the declaration of their keys, and
// what they lead to. All throw Error(bad_input) with the key.
#include "tpm/base/namespaces.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/contact_motion.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::organ {

/// An entry of `contacts` as a file says it.
struct ContactKeys {
  ContactKind kind = ContactKind::sphere;
  std::optional<std::size_t> number;
  std::optional<PointKeys> at;
  std::optional<std::array<double, 3>> direction;
  double share = 1.0, radius_m = 0.0;
  std::optional<double> stiffness_N_per_m, mass_kg;
  std::optional<ContactMotionKeys> protocol;
};
[[nodiscard]] const Kinds<ContactKeys, ContactKind>& contact_kinds();

/// The contacts of a scene. At least one of them is driven.
/// @param folder that the path of a recording is relative to
[[nodiscard]] std::vector<SceneContact> contacts_of(const std::vector<ContactKeys>& contacts,
                                                    const Tissue& tissue,
                                                    const DocumentPlace& place,
                                                    const std::filesystem::path& folder);

/// The protocol of the first contact, held until those of all contacts have ended.
/// @param common of the contacts without one of their own, if the scene has it
/// Throws Error(bad_input) for a driven contact without any, and for histories that begin at
/// different times.
[[nodiscard]] Protocol protocol_of_scene(const std::optional<Protocol>& common,
                                         const std::vector<SceneContact>& contacts,
                                         const DocumentPlace& place);

/// One of them, as a session says it.
[[nodiscard]] SceneContact parse_contact(const Json& block, const Tissue& tissue,
                                         const DocumentPlace& place);

/// The contact of a scene or session that names none: the organ's contact sphere, driven against
/// its normal.
[[nodiscard]] SceneContact usual_contact(const Tissue& tissue, const DocumentPlace& place);

/// Throws unless what is imposed leaves every contact inside the organ and no tool pulls.
void require_possible(const Protocol& protocol, const std::vector<SceneContact>& contacts,
                      const Tissue& tissue, const DocumentPlace& place);

/// Block `formulation` as a file says it.
struct FormulationKeys {
  std::string kind = FormulationChoice{}.kind;  ///< the current name
  std::optional<bool> masses, mass_spring;
  std::optional<SpringRule> springs;
  std::optional<double> damping_ratio, density_kg_m3, step_s;
  std::optional<int> sweeps, exponentials;
  std::optional<StiffnessSolver> solver;
};
/// Its kinds are the formulations that the program links, each with the keys that it takes.
[[nodiscard]] ValueType<FormulationKeys> formulation_type();
/// Without the tolerance.
[[nodiscard]] FormulationChoice formulation_of(const FormulationKeys& block,
                                               const DocumentPlace& place);

enum class OutputField { force, bond_force, viscous };

/// Block `outputs` as a file says it.
struct OutputKeys {
  std::optional<std::vector<double>> times_s;
  std::optional<int> count;
  std::optional<double> spacing_s;
  std::optional<std::vector<OutputField>> fields;
};
[[nodiscard]] const Block<OutputKeys>& outputs_block();
[[nodiscard]] Outputs outputs_of(const OutputKeys& block, const Protocol& protocol,
                                 const DocumentPlace& place);

}  // namespace tpm::organ
