// Declared in tpm/organ/scene/blocks.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/mesh_file.hpp"
#include "tpm/organ/body/mesh_surface.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/scene/blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

namespace fs = std::filesystem;

constexpr double kUsualSpacing_m = 0.020;

constexpr auto kFillingWords =
    std::to_array<Word<Filling>>({{Filling::shell, "shell"}, {Filling::solid, "solid"}});

/// Result of a function of the folder `network`; its errors get the place of the block.
template <class Make>
Organ made(const DocumentPlace& place, Make&& make) {
  try {
    return make();
  } catch (const Error& error) {
    throw error.within(place.where);
  }
}

const Block<ShapeKeys>& shape_block() {
  static const Block<ShapeKeys> block = [] {
    std::vector<Key<ShapeKeys>> keys;
    for (const LiverMeasure& measure : liver_measures()) {
      const bool length = measure.value == &LiverShape::width ||
                          measure.value == &LiverShape::height ||
                          measure.value == &LiverShape::depth;
      const ValueType<double> type = length
                                         ? quantity(Dimension::length, kAboveZero)
                                         : number({.least = measure.least, .most = measure.most});
      keys.push_back(within(&ShapeKeys::shape, key(std::string(measure.name), measure.value, type,
                                                   std::string(measure.meaning))));
      if (measure.value != &LiverShape::width) continue;
      keys.back().read = [read = keys.back().read](ShapeKeys& into, const Json& value,
                                                   const DocumentPlace& place) {
        read(into, value, place);
        into.has_width = true;
      };
    }
    return Block<ShapeKeys>(
        "shape", "measures of the liver; with a width the count decides the spacing", keys);
  }();
  return block;
}

const Block<ListedSphere>& listed_sphere_block() {
  static const Block<ListedSphere> block(
      "listed_sphere", "a sphere of the tissue",
      {required(
           key("at", &ListedSphere::at, three(number()), "three coordinates in the organ's unit")),
       key("layer", &ListedSphere::layer, whole<int>(1, 1000), "1: outermost"),
       key("normal", &ListedSphere::normal, three(number()), "outward; default: along z")});
  return block;
}

LiverShape shape_of(const OrganKeys& block, const DocumentPlace& place) {
  if (!block.shape) return {};
  require_valid(block.shape->shape, place.key("shape").where);
  return block.shape->shape;
}

bool is_solid(const OrganKeys& block) {
  return block.filling == Filling::solid;
}

/// A surface filled throughout; the contact is the sphere of the outer layer nearest to a place.
Organ solid_filling(const Surface& surface, const OrganKeys& block,
                    const std::optional<Eigen::Vector3d>& landing, const DocumentPlace& place) {
  SolidRequest request;
  request.count = block.count;
  request.spacing = block.spacing_m;
  request.lattice = block.lattice.value_or(request.lattice);
  request.seed = block.seed.value_or(request.seed);
  Organ organ = made(place, [&] { return fill_solid(surface, request); });
  if (!landing) return organ;
  organ.contact = nearest_outer_sphere(organ, *landing);
  return organ;
}

Organ parse_liver(const OrganKeys& block, const DocumentPlace& place) {
  LiverRequest request;
  request.shape = shape_of(block, place);
  // A width that is named is meant: the count then decides the spacing.
  if (block.shape && block.shape->has_width) request.spacing.reset();
  if (is_solid(block)) {
    const MeshSurface surface = liver_surface(request.shape);
    Organ organ =
        solid_filling(surface, block, front_of_right_lobe(request.shape, surface).position, place);
    organ.name = fmt::format("liver filled with {} spheres", organ.size());
    organ.assumptions.insert(organ.assumptions.begin(),
                             {"shape_in_few_measures",
                              "the shape is a liver's in a few measures; the probe comes from the "
                              "front of the right lobe"});
    return organ;
  }
  if (block.spacing_m) request.spacing = block.spacing_m;
  request.count = block.count.value_or(request.count);
  request.layers = block.layers.value_or(request.layers);
  request.seed = block.seed.value_or(request.seed);
  return made(place, [&] { return fill_liver(request); });
}

