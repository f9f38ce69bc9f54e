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

enum class OrganKind { liver, mesh, block, star, listed };

/// A kind of organ and the keys that speak of it.
struct KindKeys {
  OrganKind meaning;
  std::string_view text;
  std::array<std::string_view, 10> keys;
};

constexpr std::array<KindKeys, 5> kKinds{{
    {OrganKind::liver,
     "liver",
     {"count", "layers", "spacing", "seed", "shape", "filling", "lattice"}},
    {OrganKind::mesh,
     "mesh",
     {"mesh", "unit", "landing", "count", "layers", "spacing", "seed", "filling", "lattice"}},
    {OrganKind::block, "block", {"cells", "spacing", "lattice", "contact"}},
    {OrganKind::star, "star", {"spacing", "length"}},
    {OrganKind::listed, "listed", {"spheres", "unit", "spacing", "contact"}},
}};

void require_keys_of(const Json& block, const KindKeys& kind, const DocumentPlace& place) {
  for (const auto& [key, value] : block.items()) {
    if (key == "kind" || std::find(kind.keys.begin(), kind.keys.end(), key) != kind.keys.end()) {
      continue;
    }
    std::string known;
    for (const std::string_view name : kind.keys) {
      if (!name.empty()) known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    }
    throw bad_input(place.key(key).where, fmt::format("is no key of the kind '{}'", kind.text),
                    fmt::format("one of {}", known));
  }
}

void require_key(const Json& block, const char* key, const DocumentPlace& place,
                 std::string_view expected) {
  if (!block.contains(key)) throw bad_input(place.key(key).where, "is missing", expected);
}

std::optional<double> length_at(const Json& block, const char* key, const DocumentPlace& place) {
  if (!block.contains(key)) return std::nullopt;
  const double length = quantity_at(block, key, Dimension::length, place);
  if (length > 0.0) return length;
  throw bad_input(place.key(key).where, fmt::format("{} m", length), "a length above 0");
}

std::optional<std::size_t> count_at(const Json& block) {
  if (!block.contains("count")) return std::nullopt;
  return block.at("count").get<std::size_t>();
}

bool is_solid(const Json& block, const DocumentPlace& place) {
  const bool solid = block.value("filling", "shell") == "solid";
  const auto refuse = [&](const char* key, const char* filling) {
    if (!block.contains(key)) return;
    throw bad_input(place.key(key).where, fmt::format("in a {} filling", filling), "no such key");
  };
  if (solid) {
    refuse("layers", "solid");
  } else {
    refuse("lattice", "shell");
  }
  return solid;
}

Lattice lattice_of(const Json& block, Lattice usual, const DocumentPlace& place) {
  if (!block.contains("lattice")) return usual;
  return parse_word(kLatticeWords, "lattice", block.at("lattice").get<std::string>(),
                    place.key("lattice").where);
}

/// What a function of the folder `network` returns; its errors get the place of the block.
template <class Make>
Organ made(const DocumentPlace& place, Make&& make) {
  try {
    return make();
  } catch (const Error& error) {
    throw error.within(place.where);
  }
}

LiverShape parse_shape(const Json& block, const DocumentPlace& place) {
  LiverShape shape;
  for (const LiverMeasure& measure : liver_measures()) {
    const std::string key(measure.name);
    if (!block.contains(key)) continue;
    const bool length = measure.value == &LiverShape::width ||
                        measure.value == &LiverShape::height || measure.value == &LiverShape::depth;
    const Json& value = block.at(key);
    if (length != value.is_string()) {
      throw bad_input(place.key(key).where, fmt::format("{}", value.dump()),
                      length ? "a length, such as \"210 mm\"" : "a number");
    }
    shape.*measure.value =
        length ? quantity_at(block, key, Dimension::length, place) : value.get<double>();
  }
  require_valid(shape, place.where);
  return shape;
}

/// A surface filled throughout; the contact is the sphere of the outer layer nearest to a place.
Organ solid_filling(const Surface& surface, const Json& block,
                    const std::optional<Eigen::Vector3d>& landing, const DocumentPlace& place) {
  SolidRequest request;
  request.count = count_at(block);
  request.spacing = length_at(block, "spacing", place);
  request.lattice = lattice_of(block, request.lattice, place);
  request.seed = block.value("seed", request.seed);
  Organ organ = made(place, [&] { return fill_solid(surface, request); });
  if (!landing) return organ;
  organ.contact = nearest_outer_sphere(organ, *landing);
  return organ;
}

