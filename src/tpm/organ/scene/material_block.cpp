// Declared in tpm/organ/scene/blocks.hpp.
// The block `material` of a scene: the paper's element or a material with branches, and regions.
#include <fmt/format.h>

#include <array>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/fractional_branches.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpm/organ/scene/place_function.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::organ {
namespace {

constexpr std::array<Word<BlendRule>, 2> kBlendWords{
    {{BlendRule::mean, "mean"}, {BlendRule::series, "series"}}};
constexpr std::array<const char*, 3> kElementKeys{"E1", "E2", "eta1"};
constexpr std::array<const char*, 3> kBranchKeys{"Einf", "branches", "fractional"};

double quantity_or(const Json& block, const char* key, Dimension dimension, double otherwise,
                   const DocumentPlace& place) {
  return block.contains(key) ? quantity_at(block, key, dimension, place) : otherwise;
}

ElongationFunction parse_function(const Json& block, const char* key, const DocumentPlace& place) {
  if (!block.contains(key)) return {};
  const Json& entry = block.at(key);
  const DocumentPlace here = place.key(key);
  const ElongationShape& shape =
      elongation_shape(entry.at("shape").get<std::string>(), here.key("shape").where);
  const std::vector<MaterialParameter>& parameters = shape.parameters();
  for (const auto& item : entry.items()) {
    const std::string& name = item.key();
    const bool known =
        name == "shape" || std::any_of(parameters.begin(), parameters.end(),
                                       [&](const MaterialParameter& p) { return p.name == name; });
    if (known) continue;
    std::string names = "shape";
    for (const MaterialParameter& p : parameters) names += ", " + p.name;
    throw bad_input(here.key(name).where, fmt::format("is no key of the shape '{}'", shape.name()),
                    names);
  }
  ElongationFunction function(shape, {});
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const MaterialParameter& p = parameters[k];
    const std::string_view symbol = si_symbol(p.dimension);
    if (!entry.contains(p.name)) {
      throw bad_input(here.key(p.name).where, "is missing",
                      fmt::format("{} of the shape '{}'{}{}", p.meaning, shape.name(),
                                  symbol.empty() ? "" : ", in ", symbol));
    }
    const double value = quantity_at(entry, p.name, p.dimension, here);
    if (!std::isfinite(value) || !p.allows(value)) {
      throw bad_input(here.key(p.name).where, fmt::format("{} {}", shortest(value), symbol),
                      fmt::format("a value {}", range_of(p)));
    }
    function.set_value(k, value);
  }
  return function;
}

TpmParameters parse_element(const Json& block, double spacing_m, const DocumentPlace& place) {
  TpmVector values = to_vector({});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const ParameterDescription& parameter = kTpmParameterTable[i];
    if (!block.contains(parameter.name)) continue;
    values[i] = quantity_at(block, parameter.name, parameter.dimension, place);
  }
  values[kSpacing] = spacing_m;
  const TpmParameters element = from_vector(values);
  require_valid(element, place.where);
  return element;
}

void add_fractional(const Json& block, BondMaterial& material, const DocumentPlace& place) {
  if (!block.contains("fractional")) return;
  const Json& entry = block.at("fractional");
  const DocumentPlace here = place.key("fractional");
  const double modulus_Pa = positive_at(entry, "g", Dimension::stress, here);
  FractionalWindow window;
  window.shortest_s = positive_at(entry, "shortest", Dimension::time, here);
  window.longest_s = positive_at(entry, "longest", Dimension::time, here);
  window.error = entry.value("error", window.error);
  const std::size_t left = BondMaterial::kMostBranches - material.branches.size();
  const double tau_s = positive_at(entry, "tau", Dimension::time, here);
  try {
    const FractionalBranches sum =
        fractional_branches(entry.at("order").get<double>(), tau_s, window, left);
    material.equilibrium_Pa += modulus_Pa * sum.constant;
    for (const auto& [share, time_s] : sum.branches) {
      material.branches.push_back({modulus_Pa * share, time_s});
    }
  } catch (const Error& error) {
    throw error.within(here.where);
  }
}