/// The probe lands on the surface; a place given roughly may lie a tenth of the organ's size off
/// it.
void require_near(const Surface& surface, const Eigen::Vector3d& landing,
                  const DocumentPlace& place) {
  constexpr double kRoughly = 0.1;
  const double off_m = std::abs(surface.signed_distance(landing));
  const double most_m = kRoughly * surface.bounds().diagonal().norm();
  if (off_m <= most_m) return;
  throw bad_input(place.where,
                  fmt::format("lies {} mm off the surface", significant(1e3 * off_m, 4)),
                  fmt::format("a point on it, or within {} mm", significant(1e3 * most_m, 3)));
}

Organ parse_mesh(const OrganKeys& block, const DocumentPlace& place, const fs::path& folder) {
  const Unit unit = parse_unit(block.unit, Dimension::length, place.key("unit").where);
  const ClosedMesh closed = read_closed_mesh(folder / block.mesh, unit);
  const MeshSurface surface(closed.mesh);
  std::optional<Eigen::Vector3d> landing;
  if (block.landing) {
    landing = vector_of(*block.landing);
    require_near(surface, *landing, place.key("landing"));
  }
  Organ organ;
  if (is_solid(block)) {
    organ = solid_filling(surface, block, landing, place);
  } else {
    ShellRequest request;
    request.count = block.count;
    request.spacing = block.spacing_m;
    request.layers = block.layers.value_or(request.layers);
    request.seed = block.seed.value_or(request.seed);
    request.landing = landing;
    organ = made(place, [&] { return fill_shell(surface, request); });
  }
  organ.assumptions.insert(organ.assumptions.end(), closed.notes.begin(), closed.notes.end());
  return organ;
}

Organ parse_block(const OrganKeys& block, const DocumentPlace& place) {
  const auto [x, y, z] = block.cells;
  const double spacing = block.spacing_m.value_or(kUsualSpacing_m);
  const Lattice lattice = block.lattice.value_or(Lattice::fcc);
  return made(place,
              [&, x = x, y = y, z = z] { return tpm::organ::block(x, y, z, spacing, lattice); });
}

Organ parse_star(const OrganKeys& block, const DocumentPlace& place) {
  const double spacing = block.spacing_m.value_or(BondElement{}.spacing_m);
  const double length = block.length_m.value_or(kUsualSpacing_m);
  return made(place, [&] { return star(spacing, length); });
}

Organ parse_listed(const OrganKeys& block, const DocumentPlace& place) {
  const Unit unit = parse_unit(block.unit, Dimension::length, place.key("unit").where);
  Organ organ;
  organ.name = fmt::format("{} listed spheres", block.spheres.size());
  organ.position.resize(3, static_cast<Eigen::Index>(block.spheres.size()));
  organ.normal = Eigen::Vector3d::UnitZ().replicate(1, organ.position.cols());
  for (std::size_t i = 0; i < block.spheres.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const ListedSphere& sphere = block.spheres[i];
    organ.position.col(column) = unit.to_si * vector_of(sphere.at);
    organ.layer.push_back(sphere.layer - 1);
    if (sphere.normal) organ.normal.col(column) = vector_of(*sphere.normal).stableNormalized();
  }
  organ.spacing = block.spacing_m.value();
  organ.radius = 0.5 * organ.spacing;
  return organ;
}

Organ spheres_of(const OrganKeys& block, const DocumentPlace& place, const fs::path& folder) {
  switch (block.kind) {
    case OrganKind::liver:
      return parse_liver(block, place);
    case OrganKind::mesh:
      return parse_mesh(block, place, folder);
    case OrganKind::block:
      return parse_block(block, place);
    case OrganKind::star:
      return parse_star(block, place);
    case OrganKind::listed:
      return parse_listed(block, place);
  }
  throw Error(ExitCode::numerical, place.where, "a kind of organ without a reader");
}

/// The keys of a body that is filled with spheres.
std::vector<Key<OrganKeys>> filling_keys(Json usual_count) {
  using K = OrganKeys;
  const LiverRequest usual;
  return {with_default(key("count", &K::count, whole<std::size_t>(2, 1e6), "number of spheres"),
                       std::move(usual_count)),
          with_default(key("layers", &K::layers, whole<int>(1, 100), "layers of a shell"),
                       usual.layers),
          key("spacing", &K::spacing_m, quantity(Dimension::length, kAboveZero),
              "distance of neighbours, centre to centre"),
          with_default(key("seed", &K::seed, whole<std::uint64_t>(0, 9007199254740991),
                           "of the places from which the outer layer starts"),
                       usual.seed),
          key("filling", &K::filling, word(kFillingWords),
              "layers below the surface, or spheres throughout"),
          with_default(key("lattice", &K::lattice, word(kLatticeWords), "inside a solid filling"),
                       "fcc")};
}

