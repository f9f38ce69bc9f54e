#include "tpm/report/simulation_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/core/text.hpp"
#include "tpm/core/version.hpp"
#include "tpm/simulate/smoothness.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

constexpr int kDigits = 9;
constexpr std::size_t kMostNamed = 12;

bool by_depth(const ExperimentScene& scene) {
  return scene.protocol.drive() == Drive::displacement;
}

/// The first point of the largest response; what differs by less than the tolerance is the same.
const CurvePoint& largest(const SimulationRecord& record, double tolerance) {
  double most = 0.0;
  for (const CurvePoint& p : record.curve) most = std::max(most, std::abs(p.response));
  return *std::find_if(record.curve.begin(), record.curve.end(), [&](const CurvePoint& p) {
    return std::abs(p.response) >= (1.0 - tolerance) * most;
  });
}

Json validity_json(const Validity& validity) {
  Json json{{"kept", validity.whole()},
            {"deepest_m", rounded(validity.deepest_m, kDigits)},
            {"most_turned_rad", rounded(validity.most_turned_rad, kDigits)}};
  json["limits"] = Json::array();
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    const ValidityBreach& breach = validity.of(limit);
    Json entry{{"limit", key_of(limit)}, {"passed", breach.first_time_s.has_value()}};
    entry["first_time_s"] =
        breach.first_time_s ? Json(rounded(*breach.first_time_s, kDigits)) : Json(nullptr);
    entry["spheres"] = Json::array();
    for (const std::size_t sphere : breach.spheres) entry["spheres"].push_back(sphere + 1);
    json["limits"].push_back(entry);
  }
  return json;
}

Json energy_json(const SimulationRun& run) {
  if (run.record.inertial_energy) {
    const InertialEnergy& e = *run.record.inertial_energy;
    return {{"work_J", rounded(e.work, kDigits)},
            {"stored_J", rounded(e.stored, kDigits)},
            {"dissipated_J", rounded(e.bond_heat + e.damping_heat, kDigits)},
            {"kinetic_J", rounded(e.kinetic, kDigits)}};
  }
  const QuasiStaticEnergy& e = run.record.curve.back().energy;
  return {{"work_J", rounded(e.work_J, kDigits)},
          {"stored_J", rounded(e.stored_J, kDigits)},
          {"dissipated_J", rounded(e.dissipated_J, kDigits)}};
}

Json smoothness_json(const std::optional<Smoothness>& smoothness) {
  if (!smoothness) return nullptr;
  Json json{{"near_contact", rounded(smoothness->near_contact, kDigits)},
            {"near_spheres", smoothness->near_spheres},
            {"rim_spheres", smoothness->rim_spheres}};
  json["at_rim"] = smoothness->at_rim ? Json(rounded(*smoothness->at_rim, kDigits)) : Json(nullptr);
  return json;
}

std::string smoothness_text(const std::optional<Smoothness>& smoothness) {
  if (!smoothness) return "";
  return fmt::format("roughness at the end: {} near the contact ({} spheres){}\n",
                     significant(smoothness->near_contact, 4), smoothness->near_spheres,
                     smoothness->at_rim
                         ? fmt::format(", {} at the rim ({} spheres)",
                                       significant(*smoothness->at_rim, 4), smoothness->rim_spheres)
                         : std::string());
}

/// "71, 72 and 3 others"
std::string named(const std::vector<std::size_t>& spheres) {
  std::string text;
  for (std::size_t i = 0; i < std::min(spheres.size(), kMostNamed); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : ", ", spheres[i] + 1);
  }
  if (spheres.size() > kMostNamed)
    text += fmt::format(" and {} others", spheres.size() - kMostNamed);
  return text;
}

std::string validity_text(const Validity& validity) {
  std::string text =
      fmt::format("deepest indentation of a sphere {} mm, most turned lateral bond {} degrees\n",
                  significant(1e3 * validity.deepest_m, 4),
                  significant(validity.most_turned_rad * 180.0 / std::numbers::pi, 4));
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    const ValidityBreach& breach = validity.of(limit);
    if (!breach.first_time_s) continue;
    text += fmt::format("WARNING: {}: from {} s on; sphere{} {}\n", words_of(limit),
                        significant(*breach.first_time_s, 4), breach.spheres.size() == 1 ? "" : "s",
                        named(breach.spheres));
  }
  if (validity.whole()) text += "no limit of validity is passed\n";
  return text;
}

