#pragma once
// Parts of parse_experiment, one per block of a scene that says what is done to the tissue.
// All throw Error(bad_input) with the key; all are given blocks that the schema has accepted.
#include "tpm/scene/experiment_scene.hpp"
#include "tpm/store/document_place.hpp"

namespace tpm {

/// Block `contacts`: the sphere that is driven, and its direction.
[[nodiscard]] Probe parse_contacts(const Json& contacts, const Tissue& tissue,
                                   const DocumentPlace& place);

/// Block `protocol`. The kinds and keys are those of fit configurations, with depth and duration.
[[nodiscard]] Protocol parse_scene_protocol(const Json& block, const DocumentPlace& place);

/// Throws unless what is imposed leaves the probe inside the organ.
void require_within(const Protocol& protocol, const Probe& probe, const Tissue& tissue,
                    const DocumentPlace& place);

/// Block `formulation`, without the tolerance.
[[nodiscard]] Formulation parse_formulation(const Json& block, const DocumentPlace& place);

/// Block `outputs`.
[[nodiscard]] Outputs parse_outputs(const Json& block, const Protocol& protocol,
                                    const DocumentPlace& place);

}  // namespace tpm