Organ parse_liver(const Json& block, const DocumentPlace& place) {
  LiverRequest request;
  if (block.contains("shape")) {
    request.shape = parse_shape(block.at("shape"), place.key("shape"));
    // A width that is named is meant: the count then decides the spacing.
    if (block.at("shape").contains("width")) request.spacing.reset();
  }
  const bool solid = is_solid(block, place);
  if (solid) {
    const MeshSurface surface = liver_surface(request.shape);
    Organ organ =
        solid_filling(surface, block, front_of_right_lobe(request.shape, surface).position, place);
    organ.name = fmt::format("liver filled with {} spheres", organ.size());
    organ.assumptions.insert(organ.assumptions.begin(),
                             "the shape is a liver's in a few measures; the probe comes from the "
                             "front of the right lobe");
    return organ;
  }
  if (const auto spacing = length_at(block, "spacing", place)) {
    if (!request.spacing) {
      throw bad_input(place.key("spacing").where, "beside a width of the shape",
                      "one of the two: the count and either of them decide the other");
    }
    request.spacing = spacing;
  }
  request.count = count_at(block).value_or(request.count);
  request.layers = block.value("layers", request.layers);
  request.seed = block.value("seed", request.seed);
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

Organ parse_mesh(const Json& block, const DocumentPlace& place, const fs::path& folder) {
  require_key(block, "mesh", place, "a path of an STL or OBJ file");
  require_key(block, "unit", place, "the length that a coordinate of 1 means, such as \"mm\"");
  const Unit unit =
      parse_unit(block.at("unit").get<std::string>(), Dimension::length, place.key("unit").where);
  const ClosedMesh closed = read_closed_mesh(folder / block.at("mesh").get<std::string>(), unit);
  const MeshSurface surface(closed.mesh);
  std::optional<Eigen::Vector3d> landing;
  if (block.contains("landing")) {
    landing = parse_point(block.at("landing"), place.key("landing"));
    require_near(surface, *landing, place.key("landing"));
  }
  Organ organ;
  if (is_solid(block, place)) {
    organ = solid_filling(surface, block, landing, place);
  } else {
    ShellRequest request;
    request.count = count_at(block);
    request.spacing = length_at(block, "spacing", place);
    request.layers = block.value("layers", request.layers);
    request.seed = block.value("seed", request.seed);
    request.landing = landing;
    organ = made(place, [&] { return fill_shell(surface, request); });
  }
  organ.assumptions.insert(organ.assumptions.end(), closed.notes.begin(), closed.notes.end());
  return organ;
}

Organ parse_block(const Json& block, const DocumentPlace& place) {
  require_key(block, "cells", place, "three numbers of cells, such as [8, 8, 4]");
  const auto cells = block.at("cells").get<std::array<int, 3>>();
  const double spacing = length_at(block, "spacing", place).value_or(0.020);
  const Lattice lattice = lattice_of(block, Lattice::fcc, place);
  return made(place,
              [&] { return tpm::organ::block(cells[0], cells[1], cells[2], spacing, lattice); });
}

Organ parse_star(const Json& block, const DocumentPlace& place) {
  const double spacing = length_at(block, "spacing", place).value_or(BondElement{}.spacing_m);
  const double length = length_at(block, "length", place).value_or(0.020);
  return made(place, [&] { return star(spacing, length); });
}

Organ parse_listed(const Json& block, const DocumentPlace& place) {
  require_key(block, "spheres", place, "a list of spheres");
  require_key(block, "unit", place, "the length that a coordinate of 1 means, such as \"mm\"");
  require_key(block, "spacing", place, "the nominal distance between neighbours");
  const Unit unit =
      parse_unit(block.at("unit").get<std::string>(), Dimension::length, place.key("unit").where);
  const Json& spheres = block.at("spheres");
  Organ organ;
  organ.name = fmt::format("{} listed spheres", spheres.size());
  organ.position.resize(3, static_cast<Eigen::Index>(spheres.size()));
  organ.normal = Eigen::Vector3d::UnitZ().replicate(1, organ.position.cols());
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const auto at = spheres[i].at("at").get<std::array<double, 3>>();
    organ.position.col(column) = unit.to_si * Eigen::Vector3d(at[0], at[1], at[2]);
    organ.layer.push_back(spheres[i].value("layer", 1) - 1);
    if (!spheres[i].contains("normal")) continue;
    const auto normal = spheres[i].at("normal").get<std::array<double, 3>>();
    organ.normal.col(column) = Eigen::Vector3d(normal[0], normal[1], normal[2]).stableNormalized();
  }
  organ.spacing = *length_at(block, "spacing", place);
  organ.radius = 0.5 * organ.spacing;
  return organ;
}

