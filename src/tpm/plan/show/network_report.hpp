#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/scene/inspection.hpp"

namespace tpm::plan {

/// Properties of a network, as docs/network.md describes the keys. Spheres are numbered
/// from 1.
[[nodiscard]] Json network_json(const Tissue& tissue, const NetworkInspection& inspection);
[[nodiscard]] std::string network_text(const Tissue& tissue, const NetworkInspection& inspection);

/// The picture that scripts/draw_network.py draws: spheres, bonds, anchors, contact.
[[nodiscard]] Json network_picture(const Tissue& tissue);

}  // namespace tpm::plan