/// A material without its regions.
/// @param usual where A0 and l0 come from if the block does not say
MaterialBlock parse_plain_material(const Json& block, LateralBond lateral, double spacing_m,
                                   const BondMaterial& usual, const DocumentPlace& place) {
  const auto first_of = [&](const auto& keys) -> const char* {
    for (const char* key : keys) {
      if (block.contains(key)) return key;
    }
    return nullptr;
  };
  const char* of_element = first_of(kElementKeys);
  const char* of_branches = first_of(kBranchKeys);
  if (of_element != nullptr && of_branches != nullptr) {
    throw bad_input(place.key(of_element).where,
                    fmt::format("stands beside {}, which is another way to say it", of_branches),
                    "E1, E2 and eta1, or Einf with branches");
  }
  MaterialBlock read;
  BondMaterial material;
  if (of_branches == nullptr) {
    TpmParameters element = parse_element(block, spacing_m, place);
    if (!block.contains("A0")) element.A0_m2 = usual.A0_m2;
    if (!block.contains("l0")) element.l0_m = usual.l0_m;
    material = element.bonds(lateral);
    read.by_constants = true;
  } else {
    material.lateral = lateral;
    material.equilibrium_Pa = quantity_or(block, "Einf", Dimension::stress, 0.0, place);
    material.lateral_Pa =
        quantity_or(block, "Eprime", Dimension::stress, paper_element().lateral_Pa, place);
    material.A0_m2 = quantity_or(block, "A0", Dimension::area, usual.A0_m2, place);
    material.l0_m = quantity_or(block, "l0", Dimension::length, usual.l0_m, place);
    std::size_t index = 0;
    for (const Json& branch : block.value("branches", Json::array())) {
      const DocumentPlace here = place.key("branches").key(std::to_string(index++));
      material.branches.push_back({quantity_at(branch, "g", Dimension::stress, here),
                                   positive_at(branch, "tau", Dimension::time, here)});
    }
    add_fractional(block, material, place);
  }
  material.potential = parse_function(block, "potential", place);
  material.kernel = parse_function(block, "kernel", place);
  if (!material.potential.is_linear() || !material.kernel.is_linear() ||
      lateral == LateralBond::relaxing) {
    read.by_constants = false;
  }
  require_valid(material, place.where);
  if (!(material.instantaneous_Pa() > 0.0) && !read.by_constants) {
    throw bad_input(place.where, "has no modulus above 0", "Einf or a branch above 0");
  }
  read.materials = MaterialField(material);
  return read;
}

/// The keys of each kind of region beside factor and material.
struct RegionKind {
  std::string_view text;
  std::array<std::string_view, 3> keys;
};
constexpr std::array<RegionKind, 5> kRegionKinds{{{"layer", {"layer"}},
                                                  {"ball", {"centre", "below_contact", "radius"}},
                                                  {"box", {"from", "to"}},
                                                  {"spheres", {"spheres"}},
                                                  {"function", {}}}};

void require_region_keys(const Json& entry, const DocumentPlace& place) {
  const auto kind = entry.at("kind").get<std::string>();  // one of the schema's five
  const auto found =
      std::find_if(kRegionKinds.begin(), kRegionKinds.end(),
                   [&](const RegionKind& candidate) { return candidate.text == kind; });
  for (const auto& [key, value] : entry.items()) {
    if (key == "kind" || key == "factor" || (key == "material" && kind != "function")) continue;
    if (std::find(found->keys.begin(), found->keys.end(), key) != found->keys.end()) continue;
    throw bad_input(place.key(key).where, fmt::format("is no key of a region of kind {}", kind),
                    "see docs/network.md");
  }
}

Eigen::Vector3d centre_of_ball(const Json& entry, const Organ& organ, const DocumentPlace& place) {
  if (entry.contains("centre") == entry.contains("below_contact")) {
    throw bad_input(place.where, "a ball needs one place", "centre or below_contact");
  }
  if (entry.contains("centre")) return parse_point(entry.at("centre"), place.key("centre"));
  if (!organ.contact) {
    throw bad_input(place.key("below_contact").where, "of an organ without a contact sphere",
                    "centre");
  }
  const auto contact = static_cast<Eigen::Index>(*organ.contact);
  const double depth_m = quantity_at(entry, "below_contact", Dimension::length, place);
  return organ.position.col(contact) - depth_m * organ.normal.col(contact);
}

