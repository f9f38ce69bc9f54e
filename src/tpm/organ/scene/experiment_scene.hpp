#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/scene/scene.hpp"
#include "tpmkit/formulation.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::organ {

/// By which formulation a network moves, with what settings, and which network.
struct FormulationChoice {
  std::string kind = "quasi_static";            ///< name of a Formulation
  bool masses = false;                          ///< spheres have mass
  double damping_ratio = 0.1;                   ///< with masses: of the lowest mode, 0 to 10
  double density_kg_m3 = 1060.0;                ///< with masses: of the spheres, > 0
  std::optional<double> step_s = std::nullopt;  ///< of formulations with given steps, > 0
  int sweeps = 1;                               ///< of XPBD over the bonds, a step, >= 1
  int exponentials = 1;                         ///< of reduced contacts, 1 to 3
  bool mass_spring = false;  ///< the mass-spring model on the same spheres, not the tissue
  SpringRule springs = SpringRule::like_the_bonds;
  double tolerance = 1e-6;  ///< QuasiStaticOptions, InertialOptions, MethodSettings
  StiffnessSolver solver = StiffnessSolver::automatic;  ///< of quasi_static and static
  std::string where = {};                               ///< the block, for messages

  /// The formulation chosen.
  [[nodiscard]] const Formulation& entry() const;
};

/// Outputs of a run besides positions.
struct Outputs {
  std::vector<double> times_s;  ///< rising
  bool force = true;
  bool bond_force = true;
  bool viscous = false;
};

/// Kinds of contact with the tissue.
enum class ContactKind {
  sphere,  ///< one sphere is driven itself, as in the paper
  patch,   ///< those of its layer within a radius are driven together
  ball,    ///< a rigid ball presses
  punch,   ///< a rigid flat punch presses
};

/// One of the contacts of a scene.
struct SceneContact {
  ContactKind kind = ContactKind::sphere;
  /// The sphere that is driven or aimed at, the direction, and the share of what is imposed (0: a
  /// tool that stands still).
  Probe probe;
  double radius_m = 0.0;                            ///< of patch, ball or punch
  std::optional<double> stiffness_N_per_m;          ///< of a tool's contacts
  std::optional<double> mass_kg;                    ///< of a tool
  std::optional<Protocol> protocol = std::nullopt;  ///< its own, beside or instead of the scene's

  [[nodiscard]] bool is_tool() const {
    return kind == ContactKind::ball || kind == ContactKind::punch;
  }
};

/// The word for it in scenes and results.
[[nodiscard]] std::string_view to_string(ContactKind kind);

/// The spheres that a contact of the kinds `sphere` and `patch` drives, rising.
[[nodiscard]] std::vector<std::size_t> spheres_of(const SceneContact& contact, const Organ& organ);

/// A tissue and what is done to it.
struct ExperimentScene {
  Tissue tissue;
  std::vector<SceneContact> contacts;  ///< the first is driven; results are shown from there
  Protocol protocol;
  FormulationChoice formulation;
  Outputs outputs;
  std::string text;  ///< of the scene, for the record
  /// Forces that act all along on the spheres, N; empty if there are none.
  Eigen::Matrix3Xd dead_load_N = {};
  std::vector<std::string> load_words = {};  ///< one for each load, for people

  /// Some contact besides the first has a protocol of its own.
  [[nodiscard]] bool has_own_protocols() const;
  [[nodiscard]] bool by_depth() const { return protocol.drive() == Drive::displacement; }
  /// True if the motion of the contact is imposed. The mass of such a tool changes no force on the
  /// tissue.
  [[nodiscard]] bool imposes_depth(const SceneContact& contact) const;
  /// The sphere that the first contact drives or aims at, and where to.
  [[nodiscard]] const Probe& probe() const { return contacts.front().probe; }
};

/// For commands that follow, or change, one protocol: throws Error(bad_input) with the key where a
/// contact of a scene has one of its own. Other documents pass.
void require_one_protocol(const Json& scene, const DocumentPlace& place);

/// Extent of the organ behind the probe, along its direction, m; infinite where the probe
/// pulls away from the outermost sphere.
[[nodiscard]] double tissue_behind_m(const Organ& organ, const Probe& probe);

/// Reads all blocks of a scene (docs/data_formats.md). Without a block `protocol` there is
/// nothing to do, which is an error.
/// @param where for messages, usually the file
/// @param folder that a mesh path is relative to
/// Throws Error(bad_input) with the key, also for a network that does not stand.
[[nodiscard]] ExperimentScene parse_experiment(const Json& scene, std::string_view where,
                                               const std::filesystem::path& folder);
/// The same of a scene that the schema has seen with texts where numbers stand now (quantity_of).
[[nodiscard]] ExperimentScene parse_checked_experiment(const Json& scene, std::string_view where,
                                                       const std::filesystem::path& folder);

/// The same from a file, whose bytes become the record's text.
[[nodiscard]] ExperimentScene read_experiment(const std::filesystem::path& scene);

}  // namespace tpm::organ