Organ organ_of(OrganKind kind, const Json& block, const DocumentPlace& place,
               const fs::path& folder) {
  switch (kind) {
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

}  // namespace

std::size_t nearest_outer_sphere(const Organ& organ, const Eigen::Vector3d& place) {
  const auto outer = std::count(organ.layer.begin(), organ.layer.end(), 0);  // numbered first
  Eigen::Index nearest = 0;
  (organ.position.leftCols(outer).colwise() - place).colwise().squaredNorm().minCoeff(&nearest);
  return static_cast<std::size_t>(nearest);
}

std::vector<double> refilling_steps(const Json& block, const Organ& organ) {
  constexpr int kMostParts = 12, kSteps = 18;  // of cells or layers; of the spacing of a solid
  std::vector<double> steps;
  if (block.at("kind") == "block") {
    const auto cells = block.at("cells").get<std::array<int, 3>>();
    const int common = std::gcd(cells[0], std::gcd(cells[1], cells[2]));
    for (int i = 1; i <= kMostParts * common; ++i) steps.push_back(static_cast<double>(i) / common);
  } else if (block.value("filling", "shell") == "solid") {
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

Refilled refilled_block(Json block, const Organ& organ, double finer) {
  constexpr int kFewestCells = 2;
  for (Json& cells : block.at("cells")) {
    const auto count = whole(cells.get<double>() * finer, kFewestCells);
    if (!count) return std::nullopt;
    cells = *count;
  }
  block["spacing"] = shortest(organ.spacing / finer) + " m";
  const double spheres = static_cast<double>(organ.size()) * finer * finer * finer;  // about
  return std::pair{std::move(block), static_cast<std::size_t>(std::round(spheres))};
}

/// The measures that a liver has by its count and spacing, stated.
Json stated_shape(const Json& block, const Organ& organ, bool solid, const DocumentPlace& place) {
  Json stated = block.value("shape", Json::object());
  LiverShape shape = parse_shape(stated, place.key("shape"));
  if (!solid) {
    const auto outer =
        static_cast<std::size_t>(std::count(organ.layer.begin(), organ.layer.end(), 0));
    shape = scaled(shape, organ.spacing / even_spacing(liver_surface(shape), outer));
  }
  stated["width"] = shortest(shape.width) + " m";
  stated["height"] = shortest(shape.height) + " m";
  stated["depth"] = shortest(shape.depth) + " m";
  return stated;
}

}  // namespace

Refilled refilled_organ(const Json& block, const Organ& organ, double finer,
                        const DocumentPlace& place) {
  const OrganKind kind = find_entry(kKinds, block.at("kind").get<std::string>())->meaning;
  if (kind == OrganKind::star || kind == OrganKind::listed) {
    throw bad_input(place.key("kind").where, "spheres that are given one by one",
                    "a body that can be filled with more of them: liver, mesh or block");
  }
  if (kind == OrganKind::block) return refilled_block(block, organ, finer);
  const bool solid = is_solid(block, place);
  Json refilled = block;
  if (!solid) {
    const auto layers = whole(organ.layer_count() * finer, 1);
    if (!layers) return std::nullopt;
    refilled["layers"] = *layers;
  }
  const auto count = static_cast<std::size_t>(
      std::round(static_cast<double>(organ.size()) * finer * finer * finer));
  refilled["count"] = count;
  refilled.erase("spacing");
  if (kind == OrganKind::liver && !block.value("shape", Json::object()).contains("width")) {
    refilled["shape"] = stated_shape(block, organ, solid, place);
  }
  return std::pair{std::move(refilled), count};
}

std::size_t parse_sphere(const Json& number, const Organ& organ, const DocumentPlace& place) {
  const auto value = number.get<std::int64_t>();
  if (value >= 1 && static_cast<std::size_t>(value) <= organ.size()) {
    return static_cast<std::size_t>(value) - 1;
  }
  throw bad_input(place.where, fmt::format("no sphere {}", value),
                  fmt::format("1 to {}", organ.size()));
}

Eigen::Vector3d parse_point(const Json& list, const DocumentPlace& place) {
  Eigen::Vector3d point;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    point(i) = quantity_of(list.at(at), Dimension::length, place.key(std::to_string(at)).where);
  }
  return point;
}

OrganBlock parse_organ(const Json& block, const DocumentPlace& place, const fs::path& folder) {
  const auto& kind = *find_entry(kKinds, block.at("kind").get<std::string>());  // of the schema
  require_keys_of(block, kind, place);
  OrganBlock result;
  result.organ = organ_of(kind.meaning, block, place, folder);
  if (block.contains("contact")) {
    result.organ.contact = parse_sphere(block.at("contact"), result.organ, place.key("contact"));
  }
  require_valid(result.organ, place.where);
  result.star = kind.meaning == OrganKind::star;
  result.liver = kind.meaning == OrganKind::liver;
  return result;
}

}  // namespace tpm::organ
