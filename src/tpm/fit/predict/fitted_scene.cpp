#include "tpm/fit/predict/fitted_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/fit/predict/organ_material_parts.hpp"
#include "tpm/organ/scene/organ_model.hpp"

namespace tpm::fit {
namespace {

/// A material that is not the paper's element, with the fitted values.
/// @return its longest relaxation time, s
double set_material(Json& block, BondMaterial material,
                    const std::vector<ParameterDescription>& table,
                    const std::vector<double>& values) {
  Json constants = Json::object();
  for (std::size_t i = 0; i < table.size(); ++i) {
    set_value(material, table[i].name, values[i], "the fitted material");
    if (table[i].name == "A0" || table[i].name == "l0") {
      constants[std::string(table[i].name)] =
          scene_quantity(values[i], si_symbol(table[i].dimension));
    }
  }
  block = material_block(material, block);
  block.update(constants);
  double slowest_s = 0.0;
  for (const auto& b : material.branches) slowest_s = std::max(slowest_s, b.relaxation_time_s);
  return slowest_s;
}

/// The paper's constants; the spacing builds the organ.
/// @return the relaxation time, s
double set_element(Json& scene, const std::vector<ParameterDescription>& table,
                   const std::vector<double>& values, double spacing_m) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::string name(table[i].name);
    const std::string text = scene_quantity(values[i], si_symbol(table[i].dimension));
    if (name != "spacing") {
      scene["material"][name] = text;
    } else if (std::abs(values[i] - spacing_m) > 1e-9 * spacing_m) {
      scene["organ"]["spacing"] = text;
    }
  }
  const auto constant = [&](std::string_view name) {
    const auto at = std::ranges::find(table, name, &ParameterDescription::name);
    return values[static_cast<std::size_t>(at - table.begin())];
  };
  return constant("eta1") / (constant("E1") + constant("E2"));
}

/// A ramp to the largest fitted depth, at the rate of the data, and a hold.
struct FittedRamp {
  double depth_m = 0.0, rate_m_per_s = 0.0, hold_s = 0.0, longest_s = 0.0;
};

FittedRamp ramp_of(const FitResult& fit) {
  constexpr double kUsualDepth_m = 1e-3, kUsualRate_m_per_s = 1e-3, kUsualHold_s = 30.0;
  FittedRamp ramp;
  for (const FittedDatum& d : fit.data) {
    ramp.depth_m = std::max(ramp.depth_m, d.imposed_depth_m.value_or(0.0));
    if (std::isfinite(d.datum.time_s)) ramp.longest_s = std::max(ramp.longest_s, d.datum.time_s);
  }
  for (const RecordingFit& r : fit.recordings) {
    for (std::size_t i = 0; i < r.drive.size(); ++i) {
      if (!r.fitted[i] || r.drive[i] <= ramp.depth_m) continue;
      ramp.depth_m = r.drive[i];
      const double passed_s = r.time_s[i] - r.time_s.front();
      if (passed_s > 0.0) ramp.rate_m_per_s = (r.drive[i] - r.drive.front()) / passed_s;
      ramp.longest_s = r.time_s.back() - r.time_s.front();
    }
  }
  for (const DataChoice& data : fit.config.data) {
    if (data.protocol.rate_m_per_s > 0.0) ramp.rate_m_per_s = data.protocol.rate_m_per_s;
  }
  if (!(ramp.depth_m > 0.0)) ramp.depth_m = kUsualDepth_m;
  if (!(ramp.rate_m_per_s > 0.0)) ramp.rate_m_per_s = kUsualRate_m_per_s;
  const double held_s = ramp.longest_s - ramp.depth_m / ramp.rate_m_per_s;
  ramp.hold_s = held_s > 1.0 ? held_s : kUsualHold_s;
  return ramp;
}

}  // namespace

std::optional<FittedScene> fitted_scene(const FitResult& fit) {
  const FitConfig& config = fit.config;
  if (!config.organ) return std::nullopt;
  const std::filesystem::path path = config.folder / config.scene;
  FittedScene result;
  Json& scene = result.scene;
  scene = with_mesh_listed(read_json(path), path.string(), path.parent_path());
  const OrganModel model(config.organ);
  const auto described = model.parameters();
  const std::vector<ParameterDescription> table(described.begin(), described.end());
  const std::vector<double> values = model_parameters(config, fit.best.natural, 0);
  const double slowest_s =
      model.has_element() ? set_element(scene, table, values, config.organ->network.organ.spacing)
                          : set_material(scene["material"],
                                         config.organ->materials.materials.front(), table, values);
  scene["description"] = fmt::format("material: fitted, {}", config.title);

  const FittedRamp fitted = ramp_of(fit);
  const Json ramp = ramp_hold_block(fitted.depth_m, fitted.rate_m_per_s, fitted.hold_s);
  scene["protocol"] = ramp;
  scene["contacts"] = Json::array({{{"kind", "sphere"}}});
  result.session = network_session(config.title, scene, ramp, slowest_s);
  return result;
}

}  // namespace tpm::fit
