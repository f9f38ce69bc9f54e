#include "tpm/plan/show/trajectory_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpmkit/model.hpp"
#include "tpmkit/units.hpp"
#include "tpmkit/version.hpp"

namespace tpm::plan {
namespace {

constexpr int kRunDigits = 9;

Eigen::Index largest_of(const Trajectory& answer) {
  Eigen::Index at = 0;
  answer.response.cwiseAbs().maxCoeff(&at);
  return at;
}

/// Of the times of an answer with fields, those at which the scene asks for the whole network.
std::vector<std::size_t> stored_steps(const ExperimentScene& scene,
                                      const std::vector<double>& times_s,
                                      const Trajectory& answer) {
  std::vector<std::size_t> steps;
  const std::vector<double>& wanted = scene.outputs.times_s;
  for (std::size_t i = 0; i < answer.displacement.size(); ++i) {
    if (std::binary_search(wanted.begin(), wanted.end(), times_s[i])) steps.push_back(i);
  }
  return steps;
}

}  // namespace

Json scene_run_members(const ExperimentScene& scene) {
  return {{"title", scene.tissue.title},
          {"version", version()},
          {"scene_sha256", sha256_hex(scene.text)},
          {"network", scene.formulation.mass_spring ? "mass_spring" : "tissue"},
          {"formulation", scene.formulation.kind},
          {"tolerance", scene.formulation.tolerance}};
}

void add_course(Json& json, const ExperimentScene& scene, const CurvePoint& largest,
                const CurvePoint& last, std::size_t outputs) {
  const auto point = [](const CurvePoint& p) {
    return Json{{"time_s", rounded(p.time_s, kRunDigits)},
                {"imposed", rounded(p.imposed, kRunDigits)},
                {"response", rounded(p.response, kRunDigits)}};
  };
  json["imposed"] = scene.by_depth() ? "depth_m" : "load_N";
  json["response"] = scene.by_depth() ? "force_N" : "depth_m";
  json["largest"] = point(largest);
  json["last"] = point(last);
  json["outputs"] = outputs;
}

void add_trajectory(Json& json, const ExperimentScene& scene, const std::vector<double>& times_s,
                    const Trajectory& answer) {
  const auto point = [&](Eigen::Index i) {
    const double time = times_s[static_cast<std::size_t>(i)];
    return CurvePoint{time, value_at(scene.protocol, time), answer.response[i], {}};
  };
  add_course(json, scene, point(largest_of(answer)), point(answer.response.size() - 1),
             stored_steps(scene, times_s, answer).size());
}

std::string trajectory_text(bool by_depth, const std::vector<double>& times_s,
                            const Trajectory& answer) {
  const auto point = [&](Eigen::Index i) {
    const double value = answer.response[i];
    return fmt::format("{} at {} s",
                       sized_text(by_depth ? Dimension::force : Dimension::length, value, 6),
                       significant(times_s[static_cast<std::size_t>(i)], 4));
  };
  return fmt::format("largest {}: {}; at the end: {}\n", by_depth ? "force" : "depth",
                     point(largest_of(answer)), point(answer.response.size() - 1));
}

void write_trajectory(const ExperimentScene& scene, const std::vector<double>& times_s,
                      const Trajectory& answer, Hdf5Writer& file) {
  const bool by_depth = scene.by_depth();
  const auto imposed =
      mapped<double>(times_s, [&](double time) { return value_at(scene.protocol, time); });
  const std::vector<double> response(answer.response.begin(), answer.response.end());
  file.numbers("/curve/time_s", times_s);
  file.numbers(by_depth ? "/curve/depth_m" : "/curve/load_N", imposed);
  file.numbers(by_depth ? "/curve/force_N" : "/curve/depth_m", response);
  const std::vector<std::size_t> steps = stored_steps(scene, times_s, answer);
  if (steps.empty()) return;
  file.numbers("/steps/time_s",
               mapped<double>(steps, [&](std::size_t step) { return times_s[step]; }));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Eigen::Matrix3Xd& u = answer.displacement[steps[i]];
    file.table(fmt::format("/steps/{:05}/displacement_m", i), {u.data(), u.data() + u.size()}, 3);
  }
}

Json scene_run_json(const ExperimentScene& scene, const std::vector<double>& times_s,
                    const Trajectory& answer) {
  Json json = scene_run_members(scene);
  json["steps"] = answer.steps;
  add_trajectory(json, scene, times_s, answer);
  return json;
}

std::string scene_run_text(const ExperimentScene& scene, const std::vector<double>& times_s,
                           const Trajectory& answer) {
  const Formulation& entry = scene.formulation.entry();
  return fmt::format(
      "{}: {}\n{}: {}\n{}limits of validity are not watched: this formulation does not show whole "
      "states\n",
      scene.tissue.title, scene.formulation.mass_spring ? "mass-spring model" : "tissue",
      entry.name(), entry.meaning(), trajectory_text(scene.by_depth(), times_s, answer));
}

void write_scene_run(const ExperimentScene& scene, const std::vector<double>& times_s,
                     const Trajectory& answer, const std::filesystem::path& path) {
  Hdf5Writer file(path);
  write_members(file, "/", scene_run_members(scene));
  write_members(file, "/", {{"scene", scene.text}, {"provenance", "model"}});
  write_trajectory(scene, times_s, answer, file);
  file.commit();
}

}  // namespace tpm::plan
