#include "tpm/plan/show/simulation_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/run/smoothness.hpp"
#include "tpm/plan/show/simulation_remarks.hpp"
#include "tpm/plan/show/trajectory_report.hpp"

namespace tpm::plan {
namespace {

double nine_digits(double value) {
  return rounded(value, 9);
}

/// The impact that the tissue feels most; none if there is none.
const ProbeImpact* largest_impact(const std::vector<ProbeImpact>& impacts) {
  const auto most = std::ranges::max_element(
      impacts, {}, [](const ProbeImpact& a) { return std::abs(a.impulse_on_tissue_N_s); });
  return most == impacts.end() ? nullptr : &*most;
}

/// The point of the largest force on the tissue.
const CurvePoint& hardest(const SimulationRecord& record) {
  return *std::ranges::max_element(record.curve, {}, [](const CurvePoint& p) {
    return counts(p) ? p.force_on_tissue_N : -std::numeric_limits<double>::infinity();
  });
}

Json validity_json(const Validity& validity, bool depth_limits) {
  Json json{{"kept", validity.whole()},
            {"depth_limits_apply", depth_limits},
            {"deepest_m", nine_digits(validity.deepest_m)},
            {"most_turned_rad", nine_digits(validity.most_turned_rad)}};
  json["limits"] = Json::array();
  for (std::size_t k = 0; k < kValidityLimits; ++k) {
    const auto limit = static_cast<ValidityLimit>(k);
    const ValidityBreach& breach = validity.of(limit);
    Json entry{{"limit", key_of(limit)}, {"passed", breach.first_time_s.has_value()}};
    entry["first_time_s"] =
        breach.first_time_s ? Json(nine_digits(*breach.first_time_s)) : Json(nullptr);
    entry["spheres"] = array_json(breach.spheres, [](std::size_t sphere) { return sphere + 1; });
    json["limits"].push_back(entry);
  }
  return json;
}

Json energy_json(const SimulationRun& run) {
  if (run.record.inertial_energy) {
    const InertialEnergy& e = *run.record.inertial_energy;
    return {{"work_J", nine_digits(e.work)},
            {"stored_J", nine_digits(e.stored)},
            {"dissipated_J", nine_digits(e.bond_heat + e.damping_heat + e.contact_heat)},
            {"contact_heat_J", nine_digits(e.contact_heat)},
            {"kinetic_J", nine_digits(e.kinetic)}};
  }
  const QuasiStaticEnergy& e = run.record.curve.back().energy;
  return {{"work_J", nine_digits(e.work_J)},
          {"stored_J", nine_digits(e.stored_J)},
          {"dissipated_J", nine_digits(e.dissipated_J)}};
}

/// Results of spheres with mass besides: impacts, forces that a load does not name, and the effect
/// of the stiffness of contacts.
Json motion_json(const ExperimentScene& scene, const SimulationRun& run) {
  const std::vector<ProbeImpact>& impacts = run.record.impacts;
  Json json{{"impacts", {{"count", impacts.size()}}}};
  if (const ProbeImpact* most = largest_impact(impacts)) {
    json["impacts"]["largest"] = {
        {"time_s", nine_digits(most->time_s)},
        {"impulse_on_tissue_N_s", nine_digits(most->impulse_on_tissue_N_s)},
        {"impulse_of_probe_N_s", nine_digits(most->impulse_N_s)}};
  }
  if (!scene.by_depth()) {
    const CurvePoint& most = hardest(run.record);
    json["largest_force_on_tissue"] = {{"time_s", nine_digits(most.time_s)},
                                       {"force_N", nine_digits(most.force_on_tissue_N)}};
  }
  json["contact_check"] = nullptr;
  if (run.contact_check) {
    const ContactCheck& check = *run.contact_check;
    json["contact_check"] = {{"times_softer", ContactCheck::kSofter},
                             {"largest_response", nine_digits(check.largest)},
                             {"largest_response_softer", nine_digits(check.largest_softer)},
                             {"response_at_end", nine_digits(check.end)},
                             {"response_at_end_softer", nine_digits(check.end_softer)},
                             {"difference", rounded(check.difference, 3)},
                             {"difference_at_one_time", rounded(check.at_one_time, 3)},
                             {"depends_on_stiffness", check.depends_on_stiffness()}};
  }
  return json;
}

/// Motion and force of a contact with a protocol of its own.
struct OwnCourse {
  bool depth = true;
  double largest = 0.0, last_imposed = 0.0, last = 0.0;
};

std::optional<OwnCourse> own_course(const ExperimentScene& scene, const SimulationRun& run,
                                    std::size_t contact) {
  const std::optional<Protocol>& protocol = scene.contacts[contact].protocol;
  if (contact == 0 || !protocol) return std::nullopt;
  const auto before = std::count_if(scene.contacts.begin() + 1,
                                    scene.contacts.begin() + static_cast<std::ptrdiff_t>(contact),
                                    [](const SceneContact& c) { return c.protocol.has_value(); });
  const auto index = static_cast<std::size_t>(before);
  OwnCourse course;
  course.depth = protocol->drive() == Drive::displacement;
  for (const CurvePoint& p : run.record.curve) {
    if (counts(p) && std::abs(p.beside[index]) > std::abs(course.largest)) {
      course.largest = p.beside[index];
    }
  }
  course.last_imposed = value_at(*protocol, run.record.curve.back().time_s);
  course.last = run.record.curve.back().beside[index];
  return course;
}

/// How deep a tool has come into a sphere, as contacts are stiff and not rigid; none without a
/// tool.
std::optional<double> largest_overlap_m(const RunNetwork& network, const SimulationRun& run) {
  if (network.driven.tools.empty()) return std::nullopt;
  double overlap_m = 0.0;
  for (const CurvePoint& p : run.record.curve) overlap_m = std::max(overlap_m, p.overlap_m);
  return overlap_m;
}

Json largest_overlap_json(const RunNetwork& network, const SimulationRun& run) {
  const auto overlap_m = largest_overlap_m(network, run);
  return overlap_m ? Json(rounded(*overlap_m, 3)) : Json(nullptr);
}

/// The contacts, and the state of the tools among them at the last output.
Json contacts_json(const ExperimentScene& scene, const RunNetwork& network,
                   const SimulationRun& run) {
  const QuasiStaticState& last = run.record.outputs.back();
  const auto states =
      tool_states(network.driven, last.position, run.record.contact_pushes_N.back());
  std::size_t tool = 0;
  Json list = Json::array();
  for (const SceneContact& contact : scene.contacts) {
    const Eigen::Vector3d& d = contact.probe.direction;
    Json json{{"kind", to_string(contact.kind)},
              {"sphere", contact.probe.sphere + 1},
              {"direction", {rounded(d.x(), 9), rounded(d.y(), 9), rounded(d.z(), 9)}},
              {"share", contact.probe.share}};
    if (contact.kind != ContactKind::sphere) json["radius_m"] = contact.radius_m;
    if (const auto own = own_course(scene, run, static_cast<std::size_t>(list.size()))) {
      json["imposed"] = own->depth ? "depth_m" : "load_N";
      json["response"] = own->depth ? "force_N" : "depth_m";
      json["largest_response"] = nine_digits(own->largest);
      json["last_imposed"] = nine_digits(own->last_imposed);
      json["last_response"] = nine_digits(own->last);
    }
    if (contact.kind == ContactKind::patch) {
      json["spheres"] = spheres_of(contact, scene.tissue.network.organ).size();
    }
    if (contact.is_tool()) {
      const ToolState& state = states[tool];
      json["contact_stiffness_N_per_m"] = nine_digits(network.driven.tools[tool].stiffness_N_per_m);
      json["last"] = {{"position_m", array_json(state.position, nine_digits)},
                      {"force_on_tissue_N", array_json(state.force, nine_digits)},
                      {"touching", state.touching},
                      {"overlap_m", rounded(state.overlap_m, 3)}};
      ++tool;
    }
    list.push_back(json);
  }
  return list;
}

/// A driven sphere is no tool: nothing holds it across the push unless the scene does.
std::string sideways_words(const ExperimentScene& scene, const Probe& probe) {
  const std::vector<Slider>& sliders = scene.tissue.sliders;
  const bool guided = std::ranges::find(sliders, probe.sphere, &Slider::sphere) != sliders.end();
  return fmt::format("sphere {} is driven along its push and {} across it\n", probe.sphere + 1,
                     guided ? "guided" : "free");
}

std::string contacts_text(const ExperimentScene& scene, const RunNetwork& network,
                          const SimulationRun& run) {
  const QuasiStaticState& last = run.record.outputs.back();
  const auto states =
      tool_states(network.driven, last.position, run.record.contact_pushes_N.back());
  std::size_t tool = 0, number = 0;
  std::string text;
  for (const SceneContact& contact : scene.contacts) {
    const auto own = own_course(scene, run, number++);
    if (contact.kind == ContactKind::sphere && scene.contacts.size() == 1) {
      text += sideways_words(scene, contact.probe);
      continue;
    }
    text += fmt::format("{}", to_string(contact.kind));
    if (contact.kind != ContactKind::sphere) {
      text += fmt::format(" of {} radius", sized_text(Dimension::length, contact.radius_m, 4));
    }
    text += fmt::format(" at sphere {}", contact.probe.sphere + 1);
    if (contact.probe.share != 1.0) {
      text += contact.probe.share == 0.0 ? std::string(", standing still")
                                         : fmt::format(", share {}", shortest(contact.probe.share));
    }
    if (contact.kind == ContactKind::patch) {
      text += fmt::format(": {} spheres", spheres_of(contact, scene.tissue.network.organ).size());
    }
    if (contact.is_tool()) {
      const ToolState& state = states[tool++];
      text += fmt::format(": at the end it touches {} sphere{} with {}", state.touching,
                          state.touching == 1 ? "" : "s",
                          sized_text(Dimension::force, state.force.norm(), 6));
    }
    if (own) {
      const Dimension of = own->depth ? Dimension::force : Dimension::length;
      const Dimension by = own->depth ? Dimension::length : Dimension::force;
      text += fmt::format("; by its own protocol: largest {} {}, at the end {} {} {}",
                          own->depth ? "force" : "depth", sized_text(of, own->largest, 6),
                          sized_text(of, own->last, 6),
                          own->depth ? "at a depth of" : "under a load of",
                          sized_text(by, own->last_imposed, 4));
    }
    text += "\n";
  }
  if (const auto overlap_m = largest_overlap_m(network, run)) {
    text += fmt::format("tools come into spheres by at most {}: contacts are stiff, not rigid\n",
                        sized_text(Dimension::length, *overlap_m, 3));
  }
  return text;
}

Json smoothness_json(const std::optional<Smoothness>& smoothness) {
  if (!smoothness) return nullptr;
  Json json{{"near_contact", nine_digits(smoothness->near_contact)},
            {"near_spheres", smoothness->near_spheres},
            {"rim_spheres", smoothness->rim_spheres}};
  json["at_rim"] = smoothness->at_rim ? Json(nine_digits(*smoothness->at_rim)) : Json(nullptr);
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

std::string warning_lines(std::span<const Remark> remarks) {
  std::string text;
  for (const Remark& remark : remarks) text += fmt::format("WARNING: {}\n", remark.text);
  return text;
}

/// @param warnings to be written after the first line
std::string validity_text(const Validity& validity, bool depth_limits,
                          const std::string& warnings = {}) {
  std::string text =
      fmt::format("deepest indentation of a sphere {}, most turned lateral bond {} degrees\n",
                  sized_text(Dimension::length, validity.deepest_m, 4),
                  significant(validity.most_turned_rad * 180.0 / std::numbers::pi, 4)) +
      warnings;
  if (validity.whole()) text += "no limit of validity is passed\n";
  if (!depth_limits) {
    text +=
        "the limits of 10 and 12 mm are those of the paper's liver: not applied to this organ\n";
  }
  return text;
}

std::string motion_text(const ExperimentScene& scene, const SimulationRun& run) {
  std::string text;
  if (!scene.by_depth()) {
    const CurvePoint& most = hardest(run.record);
    text += fmt::format("largest force on the tissue: {}, at {} s\n",
                        sized_text(Dimension::force, most.force_on_tissue_N, 6),
                        significant(most.time_s, 4));
  }
  const std::vector<ProbeImpact>& impacts = run.record.impacts;
  if (const ProbeImpact* most = largest_impact(impacts)) {
    text += fmt::format(
        "{} impact{} (a speed that changes in an instant; not in the forces), the largest {} N s "
        "on "
        "the tissue, at {} s\n",
        impacts.size(), impacts.size() == 1 ? "" : "s", significant(most->impulse_on_tissue_N_s, 3),
        significant(most->time_s, 4));
  }
  if (!run.contact_check) return text;
  const ContactCheck& check = *run.contact_check;
  const Dimension of = scene.by_depth() ? Dimension::force : Dimension::length;
  const auto pair = [&](double here, double softer) {
    return fmt::format("{} instead of {}", sized_text(of, softer, 6), sized_text(of, here, 6));
  };
  text += fmt::format("with contacts {} times softer the largest {} is {}, that at the end {}",
                      shortest(ContactCheck::kSofter), scene.by_depth() ? "force" : "depth",
                      pair(check.largest, check.largest_softer), pair(check.end, check.end_softer));
  text += fmt::format("; the curves differ by {} % of the largest at one time\n",
                      significant(100.0 * check.at_one_time, 3));
  return text;
}

std::string equations_text(const ExperimentScene& scene, const SimulationRun& run) {
  const FormulationChoice& f = scene.formulation;
  const char* network = f.mass_spring ? "mass-spring model" : "tissue";
  if (!f.masses) {
    return fmt::format(
        "{}, {}, tolerance {}\n", network,
        !f.entry().can().course ? "static: equilibrium at each time" : "quasi-static",
        shortest(f.tolerance));
  }
  return fmt::format(
      "{} with mass, damping ratio {} of the tissue's lowest mode ({} Hz), tolerance {}\n", network,
      shortest(f.damping_ratio), significant(run.lowest_frequency_Hz, 4), shortest(f.tolerance));
}

/// Solver of the linear systems.
Json solver_json(const SolverChoice& solver) {
  Json json{{"kind", solver.direct ? "direct" : "iterative"}};
  if (solver.operations > 0.0) {
    json["factor_operations"] = nine_digits(solver.operations);
    json["factor_bytes"] = solver.bytes;
  }
  return json;
}

/// Of a run that iterates.
std::string solver_text(const SolverChoice& solver) {
  std::string text = "linear systems are solved by conjugate gradients with multigrid";
  if (solver.operations > 0.0) {
    text +=
        fmt::format(": a factorisation would take {} operations and {} GiB",
                    significant(solver.operations, 3), significant(solver.bytes / 1073741824.0, 3));
  }
  return text + "\n";
}

/// The driven spheres and their protocols, and the loads of the scene.
std::string scene_text(const ExperimentScene& scene) {
  std::string text = fmt::format("{}: sphere {} of {} is {}\n", scene.tissue.title,
                                 scene.probe().sphere + 1, scene.tissue.network.organ.size(),
                                 scene.by_depth() ? "pushed to a depth" : "loaded");
  for (const std::string& load : scene.load_words) {
    text += fmt::format("before and all along: {}\n", load);
  }
  return text;
}

/// The largest response, and the last one.
std::string response_text(const ExperimentScene& scene, const SimulationRecord& record) {
  const bool depth = scene.by_depth();
  const auto response = [&](const CurvePoint& p) {
    return fmt::format("{} {} {}",
                       sized_text(depth ? Dimension::force : Dimension::length, p.response, 6),
                       depth ? "at a depth of" : "under a load of",
                       sized_text(depth ? Dimension::length : Dimension::force, p.imposed, 4));
  };
  const CurvePoint& most = largest_point(record.curve, scene.formulation.tolerance);
  return fmt::format("largest {}: {}, at {} s\nat the end, {} s: {}\n", depth ? "force" : "depth",
                     response(most), significant(most.time_s, 4),
                     significant(record.curve.back().time_s, 4), response(record.curve.back()));
}

std::string resumed_text(const SimulationRun& run) {
  if (!run.resumed_at_s) return "";
  return fmt::format("resumed at {} s from a checkpoint\n", significant(*run.resumed_at_s, 4));
}

}  // namespace

Json simulation_json(const ExperimentScene& scene, const RunNetwork& network,
                     const SimulationRun& run) {
  const FormulationChoice& f = scene.formulation;
  const SimulationRecord& record = run.record;
  Json json = scene_run_members(scene);
  json["spheres"] = scene.tissue.network.organ.size();
  json["bonds"] = scene.tissue.network.bonds.size();
  json["loads"] = scene.load_words;
  json["contacts"] = contacts_json(scene, network, run);
  json["largest_overlap_m"] = largest_overlap_json(network, run);
  add_course(json, scene, largest_point(record.curve, f.tolerance), record.curve.back(),
             record.outputs.size());
  json["energy"] = energy_json(run);
  if (f.masses) json["motion"] = motion_json(scene, run);
  if (run.solver) json["solver"] = solver_json(*run.solver);
  json["roughness"] = smoothness_json(smoothness_of(scene, record.outputs.back().position));
  json["error_estimate"] =
      f.kind == "quasi_static" ? Json(rounded(record.error_estimate, 3)) : Json(nullptr);
  json["resumed_at_s"] = run.resumed_at_s ? Json(*run.resumed_at_s) : Json(nullptr);
  json["validity"] = validity_json(record.validity, depth_limits_apply(scene.tissue));
  json["remarks"] = remarks_json(simulation_remarks(run));
  return json;
}

std::string simulation_text(const ExperimentScene& scene, const RunNetwork& network,
                            const SimulationRun& run) {
  const SimulationRecord& record = run.record;
  std::string text = scene_text(scene);
  text += contacts_text(scene, network, run);
  text += equations_text(scene, run);
  if (scene.formulation.masses) {
    text += motion_text(scene, run) + warning_lines(contact_remarks(run));
  }
  if (run.solver && !run.solver->direct) text += solver_text(*run.solver);
  text += resumed_text(run) + response_text(scene, record);
  text += smoothness_text(smoothness_of(scene, record.outputs.back().position));
  return text + validity_text(record.validity, depth_limits_apply(scene.tissue),
                              warning_lines(breach_remarks(record.validity)));
}

ShortAnswer short_answer(const ExperimentScene& scene, const RunNetwork& network,
                         const SimulationRun& run) {
  const SimulationRecord& record = run.record;
  ShortAnswer answer;
  answer.conclusion = separate_lines(scene_text(scene) + response_text(scene, record));
  answer.rows = separate_lines(contacts_text(scene, network, run));
  answer.rest = [count = answer.rows.size()](std::size_t from) {
    return fmt::format("... and {} more lines on contacts", count - from);
  };
  std::string limits = equations_text(scene, run);
  if (scene.formulation.masses) limits += motion_text(scene, run);
  if (run.solver && !run.solver->direct) limits += solver_text(*run.solver);
  limits +=
      resumed_text(run) + smoothness_text(smoothness_of(scene, record.outputs.back().position));
  limits += validity_text(record.validity, depth_limits_apply(scene.tissue));
  answer.limits = separate_lines(limits);
  answer.warnings = remark_texts(simulation_remarks(run));
  return answer;
}

}  // namespace tpm::plan
