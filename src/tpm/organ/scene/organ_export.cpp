#include "tpm/organ/scene/organ_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr auto kOrganTargets =
    std::to_array<Word<OrganTarget>>({{OrganTarget::sofa, "sofa"}, {OrganTarget::mjcf, "mjcf"}});

void require_lines_alone(const Tissue& tissue) {
  for (std::size_t i = 1; i < tissue.sliders.size(); ++i) {
    if (tissue.sliders[i].sphere != tissue.sliders[i - 1].sphere) continue;
    throw bad_input("anchors", "a half-space that slides, which the export to SOFA does not write",
                    "anchors that hold everything, or the export to MuJoCo");
  }
}

std::string coordinates(const Eigen::Vector3d& v) {
  return fmt::format("{} {} {}", shortest(v.x()), shortest(v.y()), shortest(v.z()));
}

/// A comment of XML, in which two hyphens must not stand.
std::string xml_comment(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) {
    text.replace(at, 2, "- -");
  }
  return fmt::format("<!-- {} -->\n", text);
}

std::string xml_attribute(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string opening_comments(const Tissue& tissue, const OrganExportOptions& options) {
  const Network& network = tissue.network;
  std::string text = xml_comment(fmt::format(
      "organ of {} spheres and {} bonds written by tpm export{}; m, kg, s, N", network.organ.size(),
      network.bonds.size(), options.source.empty() ? "" : " from " + options.source));
  text += xml_comment(fmt::format(
      "bonds: {}", options.instantaneous
                       ? "springs of the instantaneous stiffness, without dampers"
                       : "springs of the equilibrium stiffness, dampers of the sum of g_j tau_j"));
  text += xml_comment(fmt::format("masses: spheres of {} kg/m3; no gravity, probe or protocol",
                                  shortest(options.density_kg_m3)));
  for (const Remark& remark : organ_export_remarks(tissue, options)) {
    text += xml_comment("not expressed: " + remark.text);
  }
  if (const auto contact = network.organ.contact) {
    text += xml_comment(
        fmt::format("the probe meets sphere {} (from 0); inward: {}", *contact,
                    coordinates(-network.organ.normal.col(static_cast<Eigen::Index>(*contact)))));
  }
  return text;
}

std::string sofa_document(const Tissue& tissue, const OrganExportOptions& options, double mass_kg) {
  const Organ& organ = tissue.network.organ;
  std::string positions, springs, anchors;
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    positions += coordinates(organ.position.col(i)) + "\n";
  }
  for (const ExportedBond& bond : exported_bonds(tissue, options.instantaneous)) {
    springs += fmt::format("{} {} {} {} {}\n", bond.a, bond.b, shortest(bond.stiffness_N_per_m),
                           shortest(bond.damping_N_s_per_m), shortest(bond.rest_length_m));
  }
  std::string text = "<?xml version=\"1.0\"?>\n" + opening_comments(tissue, options);
  text += "<Node name=\"root\" dt=\"0.001\" gravity=\"0 0 0\">\n";
  for (const char* plugin :
       {"AnimationLoop", "Constraint.Projective", "LinearSolver.Iterative", "Mass",
        "ODESolver.Backward", "SolidMechanics.Spring", "StateContainer"}) {
    text += fmt::format("  <RequiredPlugin name=\"Sofa.Component.{}\"/>\n", plugin);
  }
  text += fmt::format(
      "  <DefaultAnimationLoop/>\n"
      "  <Node name=\"organ\">\n"
      "    <EulerImplicitSolver rayleighMass=\"0\" rayleighStiffness=\"0\"/>\n"
      "    <CGLinearSolver iterations=\"500\" tolerance=\"1e-12\" threshold=\"1e-12\"/>\n"
      "    <MechanicalObject template=\"Vec3d\" name=\"spheres\" position=\"\n{}\"/>\n"
      "    <UniformMass vertexMass=\"{}\"/>\n",
      positions, shortest(mass_kg));
  if (!tissue.anchors.empty()) {
    text += fmt::format("    <FixedProjectiveConstraint indices=\"{}\"/>\n",
                        fmt::join(tissue.anchors, " "));
  }
  require_lines_alone(tissue);
  for (const Slider& slider : tissue.sliders) {
    text += fmt::format("    <DirectionProjectiveConstraint indices=\"{}\" direction=\"{}\"/>\n",
                        slider.sphere, coordinates(slider.direction));
  }
  text += fmt::format(
      "    <StiffSpringForceField template=\"Vec3d\" name=\"bonds\" spring=\"\n{}\"/>\n"
      "  </Node>\n"
      "</Node>\n",
      springs);
  return text;
}

