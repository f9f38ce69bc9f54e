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

using Plain = PlainMaterialKeys;

/// A function of a bond's elongation: the name of a shape that the program links, and the values
/// of its parameters.
ValueType<ElongationFunction> function_type() {
  const auto form = [] {
    Form kinds{.type = Form::Type::kinds,
               .name = "elongation_function",
               .sentence = "a function of a bond's elongation: a shape and its parameters",
               .by = "shape"};
    for (const ElongationShape* shape : elongation_shapes()) {
      KindForm kind{std::string(shape->name()), std::string(shape->meaning()), {}};
      for (const MaterialParameter& p : shape->parameters()) {
        const Range range{.least = p.least, .above = p.least_excluded};
        kind.keys.push_back({.name = p.name,
                             .form = plain_quantity(p.dimension, range).form,
                             .sentence = p.meaning,
                             .required = true});
      }
      kinds.kinds.push_back(std::move(kind));
    }
    return shared(std::move(kinds));
  };
  return {shared({.type = Form::Type::later, .made = form}),
          [](const Json& value, const DocumentPlace& place) {
            const ElongationShape& shape =
                elongation_shape(value.at("shape").get<std::string>(), place.key("shape").where);
            ElongationFunction function(shape, {});
            for (std::size_t k = 0; k < shape.parameters().size(); ++k) {
              const MaterialParameter& p = shape.parameters()[k];
              function.set_value(k, quantity_at(value, p.name, p.dimension, place));
            }
            return function;
          },
          [](const ElongationFunction& function) {
            Json value{{"shape", function.shape_name()}};
            for (std::size_t k = 0; k < function.parameters().size(); ++k) {
              const MaterialParameter& p = function.parameters()[k];
              value[p.name] = plain_quantity(p.dimension).write(function.values()[k]);
            }
            return value;
          }};
}

const Block<Plain::Branch>& branch_block() {
  using B = Plain::Branch;
  static const Block<B> block(
      "branch", "a part of the modulus that relaxes",
      {required(key("g", &B::modulus_Pa, quantity(Dimension::stress, kZeroOrMore), "its modulus")),
       required(key("tau", &B::relaxation_time_s, quantity(Dimension::time, kAboveZero),
                    "its relaxation time"))});
  return block;
}

const Block<Plain::Fractional>& fractional_block() {
  using F = Plain::Fractional;
  const ValueType<double> time = quantity(Dimension::time, kAboveZero);
  static const Block<F> block(
      "fractional",
      "a modulus that relaxes by the Mittag-Leffler function of an order, as a sum of exponentials",
      {required(key("g", &F::modulus_Pa, quantity(Dimension::stress, kAboveZero), "the modulus")),
       required(key("order", &F::order, number({.least = 0.0, .most = 1.0, .above = true}),
                    "of the function; 1: an exponential")),
       required(key("tau", &F::relaxation_time_s, time, "the relaxation time")),
       required(key("shortest", &F::shortest_s, time, "the time from which on the sum is exact")),
       required(key("longest", &F::longest_s, time, "the time until which it is exact")),
       key("error", &F::error, number({.least = 1e-6, .most = 0.1}),
           "of the relaxation function, which begins at 1")});
  return block;
}

constexpr const char* kOneWay = "E1, E2 and eta1, or Einf with branches";

/// The constants of the element and what relaxes cannot stand in one material.
std::optional<Fault> two_ways(const Plain& material) {
  const auto first_of =
      [](std::initializer_list<std::pair<bool, const char*>> keys) -> const char* {
    for (const auto& [there, name] : keys) {
      if (there) return name;
    }
    return nullptr;
  };
  const char* of_element = first_of({{material.E1_Pa.has_value(), "E1"},
                                     {material.E2_Pa.has_value(), "E2"},
                                     {material.eta1_Pa_s.has_value(), "eta1"}});
  const char* of_branches = first_of({{material.Einf_Pa.has_value(), "Einf"},
                                      {material.branches.has_value(), "branches"},
                                      {material.fractional.has_value(), "fractional"}});
  if (of_element == nullptr || of_branches == nullptr) return std::nullopt;
  return Fault{of_element,
               fmt::format("stands beside {}, which is another way to say it", of_branches)};
}

