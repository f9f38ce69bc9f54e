// Declared in tpm/organ/body/filling.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tpm/organ/body/filling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

constexpr double kLeastDepth = 0.7;  // of lattice points, in spacings: clear of the outer layer

/// The points of a lattice that lie deep enough inside a surface, row by row along x. The distance
/// to the surface changes by at most a step per step, so most of a row is decided without asking.
class DeepPoints {
 public:
  DeepPoints(const Surface& surface, Lattice lattice, double spacing)
      : surface_(surface),
        points_(lattice, spacing),
        least_(kLeastDepth * spacing),
        centre_(surface.bounds().center()) {
    const Vector3d half = 0.5 * surface.bounds().sizes() / points_.pitch();
    reach_ = half.array().ceil().cast<int>();
  }

  [[nodiscard]] std::size_t count() const {
    std::size_t found = 0;
    rows([&](const Vector3d&, std::size_t length) { found += length; });
    return found;
  }

  [[nodiscard]] Positions collect() const {
    std::vector<Vector3d> found;
    rows([&](const Vector3d& first, std::size_t length) {
      for (std::size_t s = 0; s < length; ++s) {
        found.emplace_back(first.x() + stride() * static_cast<double>(s), first.y(), first.z());
      }
    });
    Positions points(3, static_cast<Eigen::Index>(found.size()));
    for (std::size_t i = 0; i < found.size(); ++i) {
      points.col(static_cast<Eigen::Index>(i)) = found[i];
    }
    return points;
  }

 private:
  [[nodiscard]] double stride() const { return points_.cell() * points_.pitch(); }

  /// Calls visit(first point, length) for stretches of deep points.
  template <class Visit>
  void rows(Visit&& visit) const {
    for (int k = -reach_.z(); k <= reach_.z(); ++k) {
      for (int j = -reach_.y(); j <= reach_.y(); ++j) {
        int i = -reach_.x();
        if (!points_.holds(i, j, k) && !points_.holds(++i, j, k)) continue;  // an empty bcc row
        row(i, j, k, visit);
      }
    }
  }

  template <class Visit>
  void row(int first, int j, int k, Visit&& visit) const {
    const auto last = static_cast<std::size_t>((reach_.x() - first) / points_.cell());
    for (std::size_t s = 0; s <= last;) {
      const Vector3d point =
          centre_ +
          points_.pitch() * Vector3d(first + points_.cell() * static_cast<double>(s), j, k);
      const double margin = -surface_.signed_distance(point) - least_;
      const std::size_t alike =
          std::min(last + 1 - s, static_cast<std::size_t>(std::abs(margin) / stride()) + 1);
      // Rounding must not decide for a neighbour exactly a margin away.
      const std::size_t sure = alike > 1 ? alike - 1 : 1;
      if (margin >= 0.0) visit(point, sure);
      s += sure;
    }
  }

  const Surface& surface_;
  LatticePoints points_;
  double least_;
  Vector3d centre_;
  Eigen::Array3i reach_;
};

std::size_t total(const Surface& surface, Lattice lattice, double spacing) {
  return even_count(surface, spacing) + DeepPoints(surface, lattice, spacing).count();
}

/// About the largest spacing that gives at least `count` spheres: bisection, ended early where the
/// surplus is below a thousandth.
double spacing_for(const Surface& surface, Lattice lattice, std::size_t count) {
  const auto wanted = static_cast<double>(count);
  double too_far = 1.01 * even_spacing(surface, 1);
  double enough = std::min(0.5 * too_far, 1.2 * std::cbrt(surface.volume() / wanted));
  for (int round = 0; round < 60 && too_far / enough > 1.0 + 1e-6; ++round) {
    const std::size_t found = total(surface, lattice, enough);
    if (found >= count) {
      if (static_cast<double>(found - count) <= 1e-3 * wanted) return enough;
      break;
    }
    too_far = enough;
    enough *= 0.95;
  }
  for (int round = 0; round < 20 && too_far / enough > 1.0 + 1e-6; ++round) {
    const double between = std::sqrt(enough * too_far);
    const std::size_t found = total(surface, lattice, between);
    (found >= count ? enough : too_far) = between;
    if (found >= count && static_cast<double>(found - count) <= 1e-3 * wanted) break;
  }
  return enough;
}

/// A lattice point of the filling.
struct InnerSphere {
  Eigen::Index point = 0;
  Vector3d outwards;   ///< to the nearest point of the surface, m
  double depth = 0.0;  ///< m
  int layer = 0;
};