std::string mjcf_bodies(const Tissue& tissue, double mass_kg) {
  const Organ& organ = tissue.network.organ;
  const double inertia = 0.4 * mass_kg * organ.radius * organ.radius;
  std::string text;
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    const auto sphere = static_cast<std::size_t>(i);
    const std::string place = coordinates(organ.position.col(i));
    if (std::binary_search(tissue.anchors.begin(), tissue.anchors.end(), sphere)) {
      text += fmt::format("    <site name=\"s{}\" pos=\"{}\"/>\n", i, place);
      continue;
    }
    text += fmt::format(
        "    <body name=\"b{}\" pos=\"{}\"><inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"{} "
        "{} {}\"/>",
        i, place, shortest(mass_kg), shortest(inertia), shortest(inertia), shortest(inertia));
    std::vector<Eigen::Vector3d> axes;
    for (const Slider& slider : tissue.sliders) {
      if (slider.sphere == sphere) axes.push_back(slider.direction);
    }
    if (axes.empty()) {
      axes = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
    }
    for (const Eigen::Vector3d& axis : axes) {
      text += fmt::format("<joint type=\"slide\" axis=\"{}\"/>", coordinates(axis));
    }
    text += fmt::format(
        "<geom type=\"sphere\" size=\"{}\" contype=\"0\" conaffinity=\"0\"/><site "
        "name=\"s{}\"/></body>\n",
        shortest(organ.radius), i);
  }
  return text;
}

/// Numbers on MuJoCo's stack. A network of tendons needs many times what it would guess: a dense
/// row of the Jacobian for each, more than four times (measured with 2.2.2).
double mjcf_stack_numbers(const Tissue& tissue, std::size_t bonds) {
  constexpr double kRows = 5.0, kLeastNumbers = 8.0 * 1024.0 * 1024.0;
  return kLeastNumbers + kRows * static_cast<double>(bonds) * 3.0 *
                             static_cast<double>(tissue.network.organ.size());
}

std::string mjcf_document(const Tissue& tissue, const OrganExportOptions& options, double mass_kg) {
  const std::vector<ExportedBond> bonds = exported_bonds(tissue, options.instantaneous);
  // `nstack` counts numbers and is read by every MuJoCo that there has been; `memory` is unknown
  // before 2.3.
  std::string text = "<?xml version=\"1.0\"?>\n" + opening_comments(tissue, options);
  text += fmt::format(
      "<mujoco model=\"{}\">\n"
      "  <size nstack=\"{}\"/>\n"
      "  <option timestep=\"0.001\" gravity=\"0 0 0\" integrator=\"implicit\"/>\n"
      "  <worldbody>\n{}  </worldbody>\n  <tendon>\n",
      xml_attribute(tissue.title.empty() ? tissue.network.organ.name : tissue.title),
      static_cast<long>(mjcf_stack_numbers(tissue, bonds.size())), mjcf_bodies(tissue, mass_kg));
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const ExportedBond& bond = bonds[i];
    // Between the two lengths of a spring nothing pulls: that is a rope.
    const std::string length = (bond.rope ? "0 " : "") + shortest(bond.rest_length_m);
    text += fmt::format(
        "    <spatial name=\"t{}\" stiffness=\"{}\" damping=\"{}\" springlength=\"{}\"><site "
        "site=\"s{}\"/><site site=\"s{}\"/></spatial>\n",
        i, shortest(bond.stiffness_N_per_m), shortest(bond.damping_N_s_per_m), length, bond.a,
        bond.b);
  }
  return text + "  </tendon>\n</mujoco>\n";
}

}  // namespace

std::vector<std::string> organ_targets() {
  return mapped<std::string>(kOrganTargets, [](const auto& word) { return word.text; });
}

std::optional<OrganTarget> organ_target(std::string_view text) {
  if (const auto* word = find_entry(kOrganTargets, text)) return word->meaning;
  return std::nullopt;
}