std::vector<Key<Plain>> plain_keys() {
  const ValueType<double> modulus = quantity(Dimension::stress, kZeroOrMore);
  const TpmParameters usual;
  return {
      with_default(key("E1", &Plain::E1_Pa, modulus, "spring of the Kelvin-Voigt unit"),
                   modulus.write(usual.E1_Pa)),
      with_default(key("E2", &Plain::E2_Pa, modulus, "series spring"), modulus.write(usual.E2_Pa)),
      with_default(key("Eprime", &Plain::Eprime_Pa, modulus, "modulus of the lateral bonds"),
                   modulus.write(usual.Eprime_Pa)),
      with_default(
          key("eta1", &Plain::eta1_Pa_s, quantity(Dimension::viscosity, kAboveZero), "dashpot"),
          quantity(Dimension::viscosity).write(usual.eta1_Pa_s)),
      key("A0", &Plain::A0_m2, quantity(Dimension::area, kAboveZero),
          "area that turns stress into force; of a region: default the scene's"),
      key("l0", &Plain::l0_m, quantity(Dimension::length, kAboveZero),
          "length that turns displacement into strain; of a region: default the scene's"),
      key("Einf", &Plain::Einf_Pa, modulus, "equilibrium modulus, beside branches"),
      key("branches", &Plain::branches,
          list(branch_block().type(), {.most = BondMaterial::kMostBranches}), "what relaxes"),
      key("fractional", &Plain::fractional, fractional_block().type(),
          "what relaxes over many times"),
      key("potential", &Plain::potential, function_type(),
          "equilibrium force of a bond; default linear"),
      key("kernel", &Plain::kernel, function_type(), "on which the branches act; default linear")};
}

const Block<Plain>& plain_block() {
  static const Block<Plain> block("plain_material", "a material of bonds", plain_keys(),
                                  {{kOneWay, two_ways}});
  return block;
}

const Kinds<RegionKeys, RegionKind>& region_kinds() {
  using K = RegionKeys;
  const auto factor =
      key("factor", &K::factor, number(kAboveZero), "on all moduli; or a material instead");
  const auto material =
      key("material", &K::material, plain_block().type(), "in place of the scene's");
  const ValueType<double> length = quantity(Dimension::length);
  static const Kinds<K, RegionKind> kinds(
      {.name = "region",
       .sentence = "spheres whose bonds differ, by a factor on all moduli or by a material"},
      &K::kind,
      {{RegionKind::layer,
        "layer",
        "a layer of spheres",
        {required(key("layer", &K::layer, whole<int>(1, 1000), "1: outermost")), factor, material}},
       {RegionKind::ball,
        "ball",
        "the spheres in a ball",
        {key("centre", &K::centre, point_type(), "the middle; or below_contact"),
         key("below_contact", &K::below_contact_m, length,
             "the middle is so deep below the contact sphere"),
         required(
             key("radius", &K::radius_m, quantity(Dimension::length, kAboveZero), "of the ball")),
         factor, material}},
       {RegionKind::box,
        "box",
        "the spheres in a box",
        {required(key("from", &K::from, point_type(), "its lowest corner")),
         required(key("to", &K::to, point_type(), "its highest corner")), factor, material}},
       {RegionKind::spheres,
        "spheres",
        "spheres by their numbers",
        {required(key("spheres", &K::spheres, list(sphere_type(), {.fewest = 1, .most = 1'000'000}),
                      "numbers of spheres")),
         factor, material}},
       {RegionKind::function,
        "function",
        "all spheres, by a function of place",
        {required(key("factor", &K::formula, text(1),
                      "a formula of x, y and z in metres, above 0 everywhere"))}}},
      {{"centre or below_contact",
        [](const K& region) -> std::optional<Fault> {
          if (region.kind != RegionKind::ball ||
              region.centre.has_value() != region.below_contact_m.has_value()) {
            return std::nullopt;
          }
          return Fault{"", "a ball needs one place"};
        }},
       {"factor or material", [](const K& region) -> std::optional<Fault> {
          if (region.kind == RegionKind::function ||
              region.factor.has_value() != region.material.has_value()) {
            return std::nullopt;
          }
          return Fault{"", "a region needs one of two"};
        }}});
  return kinds;
}