std::vector<Key<OrganKeys>> with_more(std::vector<Key<OrganKeys>> keys,
                                      std::vector<Key<OrganKeys>> more) {
  keys.insert(keys.end(), more.begin(), more.end());
  return keys;
}

std::optional<Fault> filling_fault(const OrganKeys& block) {
  const bool filled = block.kind == OrganKind::liver || block.kind == OrganKind::mesh;
  if (filled && is_solid(block) && block.layers) return Fault{"layers", "in a solid filling"};
  if (filled && !is_solid(block) && block.lattice) return Fault{"lattice", "in a shell filling"};
  return std::nullopt;
}

std::optional<Fault> width_fault(const OrganKeys& block) {
  const bool has_width = block.shape && block.shape->has_width;
  if (is_solid(block) || !has_width || !block.spacing_m) return std::nullopt;
  return Fault{"spacing", "beside a width of the shape"};
}

}  // namespace

ValueType<std::size_t> sphere_type() {
  return whole<std::size_t>(1, 1e6).named("sphere", "number of a sphere, from 1");
}

ValueType<PointKeys> point_type() {
  return three(quantity(Dimension::length))
      .named("point", "three lengths, such as [\"2 mm\", \"136 mm\", \"57 mm\"]");
}

const Kinds<OrganKeys, OrganKind>& organ_kinds() {
  using K = OrganKeys;
  const ValueType<double> length = quantity(Dimension::length, kAboveZero);
  const auto spacing =
      key("spacing", &K::spacing_m, length, "distance of neighbours, centre to centre");
  const auto contact =
      key("contact", &K::contact, sphere_type(), "the sphere that the probe meets");
  const auto unit = required(with_example(
      key("unit", &K::unit, text(1), "the length that a coordinate of 1 means: mm, cm, m"), "mm"));
  static const Kinds<K, OrganKind> kinds(
      {.name = "organ", .sentence = "the spheres of the tissue"}, &K::kind,
      {{OrganKind::liver, "liver", "a liver, filled with spheres",
        with_more({key("shape", &K::shape, shape_block().type(), "measures of the liver")},
                  filling_keys(LiverRequest{}.count))},
       {OrganKind::mesh, "mesh", "a closed surface, filled with spheres",
        with_more({required(key("mesh", &K::mesh, text(1),
                                "path of an STL or OBJ file, relative to the scene")),
                   unit,
                   key("landing", &K::landing, point_type(),
                       "where the probe lands: the nearest outer sphere is the contact")},
                  filling_keys(nullptr))},
       {OrganKind::block,
        "block",
        "a block of spheres on a lattice",
        {required(with_example(key("cells", &K::cells, three(whole<int>(1, 1e6)),
                                   "numbers of cells along x, y and z"),
                               {8, 8, 4})),
         with_default(spacing, length.write(kUsualSpacing_m)),
         with_default(key("lattice", &K::lattice, word(kLatticeWords), "of the spheres"), "fcc"),
         contact}},
       {OrganKind::star,
        "star",
        "the four spheres of the paper's element",
        {with_default(spacing, length.write(BondElement{}.spacing_m)),
         with_default(key("length", &K::length_m, length, "of the inter-layer bond"),
                      length.write(kUsualSpacing_m))}},
       {OrganKind::listed,
        "listed",
        "spheres that are given one by one",
        {required(key("spheres", &K::spheres, list(listed_sphere_block().type(), {.fewest = 2}),
                      "the spheres")),
         unit, required(spacing), contact}}},
      {{"layers in a shell only, lattice in a solid filling only", filling_fault},
       {"one of the two: the count and either of them decide the other", width_fault}});
  return kinds;
}

std::size_t nearest_outer_sphere(const Organ& organ, const Eigen::Vector3d& place) {
  const auto outer = std::count(organ.layer.begin(), organ.layer.end(), 0);  // numbered first
  Eigen::Index nearest = 0;
  (organ.position.leftCols(outer).colwise() - place).colwise().squaredNorm().minCoeff(&nearest);
  return static_cast<std::size_t>(nearest);
}