std::vector<ExportedBond> exported_bonds(const Tissue& tissue, bool instantaneous) {
  const BondSystem system = tissue.bonds();
  std::vector<ExportedBond> bonds(system.size());
  for (std::size_t i = 0; i < bonds.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double whole = system.stiffness()[k], relaxing = system.relaxing()[k];
    double mean_time_s = 0.0;
    for (const ViscousLaw::Branch& branch : system.laws()[system.law_of(i)].branches) {
      mean_time_s += branch.share * branch.relaxation_time_s;
    }
    bonds[i] = {system.end_a()[i],
                system.end_b()[i],
                instantaneous ? whole : whole - relaxing,
                instantaneous || !(relaxing > 0.0) ? 0.0 : relaxing * mean_time_s,
                system.rest_length_m()[k],
                system.is_rope(i)};
  }
  return bonds;
}

std::vector<Remark> organ_export_remarks(const Tissue& tissue, const OrganExportOptions& options) {
  std::vector<Remark> remarks;
  const auto add = [&remarks](const char* code, std::string text) {
    remarks.push_back({code, std::move(text)});
  };
  const BondSystem system = tissue.bonds();
  const double whole = system.stiffness().sum(), relaxing = system.relaxing().sum();
  if (relaxing > 0.0 && options.instantaneous) {
    add("relaxation_left_out",
        fmt::format(
            "relaxation: {} % of the bonds' stiffness relaxes within {} s, and here nothing does",
            significant(100.0 * relaxing / whole, 3),
            significant(system.longest_relaxation_time_s(), 3)));
  } else if (relaxing > 0.0) {
    add("relaxation_branches_as_damper",
        fmt::format("relaxation branches: bonds are a spring with a damper beside it, right for "
                    "motions slow "
                    "against {} s; in faster ones its force grows without limit, but the tissue's "
                    "stiffness to "
                    "{} times this one only",
                    significant(system.shortest_relaxation_time_s(), 3),
                    significant(whole / (whole - relaxing), 3)));
  }
  if (!system.is_linear()) {
    add("stiffening_left_out", "stiffening with elongation: bonds keep their stiffness at rest");
  }
  const std::vector<std::string>& unused = tissue.unused_blocks;
  if (std::find(unused.begin(), unused.end(), "loads") != unused.end()) {
    add("loads_left_out", "loads: gravity and pressures of the scene are left out");
  }
  const auto bonds = exported_bonds(tissue, options.instantaneous);
  constexpr double kMuch_GB = 2.0;
  const double stack_GB = 1e-9 * sizeof(double) * mjcf_stack_numbers(tissue, bonds.size());
  if (options.target == OrganTarget::mjcf && stack_GB > kMuch_GB) {
    add("memory_of_tendons",
        fmt::format("tendons that know their two ends alone: MuJoCo takes about {} GB for the {} "
                    "dense rows of this organ, and time with them",
                    significant(stack_GB, 2), bonds.size()));
  }
  const auto ropes =
      std::count_if(bonds.begin(), bonds.end(), [](const ExportedBond& bond) { return bond.rope; });
  if (ropes > 0 && options.target == OrganTarget::sofa) {
    add("ropes_push", fmt::format("{} bonds that only pull push here, too", ropes));
  }
  if (ropes > 0 && options.target == OrganTarget::mjcf && !options.instantaneous) {
    const bool damped = std::any_of(bonds.begin(), bonds.end(), [](const ExportedBond& bond) {
      return bond.rope && bond.damping_N_s_per_m > 0.0;
    });
    if (damped) add("slack_ropes_damped", "dampers of slack ropes still act");
  }
  return remarks;
}

std::string export_organ(const Tissue& tissue, const OrganExportOptions& options) {
  if (!(options.density_kg_m3 > 0.0) || !std::isfinite(options.density_kg_m3)) {
    throw bad_input("export", fmt::format("density {} kg/m3", shortest(options.density_kg_m3)),
                    "a density above 0");
  }
  const double mass_kg = sphere_masses_kg(tissue.network.organ, options.density_kg_m3)[0];
  return options.target == OrganTarget::sofa ? sofa_document(tissue, options, mass_kg)
                                             : mjcf_document(tissue, options, mass_kg);
}

}  // namespace tpm::organ
