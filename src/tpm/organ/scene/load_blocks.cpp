#include "tpm/organ/scene/load_blocks.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/organ/body/outer_area.hpp"
#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr double kUsualDensity_kg_m3 = 1060.0;

std::string gravity_on(const LoadKeys& load, const Organ& organ, Eigen::Matrix3Xd& force_N) {
  Eigen::VectorXd mass_kg =
      sphere_masses_kg(organ, load.density_kg_m3.value_or(kUsualDensity_kg_m3));
  if (load.mass_kg) mass_kg.setConstant(*load.mass_kg / static_cast<double>(organ.size()));
  const Eigen::Vector3d down = vector_of(load.direction).stableNormalized();
  force_N += down * (load.acceleration_m_s2 * mass_kg).transpose();
  return fmt::format("gravity on {} kg: {} N", significant(mass_kg.sum(), 4),
                     significant(load.acceleration_m_s2 * mass_kg.sum(), 4));
}

std::vector<std::size_t> pressed(const LoadKeys& load, const Organ& organ,
                                 const DocumentPlace& place) {
  std::vector<std::size_t> found;
  if (load.spheres) {
    const DocumentPlace list = place.key("spheres");
    for (const std::size_t number : *load.spheres) {
      const DocumentPlace entry = list.key(std::to_string(found.size()));
      const std::size_t sphere = sphere_of(number, organ, entry);
      if (organ.layer[sphere] != 0) {
        throw bad_input(entry.where, fmt::format("sphere {} is not on the surface", number),
                        "spheres of the outer layer");
      }
      found.push_back(sphere);
    }
    return found;
  }
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] != 0) continue;
    const Eigen::Vector3d at = organ.position.col(static_cast<Eigen::Index>(i));
    if (load.centre && (at - vector_of(*load.centre)).norm() > *load.radius_m) continue;
    found.push_back(i);
  }
  if (found.empty()) {
    throw bad_input(place.where, "holds no sphere of the surface", "at least one sphere");
  }
  return found;
}

std::string pressure_on(const LoadKeys& load, const Organ& organ, const DocumentPlace& place,
                        Eigen::Matrix3Xd& force_N) {
  const Eigen::VectorXd area_m2 = outer_areas_m2(organ);
  const std::vector<std::size_t> spheres = pressed(load, organ, place);
  double sum_m2 = 0.0;
  Eigen::Vector3d sum_N = Eigen::Vector3d::Zero();
  for (const std::size_t sphere : spheres) {
    const auto i = static_cast<Eigen::Index>(sphere);
    const Eigen::Vector3d push = -load.pressure_Pa * area_m2[i] * organ.normal.col(i);
    force_N.col(i) += push;
    sum_m2 += area_m2[i];
    sum_N += push;
  }
  return fmt::format("pressure of {} Pa on {} spheres, {} cm^2: {} N in sum",
                     significant(load.pressure_Pa, 4), spheres.size(), significant(1e4 * sum_m2, 4),
                     significant(std::copysign(sum_N.norm(), load.pressure_Pa), 4));
}

}  // namespace

const Kinds<LoadKeys, LoadKind>& load_kinds() {
  using K = LoadKeys;
  static const Kinds<K, LoadKind> kinds(
      {.name = "load", .sentence = "a force that acts before anything is imposed, and all along"},
      &K::kind,
      {{LoadKind::gravity,
        "gravity",
        "the weight of every sphere",
        {required(key("direction", &K::direction, direction(), "downwards")),
         key("acceleration_m_per_s2", &K::acceleration_m_s2, number(kAboveZero), "of the fall"),
         with_default(key("density_kg_per_m3", &K::density_kg_m3, number(kAboveZero),
                          "of the spheres, whose volumes are counted; or mass_kg"),
                      kUsualDensity_kg_m3),
         key("mass_kg", &K::mass_kg, number(kAboveZero),
             "of the whole organ, the same for every sphere")}},
       {LoadKind::pressure,
        "pressure",
        "pressure on the surface: it keeps the direction that the surface has without loads",
        {required(key("pressure", &K::pressure_Pa, quantity(Dimension::stress, kAnyNumber),
                      "inwards if above 0")),
         key("centre", &K::centre, point_type(), "only the spheres within the radius of it"),
         key("radius", &K::radius_m, quantity(Dimension::length, kAboveZero), "of the region"),
         key("spheres", &K::spheres, list(sphere_type(), {.fewest = 1, .distinct = true}),
             "instead: these spheres of the outer layer")}}},
      {{"density_kg_per_m3 or mass_kg",
        [](const K& load) -> std::optional<Fault> {
          if (!load.density_kg_m3 || !load.mass_kg) return std::nullopt;
          return Fault{"", "says the mass twice"};
        }},
       {"centre and radius, or spheres, or none", [](const K& load) -> std::optional<Fault> {
          const bool ball = load.centre.has_value() && load.radius_m.has_value();
          const bool part = load.centre.has_value() != load.radius_m.has_value();
          if (!part && !(ball && load.spheres)) return std::nullopt;
          return Fault{"", "does not say one region"};
        }}});
  return kinds;
}

DeadLoads loads_of(const std::vector<LoadKeys>& loads, const Organ& organ,
                   const DocumentPlace& place) {
  DeadLoads dead;
  if (loads.empty()) return dead;
  dead.force_N.setZero(3, organ.position.cols());
  for (const LoadKeys& load : loads) {
    const DocumentPlace entry = place.key(std::to_string(dead.words.size()));
    dead.words.push_back(load.kind == LoadKind::gravity
                             ? gravity_on(load, organ, dead.force_N)
                             : pressure_on(load, organ, entry, dead.force_N));
  }
  return dead;
}

}  // namespace tpm::organ