void add_fractional(const Plain::Fractional& entry, BondMaterial& material,
                    const DocumentPlace& place) {
  const FractionalWindow window{entry.shortest_s, entry.longest_s, entry.error};
  const std::size_t left = BondMaterial::kMostBranches - material.branches.size();
  try {
    const FractionalBranches sum =
        fractional_branches(entry.order, entry.relaxation_time_s, window, left);
    material.equilibrium_Pa += entry.modulus_Pa * sum.constant;
    for (const auto& [share, time_s] : sum.branches) {
      material.branches.push_back({entry.modulus_Pa * share, time_s});
    }
  } catch (const Error& error) {
    throw error.within(place.where);
  }
}

BondMaterial element_bonds(const Plain& block, LateralBond lateral, double spacing_m,
                           const BondMaterial& usual, const DocumentPlace& place) {
  TpmParameters element;
  element.E1_Pa = block.E1_Pa.value_or(element.E1_Pa);
  element.E2_Pa = block.E2_Pa.value_or(element.E2_Pa);
  element.Eprime_Pa = block.Eprime_Pa.value_or(element.Eprime_Pa);
  element.eta1_Pa_s = block.eta1_Pa_s.value_or(element.eta1_Pa_s);
  element.spacing_m = spacing_m;
  element.A0_m2 = block.A0_m2.value_or(usual.A0_m2);
  element.l0_m = block.l0_m.value_or(usual.l0_m);
  require_valid(element, place.where);
  return element.bonds(lateral);
}

BondMaterial branched_bonds(const Plain& block, LateralBond lateral, const BondMaterial& usual,
                            const DocumentPlace& place) {
  BondMaterial material;
  material.lateral = lateral;
  material.equilibrium_Pa = block.Einf_Pa.value_or(0.0);
  material.lateral_Pa = block.Eprime_Pa.value_or(paper_element().lateral_Pa);
  material.A0_m2 = block.A0_m2.value_or(usual.A0_m2);
  material.l0_m = block.l0_m.value_or(usual.l0_m);
  for (const Plain::Branch& branch : block.branches.value_or(std::vector<Plain::Branch>{})) {
    material.branches.push_back({branch.modulus_Pa, branch.relaxation_time_s});
  }
  if (block.fractional) add_fractional(*block.fractional, material, place.key("fractional"));
  return material;
}

/// A material without its regions.
/// @param usual where A0 and l0 come from if the block does not say
MaterialBlock plain_material(const Plain& block, LateralBond lateral, double spacing_m,
                             const BondMaterial& usual, const DocumentPlace& place) {
  MaterialBlock read;
  read.by_constants = !block.Einf_Pa && !block.branches && !block.fractional;
  BondMaterial material = read.by_constants ? element_bonds(block, lateral, spacing_m, usual, place)
                                            : branched_bonds(block, lateral, usual, place);
  material.potential = block.potential;
  material.kernel = block.kernel;
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

Eigen::Vector3d centre_of_ball(const RegionKeys& region, const Organ& organ,
                               const DocumentPlace& place) {
  if (region.centre) return vector_of(*region.centre);
  if (!organ.contact) {
    throw bad_input(place.key("below_contact").where, "of an organ without a contact sphere",
                    "centre");
  }
  const auto contact = static_cast<Eigen::Index>(*organ.contact);
  return organ.position.col(contact) - *region.below_contact_m * organ.normal.col(contact);
}

/// The spheres whose centres are in a region.
std::vector<std::size_t> spheres_in(const RegionKeys& region, const Organ& organ,
                                    const DocumentPlace& place) {
  std::vector<std::size_t> found;
  const auto keep_if = [&](const auto& inside) {
    for (std::size_t i = 0; i < organ.size(); ++i) {
      if (inside(i, organ.position.col(static_cast<Eigen::Index>(i)))) found.push_back(i);
    }
  };
  if (region.kind == RegionKind::layer) {
    keep_if(
        [&](std::size_t i, const Eigen::Vector3d&) { return organ.layer[i] == region.layer - 1; });
  } else if (region.kind == RegionKind::ball) {
    const Eigen::Vector3d centre = centre_of_ball(region, organ, place);
    keep_if([&](std::size_t, const Eigen::Vector3d& at) {
      return (at - centre).norm() <= region.radius_m;
    });
  } else if (region.kind == RegionKind::box) {
    const Eigen::Vector3d from = vector_of(*region.from), to = vector_of(*region.to);
    keep_if([&](std::size_t, const Eigen::Vector3d& at) {
      return (at.array() >= from.array()).all() && (at.array() <= to.array()).all();
    });
  } else {
    const DocumentPlace list = place.key("spheres");
    for (const std::size_t number : region.spheres) {
      found.push_back(sphere_of(number, organ, list.key(std::to_string(found.size()))));
    }
  }
  if (found.empty()) throw bad_input(place.where, "holds no sphere", "at least one sphere");
  return found;
}

void add_function_of_place(const std::string& formula, const Organ& organ, MaterialField& field,
                           const DocumentPlace& place) {
  PlaceFunction function(formula, place.where);
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    const double factor = function.at(organ.position.col(i));
    if (!(factor > 0.0) || !std::isfinite(factor)) {
      throw bad_input(place.where, fmt::format("a factor of {}", shortest(factor)), "above 0");
    }
    field.factor[i] *= factor;
  }
}

