#include "tpm/plan/show/network_report.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

Json spread_json(const Spread& s) {
  return {{"min", rounded(s.min)}, {"mean", rounded(s.mean)}, {"max", rounded(s.max)}};
}

std::string spread_words(const Spread& s) {
  return fmt::format("{} ({} to {})", fixed(s.mean, 2), fixed(s.min, 2), fixed(s.max, 2));
}

std::string count_words(const Spread& s) {
  return fmt::format("{} ({} to {})", fixed(s.mean, 1), fixed(s.min, 0), fixed(s.max, 0));
}

Json layer_json(const NetworkInspection& inspection, std::size_t k) {
  const NearestDistances& nearest = inspection.nearest[k];
  return {{"spheres", nearest.spheres},
          {"nearest_distance_in_spacings", spread_json({nearest.min, nearest.mean, nearest.max})},
          {"lateral_bonds_of_a_sphere", spread_json(inspection.lateral_count[k])},
          {"radial_bonds_of_a_sphere", spread_json(inspection.radial_count[k])}};
}

Json moduli_json(const std::optional<EffectiveModuli>& moduli) {
  if (!moduli) return nullptr;
  return {{"E_Pa", rounded(moduli->mean_young_Pa())},
          {"E_least_Pa", rounded(moduli->young_Pa.minCoeff())},
          {"E_most_Pa", rounded(moduli->young_Pa.maxCoeff())},
          {"nu", rounded(moduli->poisson)},
          {"anisotropy", rounded(moduli->anisotropy)},
          {"spheres", moduli->spheres}};
}

std::string moduli_text(const NetworkInspection& inspection) {
  const auto& at_once = inspection.instantaneous;
  if (!at_once) return {};
  std::string text = fmt::format(
      "inside, by a patch test of {} spheres: E {} kPa ({} to {} along the axes), nu {}, "
      "anisotropy {}\n",
      at_once->spheres, significant(1e-3 * at_once->mean_young_Pa(), 3),
      significant(1e-3 * at_once->young_Pa.minCoeff(), 3),
      significant(1e-3 * at_once->young_Pa.maxCoeff(), 3), significant(at_once->poisson, 3),
      significant(at_once->anisotropy, 3));
  if (const auto& later = inspection.equilibrium) {
    text +=
        fmt::format("at equilibrium: E {} kPa, nu {}\n",
                    significant(1e-3 * later->mean_young_Pa(), 3), significant(later->poisson, 3));
  }
  return text;
}

/// The blocks of the scene that say nothing about the tissue.
std::string unused_words(const Tissue& tissue) {
  if (tissue.unused_blocks.empty()) return {};
  return fmt::format("not used here: {}\n", fmt::join(tissue.unused_blocks, ", "));
}

}  // namespace

Json network_json(const Tissue& tissue, const NetworkInspection& inspection) {
  const Organ& organ = tissue.network.organ;
  Json json{{"title", tissue.title},
            {"spheres", organ.size()},
            {"spacing_m", rounded(organ.spacing)},
            {"radius_m", rounded(organ.radius)},
            {"radial_bonds", inspection.radial_bonds},
            {"lateral_bonds", inspection.lateral_bonds},
            {"anchored_spheres", tissue.anchors.size()},
            {"anchors", tissue.anchor_words},
            {"sliding_spheres", tissue.sliders.size()},
            {"free_coordinates", inspection.free_coordinates}};
  json["layers"] = Json::array();
  for (std::size_t k = 0; k < inspection.nearest.size(); ++k) {
    json["layers"].push_back(layer_json(inspection, k));
  }
  json["radial_sum"] = spread_json(inspection.radial_sum);
  json["lateral_sum"] = spread_json(inspection.lateral_sum);
  if (organ.contact) {
    json["contact"] = {
        {"sphere", *organ.contact + 1},
        {"stiffness_over_star_instantaneous",
         rounded(inspection.contact_over_star->instantaneous, 9)},
        {"stiffness_over_star_equilibrium", rounded(inspection.contact_over_star->equilibrium, 9)}};
  }
  json["effective_instantaneous"] = moduli_json(inspection.instantaneous);
  json["effective_equilibrium"] = moduli_json(inspection.equilibrium);
  json["assumptions"] = remarks_json(organ.assumptions);
  json["unused_blocks"] = tissue.unused_blocks;
  return json;
}

std::string network_text(const Tissue& tissue, const NetworkInspection& inspection) {
  const Organ& organ = tissue.network.organ;
  std::string text = fmt::format(
      "{}: {} spheres of radius {} mm, spacing {} mm\n"
      "bonds: {} radial (between layers), {} lateral (within a layer)\n",
      tissue.title, organ.size(), significant(organ.radius * 1e3, 4),
      significant(organ.spacing * 1e3, 4), inspection.radial_bonds, inspection.lateral_bonds);
  text += fmt::format("\n{:<6} {:>8}  {:<24} {:<18} {:<18}\n", "layer", "spheres",
                      "nearest other, spacings", "lateral bonds", "radial bonds");
  for (std::size_t k = 0; k < inspection.nearest.size(); ++k) {
    const NearestDistances& n = inspection.nearest[k];
    text +=
        fmt::format("{:<6} {:>8}  {:<24} {:<18} {:<18}\n", k + 1, n.spheres,
                    spread_words({n.min, n.mean, n.max}), count_words(inspection.lateral_count[k]),
                    count_words(inspection.radial_count[k]));
  }
  text +=
      fmt::format("\nbond sums besides the contact: radial {}, lateral {} (the star: 1 and 2)\n",
                  spread_words(inspection.radial_sum), spread_words(inspection.lateral_sum));
  text += fmt::format("fixed: {} spheres{}{}; {} free coordinates\n", tissue.anchors.size(),
                      tissue.anchor_words.empty() ? "" : ", ",
                      fmt::join(tissue.anchor_words, " and "), inspection.free_coordinates);
  if (organ.contact) {
    text += fmt::format(
        "contact: sphere {}, with its neighbours fixed {} times as stiff as the star "
        "instantaneously, {} "
        "times at equilibrium\n",
        *organ.contact + 1, significant(inspection.contact_over_star->instantaneous, 7),
        significant(inspection.contact_over_star->equilibrium, 7));
  }
  text += moduli_text(inspection);
  for (const Remark& assumption : organ.assumptions) {
    text += fmt::format("assumed: {}\n", assumption.text);
  }
  return text + unused_words(tissue);
}

Json network_picture(const Tissue& tissue) {
  const Organ& organ = tissue.network.organ;
  Json json{
      {"title", tissue.title},
      {"provenance", fmt::format("computed by tpm {}; {} spheres, {} bonds; places of spheres "
                                 "and anchors are assumed where the paper prints none",
                                 version(), organ.size(), tissue.network.bonds.size())},
      {"liver", tissue.liver},
      {"radius_m", organ.radius},
      {"layer_count", organ.layer_count()}};
  json["contact"] = organ.contact ? Json(*organ.contact) : Json(nullptr);
  json["anchors"] = tissue.anchors;
  json["layer"] = organ.layer;
  json["position_m"] = array_json(organ.position.colwise(),
                                  [](const auto& p) { return array_json(p, std::identity()); });
  json["normal"] = array_json(organ.normal.colwise(), [](const auto& n) {
    return array_json(n, [](double v) { return rounded(v); });
  });
  json["bonds"] = array_json(tissue.network.bonds, [](const Bond& bond) {
    return Json{bond.a, bond.b, bond.kind == BondKind::radial ? 0 : 1};
  });
  return json;
}

}  // namespace tpm::plan