/// The deepest `keep` points, in the order of the lattice.
std::vector<InnerSphere> deepest(const Surface& surface, const Positions& points,
                                 std::size_t keep) {
  std::vector<InnerSphere> inner(static_cast<std::size_t>(points.cols()));
  for (std::size_t i = 0; i < inner.size(); ++i) {
    inner[i].point = static_cast<Eigen::Index>(i);
    const Vector3d point = points.col(inner[i].point);
    inner[i].outwards = surface.nearest(point).position - point;
    inner[i].depth = inner[i].outwards.norm();
  }
  std::sort(inner.begin(), inner.end(), [](const InnerSphere& a, const InnerSphere& b) {
    return std::tuple(-a.depth, a.point) < std::tuple(-b.depth, b.point);
  });
  inner.resize(std::min(keep, inner.size()));
  return inner;
}

/// Layers one spacing thick below the outer one, without gaps, sorted.
void set_layers(double spacing, std::vector<InnerSphere>& inner) {
  for (InnerSphere& sphere : inner) {
    sphere.layer = 1 + static_cast<int>((sphere.depth - kLeastDepth * spacing) / spacing + 1e-9);
  }
  std::sort(inner.begin(), inner.end(), [](const InnerSphere& a, const InnerSphere& b) {
    return std::tuple(a.layer, a.point) < std::tuple(b.layer, b.point);
  });
  int found = 0;
  int before = 0;
  for (InnerSphere& sphere : inner) {
    if (sphere.layer != before) ++found;
    before = sphere.layer;
    sphere.layer = found;
  }
}

double decided_spacing(const Surface& surface, const SolidRequest& request) {
  if (request.count.has_value() == request.spacing.has_value()) {
    throw bad_input("solid filling",
                    request.count ? "both a number of spheres and a spacing are given"
                                  : "neither a number of spheres nor a spacing is given",
                    "one of them");
  }
  if (request.count) {
    require_sphere_count(*request.count);
    return spacing_for(surface, request.lattice, *request.count);
  }
  if (!std::isfinite(*request.spacing) || !(*request.spacing > 0.0)) {
    throw bad_input("spacing", fmt::format("{} m", *request.spacing), "a length above 0");
  }
  // Before the lattice is walked: a slip in the unit would ask for billions of spheres.
  const double expected = surface.volume() / std::pow(*request.spacing, 3);
  if (expected > 2e6) {
    throw bad_input("spacing",
                    fmt::format("{} m gives about {:.3g} spheres", *request.spacing, expected),
                    "at most 1000000 spheres");
  }
  return *request.spacing;
}

void set_sphere(Organ& organ, Eigen::Index at, const Vector3d& position, const Vector3d& normal) {
  organ.position.col(at) = position;
  organ.normal.col(at) = normal;
}

}  // namespace

Organ fill_solid(const Surface& surface, const SolidRequest& request) {
  const double spacing = decided_spacing(surface, request);
  const Positions lattice = DeepPoints(surface, request.lattice, spacing).collect();
  std::size_t outer_count = even_count(surface, spacing);
  const std::size_t all = outer_count + static_cast<std::size_t>(lattice.cols());
  const std::size_t count = request.count.value_or(all);
  require_sphere_count(count);
  outer_count = std::min(outer_count, count);
  Organ organ;
  Positions outer = even_points(surface, outer_count, request.seed);
  std::vector<InnerSphere> inner = deepest(surface, lattice, count - outer_count);
  set_layers(spacing, inner);
  organ.position.resize(3, static_cast<Eigen::Index>(count));
  organ.normal.resize(3, static_cast<Eigen::Index>(count));
  outer = sorted_by_x(outer);
  Eigen::Index at = 0;
  for (; at < outer.cols(); ++at) {
    set_sphere(organ, at, outer.col(at), surface.nearest(outer.col(at)).normal);
    organ.layer.push_back(0);
  }
  for (const InnerSphere& sphere : inner) {
    set_sphere(organ, at++, lattice.col(sphere.point), sphere.outwards.normalized());
    organ.layer.push_back(sphere.layer);
  }
  round_to_nanometres(organ.position);
  organ.name = fmt::format("solid filling of {} spheres", count);
  organ.spacing = spacing;
  organ.radius = request.radius.value_or(0.5 * spacing);
  organ.assumptions.emplace_back("the centres of the outer layer lie on the surface");
  organ.assumptions.push_back(
      fmt::format("the inside is a lattice ({})", entry_of(kLatticeWords, request.lattice).text));
  require_valid(organ, organ.name);
  return organ;
}

}  // namespace tpm::organ
