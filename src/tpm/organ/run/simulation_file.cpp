#include "tpm/organ/run/simulation_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5_members.hpp"
#include "tpm/organ/run/smoothness.hpp"
#include "tpm/organ/run/step_fields.hpp"
#include "tpm/organ/scene/network_file.hpp"
#include "tpm/organ/scene/xdmf.hpp"
#include "tpmkit/version.hpp"

namespace tpm::organ {
namespace fs = std::filesystem;
namespace {

std::size_t tool_count(const ExperimentScene& scene) {
  return static_cast<std::size_t>(
      std::count_if(scene.contacts.begin(), scene.contacts.end(),
                    [](const SceneContact& contact) { return contact.is_tool(); }));
}

std::string step_group(std::size_t step) {
  return fmt::format("/steps/{:05}", step);
}

void write_provenance(const ExperimentScene& scene, const SimulationRun& run, Hdf5Writer& file) {
  const FormulationChoice& f = scene.formulation;
  write_members(file, "/",
                {{"scene", scene.text},
                 {"scene_sha256", sha256_hex(scene.text)},
                 {"formulation", f.kind},
                 {"network", f.mass_spring ? "mass_spring" : "tissue"},
                 {"provenance", "model"},
                 {"tolerance", f.tolerance}});
  if (f.masses) {
    file.numbers("/settings/damping_ratio", {f.damping_ratio});
    if (tool_count(scene) > 0) {
      file.numbers("/settings/contact_damping_ratio", {InertialOptions{}.contact_damping_ratio});
    }
    file.numbers("/settings/lowest_frequency_Hz", {run.lowest_frequency_Hz});
  }
  file.numbers("/probe/sphere", {static_cast<double>(scene.probe().sphere + 1)});
  file.numbers("/probe/direction", list_of(scene.probe().direction));
}

/// Constant data of the tools, one row each.
void write_tools(const DrivenNetwork& network, Hdf5Writer& file) {
  if (network.tools.empty()) return;
  std::vector<std::int32_t> kind;
  std::vector<double> radius, share, stiffness, direction;
  for (const PressedTool& pressed : network.tools) {
    kind.push_back(pressed.tool.shape.kind == ToolKind::sphere ? 0 : 1);
    radius.push_back(pressed.tool.shape.radius_m);
    share.push_back(pressed.share);
    stiffness.push_back(pressed.stiffness_N_per_m);
    for (const double d : pressed.tool.direction) direction.push_back(d);
  }
  file.integers("/tools/kind", kind, 1);
  file.attribute("/tools/kind", "meaning", "0: ball, placed by its centre; 1: punch, by its face");
  file.numbers("/tools/radius_m", radius);
  file.numbers("/tools/share", share);
  file.numbers("/tools/contact_stiffness_N_per_m", stiffness);
  file.table("/tools/direction", direction, 3);
}

/// Where the tools are at an output and what they do, one row each.
void write_tool_states(const DrivenNetwork& network, const QuasiStaticState& state,
                       const Eigen::VectorXd& contact_push_N, const std::string& group,
                       Hdf5Writer& file) {
  if (network.tools.empty()) return;
  std::vector<double> position, force, overlap;
  std::vector<std::int32_t> touching;
  for (const ToolState& tool : tool_states(network, state.position, contact_push_N)) {
    position.insert(position.end(), tool.position.begin(), tool.position.end());
    force.insert(force.end(), tool.force.begin(), tool.force.end());
    overlap.push_back(tool.overlap_m);
    touching.push_back(tool.touching);
  }
  file.table(group + "/tools/position_m", position, 3);
  file.table(group + "/tools/force_on_tissue_N", force, 3);
  file.numbers(group + "/tools/overlap_m", overlap);
  file.integers(group + "/tools/touching", touching, 1);
}

/// Data of spheres with mass besides a curve: impacts, and the effect of contacts on the numbers.
void write_motion(const SimulationRun& run, Hdf5Writer& file) {
  std::vector<double> time, impulse, on_tissue;
  for (const ProbeImpact& impact : run.record.impacts) {
    time.push_back(impact.time_s);
    impulse.push_back(impact.impulse_N_s);
    on_tissue.push_back(impact.impulse_on_tissue_N_s);
  }
  file.numbers("/impacts/time_s", time);
  file.numbers("/impacts/impulse_of_probe_N_s", impulse);
  file.numbers("/impacts/impulse_on_tissue_N_s", on_tissue);
  file.attribute("/impacts", "meaning",
                 "speeds that change in an instant: where an imposed depth changes its rate, and "
                 "where a tool meets a sphere (inelastic); not in the forces of /curve");
  if (!run.contact_check) return;
  const ContactCheck& check = *run.contact_check;
  file.numbers("/contact_check/largest_response", {check.largest});
  file.numbers("/contact_check/largest_response_softer", {check.largest_softer});
  file.numbers("/contact_check/response_at_end", {check.end});
  file.numbers("/contact_check/response_at_end_softer", {check.end_softer});
  file.numbers("/contact_check/difference", {check.difference});
  file.numbers("/contact_check/difference_at_one_time", {check.at_one_time});
  file.attribute(
      "/contact_check", "meaning",
      fmt::format("against the same run with contacts {} times softer, in parts of the "
                  "largest response; difference: of the largest responses, of those at "
                  "the end, or of the curves in the mean over time, whichever is largest",
                  shortest(ContactCheck::kSofter)));
}

void write_curve(const ExperimentScene& scene, const SimulationRecord& record, Hdf5Writer& file) {
  std::vector<double> time, imposed, response, work, heat, stored, overlap, on_tissue;
  std::vector<std::int32_t> touching, settling;
  for (const CurvePoint& p : record.curve) {
    time.push_back(p.time_s);
    imposed.push_back(p.imposed);
    response.push_back(p.response);
    work.push_back(p.energy.work_J);
    heat.push_back(p.energy.dissipated_J);
    stored.push_back(p.energy.stored_J);
    touching.push_back(p.touching);
    overlap.push_back(p.overlap_m);
    settling.push_back(p.settling ? 1 : 0);
    on_tissue.push_back(p.force_on_tissue_N);
  }
  const bool depth = scene.by_depth();
  file.numbers("/curve/time_s", time);
  file.numbers(depth ? "/curve/depth_m" : "/curve/load_N", imposed);
  file.numbers(depth ? "/curve/force_N" : "/curve/depth_m", response);
  if (tool_count(scene) > 0) {
    file.integers("/curve/touching", touching, 1);
    file.numbers("/curve/overlap_m", overlap);
  }
  if (scene.formulation.masses) {
    if (!depth) file.numbers("/curve/force_on_tissue_N", on_tissue);
    if (tool_count(scene) > 0) {
      file.integers("/curve/settling", settling, 1);
      file.attribute("/curve/settling", "meaning",
                     "1: a tool has just struck a sphere, and forces are still those of the "
                     "contact's vibration; not counted for the largest response");
    }
    return;
  }
  file.numbers("/curve/work_J", work);
  file.numbers("/curve/dissipated_J", heat);
  file.numbers("/curve/stored_J", stored);
}

/// Contacts with protocols of their own, under their numbers in the scene.
void write_contacts_beside(const ExperimentScene& scene, const SimulationRecord& record,
                           Hdf5Writer& file) {
  std::size_t index = 0;
  for (std::size_t i = 1; i < scene.contacts.size(); ++i) {
    const std::optional<Protocol>& protocol = scene.contacts[i].protocol;
    if (!protocol) continue;
    const bool depth = protocol->drive() == Drive::displacement;
    std::vector<double> imposed, response;
    for (const CurvePoint& p : record.curve) {
      imposed.push_back(value_at(*protocol, p.time_s));
      response.push_back(p.beside[index]);
    }
    const std::string group = fmt::format("/contacts/{}", i + 1);
    file.numbers(group + (depth ? "/depth_m" : "/load_N"), imposed);
    file.numbers(group + (depth ? "/force_N" : "/depth_m"), response);
    file.attribute(group, "meaning", "of a contact with its own protocol, at the times of /curve");
    ++index;
  }
}

void write_validity(const Validity& validity, Hdf5Writer& file) {
  file.numbers("/validity/deepest_m", {validity.deepest_m});
  file.numbers("/validity/most_turned_rad", {validity.most_turned_rad});
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    const ValidityBreach& breach = validity.of(limit);
    const std::string group = fmt::format("/validity/{}", key_of(limit));
    file.group(group);
    write_members(file, group,
                  {{"meaning", words_of(limit)}, {"passed", breach.first_time_s.has_value()}});
    if (!breach.first_time_s) continue;
    std::vector<std::int32_t> numbers;
    for (const std::size_t sphere : breach.spheres) {
      numbers.push_back(static_cast<std::int32_t>(sphere + 1));
    }
    file.numbers(group + "/first_time_s", {*breach.first_time_s});
    file.integers(group + "/spheres", numbers, 1);
  }
}

/// Of the outputs at which something has moved.
void write_roughness(const ExperimentScene& scene, const SimulationRecord& record,
                     Hdf5Writer& file) {
  const SmoothnessProbe probe(scene);
  std::vector<double> time, near, rim;
  for (const QuasiStaticState& state : record.outputs) {
    const std::optional<Smoothness> found = probe.at(state.position);
    if (!found) continue;
    time.push_back(state.time_s);
    near.push_back(found->near_contact);
    if (found->at_rim) rim.push_back(*found->at_rim);
  }
  file.numbers("/roughness/time_s", time);
  file.numbers("/roughness/near_contact", near);
  if (!rim.empty()) file.numbers("/roughness/at_rim", rim);
}

void write_field(const StepField& field, const std::string& group, Hdf5Writer& file) {
  const std::string name = fmt::format("{}/{}", group, field.name);
  field.columns == 1 ? file.numbers(name, field.values)
                     : file.table(name, field.values, field.columns);
}

void write_step(const ExperimentScene& scene, const RunNetwork& network, const ValidityWatch& watch,
                const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N,
                const std::string& group, Hdf5Writer& file) {
  file.table(group + "/position_m", list_of(network.spheres(state.position)), 3);
  write_tool_states(network.driven, state, contact_push_N, group, file);
  const StepFields fields = fields_of(scene, network, watch, state);
  for (const StepField& field : fields.of_spheres) write_field(field, group, file);
  file.integers(group + "/validity", fields.validity, 1);
  for (const StepField& field : fields.of_bonds) write_field(field, group, file);
}

/// Spheres, bonds and tools at one time.
std::string step_xdmf(const ExperimentScene& scene, const XdmfSource& source,
                      const std::string& group, double time_s, std::size_t n, std::size_t m,
                      Eigen::Index branches) {
  using Number = XdmfSource::Number;
  using Centre = XdmfSource::Centre;
  const std::string position = group + "/position_m";
  std::string text = fmt::format(
      "   <Grid Name=\"network\" GridType=\"Collection\" CollectionType=\"Spatial\">\n"
      "    <Time Value=\"{}\"/>\n"
      "    <Grid Name=\"spheres\" GridType=\"Uniform\">\n",
      shortest(time_s));
  text += source.points(position, n);
  for (const std::string name : {"number", "layer", "constraint", "contact"}) {
    text += source.scalar(name, "/spheres/" + name, Centre::node, n, Number::whole);
  }
  text += source.vector("displacement_m", group + "/displacement_m", n);
  text += source.scalar("displacement_magnitude_m", group + "/displacement_magnitude_m",
                        Centre::node, n, Number::real);
  text += source.scalar("validity", group + "/validity", Centre::node, n, Number::whole);
  if (scene.outputs.force) {
    text += source.vector("force_N", group + "/force_N", n);
    text += source.scalar("largest_bond_force_N", group + "/largest_bond_force_N", Centre::node, n,
                          Number::real);
  }
  text += "    </Grid>\n    <Grid Name=\"bonds\" GridType=\"Uniform\">\n";
  text += source.lines(position, n, m);
  text += source.scalar("kind", "/bonds/kind", Centre::cell, m, Number::whole);
  if (scene.outputs.bond_force) {
    text += source.scalar("bond_force_N", group + "/bond_force_N", Centre::cell, m, Number::real);
  }
  if (scene.outputs.viscous) {
    for (Eigen::Index j = 0; j < branches; ++j) {
      const std::string name = viscous_name(j, branches);
      text += source.scalar(name, fmt::format("{}/{}", group, name), Centre::cell, m, Number::real);
    }
  }
  text += "    </Grid>\n";
  if (const std::size_t tools = tool_count(scene); tools > 0) {
    text += "    <Grid Name=\"tools\" GridType=\"Uniform\">\n";
    text += source.points(group + "/tools/position_m", tools);
    text += source.scalar("kind", "/tools/kind", Centre::node, tools, Number::whole);
    text += source.scalar("radius_m", "/tools/radius_m", Centre::node, tools, Number::real);
    text += source.vector("force_on_tissue_N", group + "/tools/force_on_tissue_N", tools);
    text += "    </Grid>\n";
  }
  return text + "   </Grid>\n";
}

std::string xdmf(const ExperimentScene& scene, const SimulationRecord& record,
                 const std::string& file) {
  const XdmfSource source(file);
  const Network& network = scene.tissue.network;
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
      "  <Grid Name=\"simulation\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";
  for (std::size_t k = 0; k < record.outputs.size(); ++k) {
    text += step_xdmf(scene, source, step_group(k), record.outputs[k].time_s, network.organ.size(),
                      network.bonds.size(), record.outputs[k].viscous.cols());
  }
  return text + "  </Grid>\n </Domain>\n</Xdmf>\n";
}

}  // namespace