/// The spheres whose centres are in a region.
std::vector<std::size_t> spheres_in(const Json& entry, const Organ& organ,
                                    const DocumentPlace& place) {
  const auto kind = entry.at("kind").get<std::string>();
  const auto need = [&](const char* key) {
    if (!entry.contains(key)) {
      throw bad_input(place.key(key).where, "is missing", "a place for the region");
    }
  };
  std::vector<std::size_t> found;
  const auto keep_if = [&](const auto& inside) {
    for (std::size_t i = 0; i < organ.size(); ++i) {
      if (inside(i, organ.position.col(static_cast<Eigen::Index>(i)))) found.push_back(i);
    }
  };
  if (kind == "layer") {
    need("layer");
    const int layer = entry.at("layer").get<int>() - 1;
    keep_if([&](std::size_t i, const Eigen::Vector3d&) { return organ.layer[i] == layer; });
  } else if (kind == "ball") {
    need("radius");
    const Eigen::Vector3d centre = centre_of_ball(entry, organ, place);
    const double radius_m = positive_at(entry, "radius", Dimension::length, place);
    keep_if(
        [&](std::size_t, const Eigen::Vector3d& at) { return (at - centre).norm() <= radius_m; });
  } else if (kind == "box") {
    need("from");
    need("to");
    const Eigen::Vector3d from = parse_point(entry.at("from"), place.key("from"));
    const Eigen::Vector3d to = parse_point(entry.at("to"), place.key("to"));
    keep_if([&](std::size_t, const Eigen::Vector3d& at) {
      return (at.array() >= from.array()).all() && (at.array() <= to.array()).all();
    });
  } else {
    need("spheres");
    const DocumentPlace list = place.key("spheres");
    std::size_t index = 0;
    for (const Json& number : entry.at("spheres")) {
      found.push_back(parse_sphere(number, organ, list.key(std::to_string(index++))));
    }
  }
  if (found.empty()) throw bad_input(place.where, "holds no sphere", "at least one sphere");
  return found;
}

double positive_factor(double factor, const DocumentPlace& place) {
  if (factor > 0.0 && std::isfinite(factor)) return factor;
  throw bad_input(place.where, fmt::format("a factor of {}", shortest(factor)), "above 0");
}

void add_function_of_place(const Json& entry, const Organ& organ, MaterialField& field,
                           const DocumentPlace& place) {
  const DocumentPlace here = place.key("factor");
  if (!entry.contains("factor") || !entry.at("factor").is_string()) {
    throw bad_input(here.where, "is no formula", "a text in x, y and z in metres");
  }
  PlaceFunction function(entry.at("factor").get<std::string>(), here.where);
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    field.factor[i] *= positive_factor(function.at(organ.position.col(i)), here);
  }
}

void add_region(const Json& entry, const Organ& organ, MaterialField& field,
                const DocumentPlace& place) {
  require_region_keys(entry, place);
  if (entry.at("kind") == "function") return add_function_of_place(entry, organ, field, place);
  if (entry.contains("factor") == entry.contains("material")) {
    throw bad_input(place.where, "a region needs one of two", "factor or material");
  }
  const std::vector<std::size_t> spheres = spheres_in(entry, organ, place);
  if (entry.contains("factor")) {
    if (!entry.at("factor").is_number()) {
      throw bad_input(place.key("factor").where, "is no number", "a number above 0");
    }
    const double factor = positive_factor(entry.at("factor").get<double>(), place.key("factor"));
    for (const std::size_t i : spheres) field.factor[static_cast<Eigen::Index>(i)] *= factor;
    return;
  }
  const MaterialBlock material =
      parse_plain_material(entry.at("material"), field.lateral(), organ.spacing,
                           field.materials.front(), place.key("material"));
  const auto number = static_cast<std::uint16_t>(field.materials.size());
  field.materials.push_back(material.materials.materials.front());
  field.of_sphere.resize(organ.size(), 0);
  for (const std::size_t i : spheres) field.of_sphere[i] = number;
}

}  // namespace

MaterialBlock parse_material(const Json& block, LateralBond lateral, const Organ& organ,
                             const DocumentPlace& place) {
  MaterialBlock read = parse_plain_material(block, lateral, organ.spacing, BondMaterial{}, place);
  if (block.contains("between")) {
    read.materials.between = parse_word(kBlendWords, "rule", block.at("between").get<std::string>(),
                                        place.key("between").where);
  }
  if (!block.contains("regions")) return read;
  read.materials.factor = Eigen::VectorXd::Ones(organ.position.cols());
  std::size_t index = 0;
  for (const Json& entry : block.at("regions")) {
    add_region(entry, organ, read.materials, place.key("regions").key(std::to_string(index++)));
  }
  return read;
}

}  // namespace tpm::organ
