#include "tpm/plan/show/simulation_figures.hpp"

#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/run/smoothness.hpp"
#include "tpm/organ/run/step_fields.hpp"
#include "tpm/plan/show/network_report.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

namespace fs = std::filesystem;

constexpr int kDrawnDigits = 7;  // of numbers that are drawn

std::string name_of(const FiguredRun& figured) {
  return figured.scene->formulation.mass_spring ? "MSM" : "TPM";
}

template <class Numbers>
Json list_json(const Numbers& numbers, double unit = 1.0) {
  return array_json(numbers, [&](double value) { return rounded(value / unit, kDrawnDigits); });
}

Json rows_json(const Positions& position) {
  return array_json(position.colwise(), [](const auto& p) { return list_json(p); });
}

std::string roughness_words(const std::optional<Smoothness>& found) {
  if (!found) return "nothing has moved";
  std::string near =
      fmt::format("roughness {} near the contact", significant(found->near_contact, 4));
  if (!found->at_rim) return near;
  return fmt::format("{}, {} at the rim", near, significant(*found->at_rim, 4));
}

/// The tools of a network where they stand.
/// @param position of spheres and tools
Json tools_json(const DrivenNetwork& network, const Positions& position) {
  Json tools = Json::array();
  for (std::size_t i = 0; i < network.tools.size(); ++i) {
    const Tool& tool = network.tools[i].tool;
    tools.push_back({{"kind", tool.shape.kind == ToolKind::sphere ? "ball" : "punch"},
                     {"radius_m", tool.shape.radius_m},
                     {"direction", list_json(tool.direction)},
                     {"position_m", list_json(position.col(network.column_of_tool(i)))}});
  }
  return tools;
}

/// The network as it is at the last output.
Json state_json(const FiguredRun& figured) {
  const QuasiStaticState& state = figured.run->record.outputs.back();
  const Positions position = figured.network->spheres(state.position);
  const Eigen::Matrix3Xd moved = displacements_m(*figured.network, state);
  const Eigen::VectorXd lengths = moved.colwise().norm();
  const Eigen::VectorXd force = bond_forces_N(figured.network->driven.bonds, state);
  Json json{{"name", name_of(figured)},
            {"time_s", rounded(state.time_s, kDrawnDigits)},
            {"position_m", rows_json(position)},
            {"tools", tools_json(figured.network->driven, state.position)},
            {"displacement_mm", list_json(lengths, 1e-3)},
            {"bond_force_mN", list_json(force, 1e-3)}};
  json["largest_bond_force_mN"] =
      list_json(largest_bond_forces_N(figured.network->network, force), 1e-3);
  json["validity"] = ValidityWatch(*figured.scene).flags(position);
  const bool depth = figured.scene->by_depth();
  const double depth_m = depth ? state.imposed : state.response;
  const double force_N = depth ? state.response : state.imposed;
  json["summary"] = fmt::format("t = {} s, depth {} mm, force {} N", significant(state.time_s, 4),
                                significant(1e3 * depth_m, 4), significant(force_N, 4));
  json["roughness"] = roughness_words(smoothness_of(*figured.scene, state.position));
  return json;
}

std::string contact_name(const FiguredRun& figured, std::size_t sphere) {
  return fmt::format("{}, contact at sphere {}", name_of(figured), sphere);
}

/// Contacts that follow protocols of their own, which impose what the scene's does: a second jaw.
std::vector<Series> beside_series(const FiguredRun& figured, const std::vector<double>& time_s,
                                  bool imposed) {
  const ExperimentScene& scene = *figured.scene;
  const double per_unit = imposed == scene.by_depth() ? 1e3 : 1.0;
  std::vector<Series> series;
  std::size_t index = 0;
  for (std::size_t i = 1; i < scene.contacts.size(); ++i) {
    const SceneContact& contact = scene.contacts[i];
    if (!contact.protocol) continue;
    const std::size_t own = index++;
    if (contact.protocol->drive() != scene.protocol.drive()) continue;
    std::vector<double> y;
    for (const CurvePoint& p : figured.run->record.curve) {
      y.push_back(per_unit * (imposed ? value_at(*contact.protocol, p.time_s) : p.beside[own]));
    }
    series.push_back(line(contact_name(figured, contact.probe.sphere + 1), time_s, std::move(y)));
  }
  return series;
}

Panel panel_of(const std::vector<FiguredRun>& runs, bool imposed) {
  const bool length = imposed == runs.front().scene->by_depth();
  Panel panel{.title = imposed ? "Imposed" : "Response",
              .x = {"time", "s"},
              .y = length ? Axis{"indentation depth", "mm"}
                          : Axis{imposed ? "load" : "contact force", "N"}};
  for (const FiguredRun& figured : runs) {
    std::vector<double> x;
    std::vector<double> y;
    for (const CurvePoint& p : figured.run->record.curve) {
      x.push_back(p.time_s);
      y.push_back((imposed ? p.imposed : p.response) * (length ? 1e3 : 1.0));
    }
    const std::vector<Series> others = beside_series(figured, x, imposed);
    const std::size_t first = figured.scene->probe().sphere + 1;
    panel.series.push_back(line(others.empty() ? name_of(figured) : contact_name(figured, first),
                                std::move(x), std::move(y)));
    panel.series.insert(panel.series.end(), others.begin(), others.end());
    if (imposed) break;  // the same for all
  }
  return panel;
}

/// The network of the first run for scripts/draw_deformation.py: undeformed, and deformed at its
/// last output, coloured by displacement, by force, and by the limits of validity; with two runs
/// also both side by side.
Json deformation_pictures(const std::vector<FiguredRun>& runs) {
  const ExperimentScene& scene = *runs.front().scene;
  Json json = network_picture(scene.tissue);
  json["provenance"] = fmt::format(
      "model: computed by tpm {}, scene {}; {} spheres, {} bonds, deformation not magnified",
      version(), sha256_hex(scene.text).substr(0, 12), scene.tissue.network.organ.size(),
      scene.tissue.network.bonds.size());
  const Eigen::Vector3d& d = scene.probe().direction;
  json["contact"] = scene.probe().sphere;
  json["tools"] = tools_json(runs.front().network->driven, runs.front().network->driven.rest);
  json["direction"] = {d.x(), d.y(), d.z()};
  json["states"] = array_json(runs, state_json);
  return json;
}

/// Imposed value and response over time, each run a curve.
Figure response_figure(const std::vector<FiguredRun>& runs) {
  return {"response",
          runs.front().scene->tissue.title,
          fmt::format("Sphere {} of {}, computed by tpm {}", runs.front().scene->probe().sphere + 1,
                      runs.front().scene->tissue.network.organ.size(), version()),
          {panel_of(runs, true), panel_of(runs, false)}};
}

}  // namespace

std::vector<std::string> write_simulation_figures(const fs::path& folder,
                                                  const std::vector<FiguredRun>& runs) {
  write_file(folder / "pictures.json", to_text(deformation_pictures(runs)));
  std::vector<std::string> files = write_figures(folder, {response_figure(runs)});
  files.emplace_back("pictures.json");
  for (const std::string& name :
       draw_deformation(find_drawing_python(), folder / "pictures.json", folder, runs.size() > 1)) {
    files.push_back(name);
  }
  return files;
}

}  // namespace tpm::plan