fs::path write_simulation(const ExperimentScene& scene, const RunNetwork& network,
                          const SimulationRun& run, const fs::path& path) {
  Hdf5Writer file(path);
  write_network_datasets(scene.tissue, file);
  if (scene.dead_load_N.size() > 0) {
    file.table("/spheres/dead_load_N", list_of(scene.dead_load_N), 3);
    file.attribute(
        "/spheres/dead_load_N", "meaning",
        fmt::format("acts from before the start on: {}", fmt::join(scene.load_words, "; ")));
  }
  write_provenance(scene, run, file);
  write_tools(network.driven, file);
  write_curve(scene, run.record, file);
  write_contacts_beside(scene, run.record, file);
  if (scene.formulation.masses) write_motion(run, file);
  write_validity(run.record.validity, file);
  write_roughness(scene, run.record, file);
  const ValidityWatch watch(scene);
  std::vector<double> times;
  for (std::size_t k = 0; k < run.record.outputs.size(); ++k) {
    times.push_back(run.record.outputs[k].time_s);
    write_step(scene, network, watch, run.record.outputs[k], run.record.contact_pushes_N[k],
               step_group(k), file);
  }
  file.numbers("/steps/time_s", times);
  file.attribute("/steps", "meaning",
                 "validity: of each sphere the sum of 1: indented by more than 10 mm, 2: more than "
                 "12 mm, 4: at a lateral bond turned by more than 30 degrees");
  file.commit();
  fs::path description = path;
  description.replace_extension(".xdmf");
  write_file(description, xdmf(scene, run.record, path.filename().string()));
  return description;
}

}  // namespace tpm::organ
