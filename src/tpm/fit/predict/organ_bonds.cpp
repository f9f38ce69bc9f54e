#include "tpm/fit/predict/organ_bonds.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/organ/scene/protocol_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kLateralRatio = 1.0;  // E' over instantaneous radial modulus: the paper's

}  // namespace

SceneOrgan organ_of_scene(const Json& scene, std::string_view where,
                          const std::filesystem::path& folder) {
  const DocumentPlace place{std::string(where)};
  require_one_protocol(scene, place);
  if (scene.contains("loads")) {
    throw bad_input(place.key("loads").where, "act on the tissue before it is pushed",
                    "a scene without them: the law knows no loads");
  }
  Json bare = scene;
  std::optional<Probe> probe;
  if (scene.contains("contacts")) {
    if (!has_protocol(scene)) {
      bare["protocol"] = {
          {"kind", "ramp_hold"}, {"depth", "1 mm"}, {"rate", "1 mm/s"}, {"hold", "1 s"}};
    }
    const ExperimentScene experiment = parse_experiment(bare, where, folder);
    if (experiment.contacts.size() != 1 ||
        experiment.contacts.front().kind != ContactKind::sphere) {
      throw bad_input(place.key("contacts").where, "is not one sphere that is driven",
                      "one contact of the kind sphere, or none for the organ's contact sphere");
    }
    probe = experiment.probe();
  }
  for (const char* key : {"contacts", "protocol", "formulation", "outputs"}) bare.erase(key);
  auto tissue = std::make_shared<Tissue>(parse_tissue(bare, where, folder));
  require_standing(*tissue, where);
  if (!probe) require_free_contact(*tissue, where);
  Organ& organ = tissue->network.organ;
  if (probe) {
    organ.contact = probe->sphere;
    organ.normal.col(static_cast<Eigen::Index>(probe->sphere)) = -probe->direction;
  }
  SceneOrgan result;
  result.model = std::make_shared<OrganModel>(tissue);
  result.tissue = std::move(tissue);
  return result;
}

std::vector<std::string> FittedBonds::names() const {
  std::vector<std::string> all{"Einf"};
  const auto add_each = [&](const char* name) {
    for (std::size_t j = 1; j <= form_.branches.size(); ++j) {
      all.push_back(fmt::format("{}{}", name, j));
    }
  };
  add_each("g");
  if (times_) add_each("tau");
  for (const MaterialParameter& p : form_.potential.parameters()) all.push_back(p.name);
  return all;
}

BondMaterial FittedBonds::material(std::span<const double> natural) const {
  BondMaterial m = form_;
  std::size_t next = 0;
  m.equilibrium_Pa = natural[next++];
  for (auto& branch : m.branches) branch.modulus_Pa = natural[next++];
  if (times_) {
    for (auto& branch : m.branches) branch.relaxation_time_s = natural[next++];
  }
  for (std::size_t k = 0; k < m.potential.parameters().size(); ++k) {
    m.potential.set_value(k, natural[next++]);
  }
  if (!m.kernel.is_linear()) m.kernel = m.potential;
  m.lateral_Pa = kLateralRatio * m.instantaneous_Pa();
  return m;
}

std::vector<double> FittedBonds::values(const OrganModel& model, const BondMaterial& material) {
  return mapped<double>(model.parameters(),
                        [&](const ParameterDescription& p) { return *value_of(material, p.name); });
}

Eigen::MatrixXd FittedBonds::along(const OrganModel& model) const {
  const auto table = model.parameters();
  const std::vector<std::string> all = names();
  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(std::ssize(table), std::ssize(all));
  const auto row = [&](std::string_view name) {
    const auto found = std::ranges::find_if(table, [&](const auto& p) { return p.name == name; });
    return static_cast<Eigen::Index>(found - table.begin());
  };
  // Einf and every g_j, then the times, then the parameters of the potential.
  const auto moduli = static_cast<Eigen::Index>(1 + form_.branches.size());
  const Eigen::Index of_potential = changes.cols() - std::ssize(form_.potential.parameters());
  for (Eigen::Index k = 0; k < changes.cols(); ++k) {
    const std::string& name = all[static_cast<std::size_t>(k)];
    changes(row(name), k) = 1.0;
    if (k < moduli) changes(row("Eprime"), k) = kLateralRatio;
    if (k >= of_potential && !form_.kernel.is_linear())
      changes(row(kernel_parameter(name)), k) = 1.0;
  }
  return changes;
}

}  // namespace tpm::fit