std::vector<double> refilling_steps(const OrganKeys& block, const Organ& organ) {
  constexpr int kMostParts = 12, kSteps = 18;  // of cells or layers; of the spacing of a solid
  std::vector<double> steps;
  if (block.kind == OrganKind::block) {
    const int common = std::gcd(block.cells[0], std::gcd(block.cells[1], block.cells[2]));
    for (int i = 1; i <= kMostParts * common; ++i) steps.push_back(static_cast<double>(i) / common);
  } else if (is_solid(block)) {
    for (int i = -kSteps; i <= kSteps; ++i) steps.push_back(std::exp2(i / 3.0));
  } else {
    const int own = organ.layer_count();
    for (int i = 1; i <= kMostParts * own; ++i) steps.push_back(static_cast<double>(i) / own);
  }
  return steps;
}

namespace {

using Refilled = std::optional<std::pair<Json, std::size_t>>;

/// A number of cells or layers, which is whole; none if it is not, or below the least.
std::optional<int> whole(double number, int least) {
  const double rounded_number = std::round(number);
  if (std::abs(number - rounded_number) > 1e-9 || rounded_number < least) return std::nullopt;
  return static_cast<int>(rounded_number);
}

Refilled refilled_block(Json written, const OrganKeys& block, const Organ& organ, double finer) {
  constexpr int kFewestCells = 2;
  std::array<int, 3> cells = block.cells;
  for (int& along : cells) {
    const auto count = whole(along * finer, kFewestCells);
    if (!count) return std::nullopt;
    along = *count;
  }
  written["cells"] = cells;
  written["spacing"] = shortest(organ.spacing / finer) + " m";
  const double spheres = static_cast<double>(organ.size()) * finer * finer * finer;  // about
  return std::pair{std::move(written), static_cast<std::size_t>(std::round(spheres))};
}

/// States the measures that a liver has by its count and spacing.
void state_shape(Json& stated, const OrganKeys& block, const Organ& organ,
                 const DocumentPlace& place) {
  LiverShape shape = shape_of(block, place);
  if (!is_solid(block)) {
    const auto outer =
        static_cast<std::size_t>(std::count(organ.layer.begin(), organ.layer.end(), 0));
    shape = scaled(shape, organ.spacing / even_spacing(liver_surface(shape), outer));
  }
  stated["width"] = shortest(shape.width) + " m";
  stated["height"] = shortest(shape.height) + " m";
  stated["depth"] = shortest(shape.depth) + " m";
}

}  // namespace

Refilled refilled_organ(const Json& written, const OrganKeys& block, const Organ& organ,
                        double finer, const DocumentPlace& place) {
  if (block.kind == OrganKind::star || block.kind == OrganKind::listed) {
    throw bad_input(place.key("kind").where, "spheres that are given one by one",
                    "a body that can be filled with more of them: liver, mesh or block");
  }
  if (block.kind == OrganKind::block) return refilled_block(written, block, organ, finer);
  Json refilled = written;
  if (!is_solid(block)) {
    const auto layers = whole(organ.layer_count() * finer, 1);
    if (!layers) return std::nullopt;
    refilled["layers"] = *layers;
  }
  const auto count = static_cast<std::size_t>(
      std::round(static_cast<double>(organ.size()) * finer * finer * finer));
  refilled["count"] = count;
  refilled.erase("spacing");
  const bool has_width = block.shape && block.shape->has_width;
  if (block.kind == OrganKind::liver && !has_width) {
    state_shape(refilled["shape"], block, organ, place);
  }
  return std::pair{std::move(refilled), count};
}

std::size_t sphere_of(std::size_t number, const Organ& organ, const DocumentPlace& place) {
  if (number <= organ.size()) return number - 1;
  throw bad_input(place.where, fmt::format("no sphere {}", number),
                  fmt::format("1 to {}", organ.size()));
}

OrganBlock organ_of(const OrganKeys& block, const DocumentPlace& place, const fs::path& folder) {
  OrganBlock result;
  result.organ = spheres_of(block, place, folder);
  if (block.contact) {
    result.organ.contact = sphere_of(*block.contact, result.organ, place.key("contact"));
  }
  require_valid(result.organ, place.where);
  result.star = block.kind == OrganKind::star;
  result.liver = block.kind == OrganKind::liver;
  return result;
}

}  // namespace tpm::organ
