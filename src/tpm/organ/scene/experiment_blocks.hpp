#pragma once
// Parts of parse_experiment, one per block of a scene that says what is done to the tissue.
// All throw Error(bad_input) with the key; all are given blocks that the schema has accepted.
#include "tpm/base/namespaces.hpp"
#include "tpm/files/document_place.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::organ {

/// A kind of block, and the keys that go with it.
template <class Kind>
struct KindKeys {
  Kind meaning;
  std::string_view text;
  std::vector<std::string_view> needed, allowed;
};

/// Block `contacts`. At least one of them is driven.
[[nodiscard]] std::vector<SceneContact> parse_contacts(const Json& contacts, const Tissue& tissue,
                                                       const DocumentPlace& place);

/// One of them.
[[nodiscard]] SceneContact parse_contact(const Json& block, const Tissue& tissue,
                                         const DocumentPlace& place);

/// The contact of a scene or session that names none: the organ's contact sphere, driven against
/// its normal.
[[nodiscard]] SceneContact usual_contact(const Tissue& tissue, const DocumentPlace& place);

/// Throws unless what is imposed leaves every contact inside the organ and no tool pulls.
void require_possible(const Protocol& protocol, const std::vector<SceneContact>& contacts,
                      const Tissue& tissue, const DocumentPlace& place);

/// Block `formulation`, without the tolerance.
[[nodiscard]] FormulationChoice parse_formulation(const Json& block, const DocumentPlace& place);

/// Block `outputs`.
[[nodiscard]] Outputs parse_outputs(const Json& block, const Protocol& protocol,
                                    const DocumentPlace& place);

}  // namespace tpm::organ