std::string equations_text(const ExperimentScene& scene, const SimulationRun& run) {
  const Formulation& f = scene.formulation;
  const char* network = f.mass_spring ? "mass-spring model" : "tissue";
  if (!f.inertial()) {
    return fmt::format("{}, {}, tolerance {}\n", network,
                       f.kind == FormulationKind::relaxed
                           ? "static: everything has relaxed at each time"
                           : "quasi-static",
                       shortest(f.tolerance));
  }
  return fmt::format("{} with mass, damping ratio {} of its lowest mode ({} Hz), tolerance {}\n",
                     network, shortest(f.damping_ratio), significant(run.lowest_frequency_Hz, 4),
                     shortest(f.tolerance));
}

}  // namespace

Json simulation_json(const ExperimentScene& scene, const SimulationRun& run) {
  const Formulation& f = scene.formulation;
  const SimulationRecord& record = run.record;
  const bool depth = by_depth(scene);
  const Eigen::Vector3d& d = scene.probe.direction;
  Json json{{"title", scene.tissue.title},
            {"version", version()},
            {"scene_sha256", sha256_hex(scene.text)},
            {"network", f.mass_spring ? "mass_spring" : "tissue"},
            {"formulation", word_of(f.kind)},
            {"tolerance", f.tolerance},
            {"spheres", scene.tissue.network.organ.size()},
            {"bonds", scene.tissue.network.bonds.size()},
            {"contact",
             {{"sphere", scene.probe.sphere + 1},
              {"direction", {rounded(d.x(), 9), rounded(d.y(), 9), rounded(d.z(), 9)}}}},
            {"imposed", depth ? "depth_m" : "load_N"},
            {"response", depth ? "force_N" : "depth_m"}};
  const auto point = [](const CurvePoint& p) {
    return Json{{"time_s", rounded(p.time_s, kDigits)},
                {"imposed", rounded(p.imposed, kDigits)},
                {"response", rounded(p.response, kDigits)}};
  };
  json["largest"] = point(largest(record, f.tolerance));
  json["last"] = point(record.curve.back());
  json["outputs"] = record.outputs.size();
  json["energy"] = energy_json(run);
  json["roughness"] = smoothness_json(smoothness_of(scene, record.outputs.back().position));
  json["error_estimate"] = f.kind == FormulationKind::quasi_static
                               ? Json(rounded(record.error_estimate, 3))
                               : Json(nullptr);
  json["resumed_at_s"] = run.resumed_at_s ? Json(*run.resumed_at_s) : Json(nullptr);
  json["validity"] = validity_json(record.validity);
  return json;
}

std::string simulation_text(const ExperimentScene& scene, const SimulationRun& run) {
  const SimulationRecord& record = run.record;
  const bool depth = by_depth(scene);
  const auto response = [&](const CurvePoint& p) {
    return depth ? fmt::format("{} N at a depth of {} mm", significant(p.response, 6),
                               significant(1e3 * p.imposed, 4))
                 : fmt::format("{} mm under a load of {} N", significant(1e3 * p.response, 6),
                               significant(p.imposed, 4));
  };
  std::string text =
      fmt::format("{}: sphere {} of {} is {}\n", scene.tissue.title, scene.probe.sphere + 1,
                  scene.tissue.network.organ.size(), depth ? "pushed to a depth" : "loaded");
  text += equations_text(scene, run);
  if (run.resumed_at_s) {
    text += fmt::format("resumed at {} s from a checkpoint\n", significant(*run.resumed_at_s, 4));
  }
  const CurvePoint& most = largest(record, scene.formulation.tolerance);
  text += fmt::format("largest {}: {}, at {} s\n", depth ? "force" : "depth", response(most),
                      significant(most.time_s, 4));
  text += fmt::format("at the end, {} s: {}\n", significant(record.curve.back().time_s, 4),
                      response(record.curve.back()));
  text += smoothness_text(smoothness_of(scene, record.outputs.back().position));
  return text + validity_text(record.validity);
}

}  // namespace tpm