void add_region(const RegionKeys& region, const Organ& organ, MaterialField& field,
                const DocumentPlace& place) {
  if (region.kind == RegionKind::function) {
    return add_function_of_place(region.formula, organ, field, place.key("factor"));
  }
  const std::vector<std::size_t> spheres = spheres_in(region, organ, place);
  if (region.factor) {
    for (const std::size_t i : spheres)
      field.factor[static_cast<Eigen::Index>(i)] *= *region.factor;
    return;
  }
  const MaterialBlock material = plain_material(*region.material, field.lateral(), organ.spacing,
                                                field.materials.front(), place.key("material"));
  const auto number = static_cast<std::uint16_t>(field.materials.size());
  field.materials.push_back(material.materials.materials.front());
  field.of_sphere.resize(organ.size(), 0);
  for (const std::size_t i : spheres) field.of_sphere[i] = number;
}

}  // namespace

const Block<MaterialKeys>& material_block() {
  static const Block<MaterialKeys> block = [] {
    std::vector<Key<MaterialKeys>> keys;
    for (const Key<Plain>& one : plain_keys()) keys.push_back(within(&MaterialKeys::plain, one));
    keys.push_back(
        key("E", &MaterialKeys::E_Pa, quantity(Dimension::stress, kAboveZero),
            "Young's modulus of the tissue at equilibrium, of a solid: all moduli of the "
            "bonds are multiplied so that a block of them has it"));
    keys.push_back(
        key("nu", &MaterialKeys::nu, number({.least = -1.0, .most = 0.5}),
            "Poisson ratio of the tissue, beside E: only the network's own, 1/4 if it is "
            "isotropic, 0.15 along the axes of an fcc solid"));
    keys.push_back(key("regions", &MaterialKeys::regions,
                       list(region_kinds().type(), {.fewest = 1, .most = 1000}),
                       "places of another stiffness or material, each on top of those before it"));
    keys.push_back(key("between", &MaterialKeys::between, word(kBlendWords),
                       "how a bond between two materials or factors follows from them"));
    return Block<MaterialKeys>(
        "material",
        "of the bonds: the paper's element, whose defaults are its constants, or Einf with "
        "branches",
        keys,
        {{kOneWay, [](const MaterialKeys& material) { return two_ways(material.plain); }},
         {"nu beside E", [](const MaterialKeys& material) -> std::optional<Fault> {
            if (!material.nu || material.E_Pa) return std::nullopt;
            return Fault{"nu", "of a tissue without E"};
          }}});
  }();
  return block;
}

MaterialBlock material_of(const MaterialKeys& block, LateralBond lateral, const Organ& organ,
                          const DocumentPlace& place) {
  MaterialBlock read = plain_material(block.plain, lateral, organ.spacing, BondMaterial{}, place);
  read.materials.between = block.between;
  if (block.regions.empty()) return read;
  read.materials.factor = Eigen::VectorXd::Ones(organ.position.cols());
  std::size_t index = 0;
  for (const RegionKeys& region : block.regions) {
    add_region(region, organ, read.materials, place.key("regions").key(std::to_string(index++)));
  }
  return read;
}

MaterialBlock parse_material(const Json& block, LateralBond lateral, const Organ& organ,
                             const DocumentPlace& place) {
  return material_of(material_block().read(block, place, Numbers::also_si), lateral, organ, place);
}

}  // namespace tpm::organ
