#include "tpm/organ/body/liver_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/body/edge_table.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

constexpr int kSubdivisions = 5;
// Of the farthest reach: a bracket with one crossing, and the error of its estimate.
constexpr double kNearSurface = 1.0 / 256.0;
constexpr double kClose = 2e-12;
constexpr int kMostEstimates = 60;

struct Ellipsoid {
  Vector3d centre;
  Vector3d radii;  ///< half axes

  /// About the signed distance: exact on the surface, of the right slope there.
  [[nodiscard]] double value(const Vector3d& point) const {
    const Vector3d q = (point - centre).cwiseQuotient(radii);
    const double reach = q.norm();
    const double slope = q.cwiseQuotient(radii).norm();
    return slope > 0.0 ? reach * (reach - 1.0) / slope : -radii.minCoeff();
  }
};

/// The smaller of two values, rounded off twice differentiably where they differ by less than
/// `width` (the polynomial smooth minimum of I. Quilez).
double smooth_min(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6.0;
}

double smooth_max(double a, double b, double width) {
  return -smooth_min(-a, -b, width);
}

/// The shape as a function that is negative inside.
class LiverFunction {
 public:
  explicit LiverFunction(const LiverShape& s)
      : right_{{0.5 * s.width * (1.0 - s.right_share), 0.0, 0.0},
               0.5 * Vector3d(s.right_share * s.width, s.height, s.depth)},
        left_{Vector3d::Zero(), 0.5 * Vector3d((1.24 - s.right_share) * s.width,
                                               s.left_height * s.height, s.left_depth * s.depth)},
        lobes_(0.35 * s.height),
        groove_(0.2 * s.height),
        hollow_radius_(1.2 * s.height) {
    // The left lobe reaches to the left end, hangs a little below the dome, and lies in front.
    left_.centre = Vector3d(-0.5 * s.width + left_.radii.x(), 0.40 * s.height - left_.radii.y(),
                            -0.45 * s.depth + left_.radii.z());
    const Vector3d towards_bowel = Vector3d(-0.25, -0.72, 0.65).normalized();
    hollow_centre_ = 0.65 * right_.centre + 0.35 * left_.centre +
                     (hollow_radius_ + 0.75 * (0.5 - s.visceral_hollow) * s.height) * towards_bowel;
    notch_ = {{s.width * (0.5 - s.right_share), (s.notch_depth - 0.5) * s.height, -0.1 * s.depth},
              {s.notch_width * s.width, s.notch_depth * s.height, s.depth}};
  }

  [[nodiscard]] double operator()(const Vector3d& point) const {
    const double body = smooth_min(right_.value(point), left_.value(point), lobes_);
    const double ball = (point - hollow_centre_).norm() - hollow_radius_;
    return smooth_max(smooth_max(body, -ball, lobes_), -notch_.value(point), groove_);
  }

  /// A point from which all of the surface is seen.
  [[nodiscard]] Vector3d middle() const { return 0.7 * right_.centre + 0.3 * left_.centre; }

 private:
  Ellipsoid right_, left_, notch_{};
  double lobes_, groove_;  ///< widths of the blends, m
  double hollow_radius_;
  Vector3d hollow_centre_;
};

/// A unit sphere in triangles.
struct Sphere {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::size_t, 2>> ends;  ///< of the edge whose middle a vertex was, if any
  std::vector<std::size_t> rounds;               ///< how many vertices there were after each
  std::vector<Eigen::Vector3i> faces;
};

/// Every triangle cut into four at the middles of its edges.
std::vector<Eigen::Vector3i> quartered(const std::vector<Eigen::Vector3i>& faces, Sphere& sphere) {
  std::vector<Vector3d>& vertices = sphere.vertices;
  EdgeTable<int> halfway(vertices.size());
  const auto middle = [&](int from, int to) {
    const auto [number, fresh] = halfway.at(from, to, static_cast<int>(vertices.size()));
    if (fresh) {
      const auto a = static_cast<std::size_t>(from), b = static_cast<std::size_t>(to);
      vertices.push_back((vertices[a] + vertices[b]).normalized());
      sphere.ends.push_back({a, b});
    }
    return number;
  };
  std::vector<Eigen::Vector3i> finer;
  finer.reserve(4 * faces.size());
  for (const Eigen::Vector3i& f : faces) {
    const Eigen::Vector3i m(middle(f[0], f[1]), middle(f[1], f[2]), middle(f[2], f[0]));
    finer.emplace_back(f[0], m[0], m[2]);
    finer.emplace_back(f[1], m[1], m[0]);
    finer.emplace_back(f[2], m[2], m[1]);
    finer.push_back(m);
  }
  return finer;
}

/// An icosahedron whose triangles are cut into four, again and again.
Sphere icosphere(int subdivisions) {
  const double golden = (1.0 + std::sqrt(5.0)) / 2.0;
  Sphere sphere;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      Vector3d corner = Vector3d::Zero();
      corner[axis] = k < 2 ? 1.0 : -1.0;
      corner[(axis + 1) % 3] = k % 2 == 0 ? golden : -golden;
      sphere.vertices.push_back(corner.normalized());
    }
  }
  // The 20 triples of corners that are all one edge length apart, turned outwards.
  const double edge = 1.1 * 2.0 / std::sqrt(golden * golden + 1.0);
  const auto corner = [&](int v) -> const Vector3d& {
    return sphere.vertices[static_cast<std::size_t>(v)];
  };
  const auto near = [&](int a, int b) { return (corner(a) - corner(b)).norm() < edge; };
  for (int a = 0; a < 12; ++a) {
    for (int b = a + 1; b < 12; ++b) {
      for (int c = b + 1; c < 12; ++c) {
        if (!near(a, b) || !near(b, c) || !near(c, a)) continue;
        const bool outwards = corner(a).cross(corner(b)).dot(corner(c)) > 0.0;
        sphere.faces.emplace_back(a, outwards ? b : c, outwards ? c : b);
      }
    }
  }
  sphere.ends.resize(sphere.vertices.size());
  sphere.rounds.push_back(sphere.vertices.size());
  for (int round = 0; round < subdivisions; ++round) {
    sphere.faces = quartered(sphere.faces, sphere);
    sphere.rounds.push_back(sphere.vertices.size());
  }
  return sphere;
}

/// Two places on a ray from the middle, one inside the shape and one outside, m from the middle.
struct Bracket {
  double inside = 0.0, outside = 0.0;
  [[nodiscard]] double width() const { return outside - inside; }
  [[nodiscard]] double middle() const { return 0.5 * (inside + outside); }
};

/// About where a ray leaves the shape between two places: false position (Illinois).
/// @param value of the shape along the ray
template <class Value>
double estimated_reach(const Value& value, Bracket at, double precision) {
  double below = value(at.inside), above = value(at.outside), last = at.outside;
  bool was_inside = false, was_outside = false;
  for (int i = 0; i < kMostEstimates; ++i) {
    const double between = (at.inside * above - at.outside * below) / (above - below);
    if (std::abs(between - last) < precision) return between;
    last = between;
    const double here = value(between);
    if (here < 0.0) {
      at.inside = between;
      below = here;
      if (was_inside) above *= 0.5;
    } else {
      at.outside = between;
      above = here;
      if (was_outside) below *= 0.5;
    }
    was_inside = here < 0.0;
    was_outside = !was_inside;
  }
  return last;
}

/// Where a ray from the middle leaves the shape, by bisection. Where a narrow bracket is known the
/// shape is asked within it alone, which changes no answer and saves most of them.
/// @param about a guess, m from the middle; any will do
double reach_along(const LiverFunction& liver, const Vector3d& direction, double farthest,
                   double about) {
  const auto value = [&](double reach) { return liver(liver.middle() + reach * direction); };
  const auto is_within = [&](const Bracket& at) {
    return value(at.inside) < 0.0 && value(at.outside) >= 0.0;
  };
  Bracket at{0.0, farthest};
  const auto halve = [&](const Bracket& known) {
    const double between = at.middle();
    const bool is_inside =
        between <= known.inside || (between < known.outside && value(between) < 0.0);
    (is_inside ? at.inside : at.outside) = between;
  };
  Bracket known{about - kNearSurface * farthest, about + kNearSurface * farthest};
  if (!is_within(known)) {
    while (at.width() > kNearSurface * farthest) halve(at);
    known = at;
  }
  const double closer = estimated_reach(value, known, 0.1 * kClose * farthest);
  const Bracket narrow{closer - kClose * farthest, closer + kClose * farthest};
  if (is_within(narrow)) known = narrow;
  while (at.width() > 1e-12 * farthest) halve(known);
  return at.inside;
}

}  // namespace

const std::array<LiverMeasure, 9>& liver_measures() noexcept {
  static constexpr std::array<LiverMeasure, 9> kMeasures{{
      {"width", &LiverShape::width, 1e-6, 1e3, nullptr, "right to left"},
      {"height", &LiverShape::height, 0.5, 1.2, &LiverShape::width,
       "of the right lobe, top to bottom; 0.5 to 1.2 widths"},
      {"depth", &LiverShape::depth, 0.35, 0.9, &LiverShape::width,
       "of the right lobe, front to back; 0.35 to 0.9 widths"},
      {"right_share", &LiverShape::right_share, 0.5, 0.75, nullptr,
       "of the width that is right lobe"},
      {"left_height", &LiverShape::left_height, 0.4, 0.6, nullptr,
       "of the left lobe, in heights of the right one"},
      {"left_depth", &LiverShape::left_depth, 0.45, 0.8, nullptr,
       "of the left lobe, in depths of the right one"},
      {"notch_depth", &LiverShape::notch_depth, 0.1, 0.2, nullptr,
       "between the lobes, from below, in heights"},
      {"notch_width", &LiverShape::notch_width, 0.08, 0.14, nullptr,
       "half width of the notch, in widths"},
      {"visceral_hollow", &LiverShape::visceral_hollow, 0.0, 0.3, nullptr,
       "of the face towards the bowel, in heights"},
  }};
  return kMeasures;
}

void require_valid(const LiverShape& shape, std::string_view where) {
  for (const LiverMeasure& measure : liver_measures()) {
    const double unit = measure.unit == nullptr ? 1.0 : shape.*measure.unit;
    const double value = shape.*measure.value;
    const double slack = 1e-12 * unit;  // scaling a shape at the end of a range leaves it valid
    if (value >= measure.least * unit - slack && value <= measure.most * unit + slack) continue;
    throw bad_input(where, fmt::format("{} of the liver is {:.6g}", measure.name, value),
                    fmt::format("{:.6g} to {:.6g}", measure.least * unit, measure.most * unit));
  }
}

LiverShape scaled(LiverShape shape, double factor) {
  shape.width *= factor;
  shape.height *= factor;
  shape.depth *= factor;
  return shape;
}

TriangleMesh liver_mesh(const LiverShape& shape) {
  require_valid(shape, "liver");
  const LiverFunction liver(shape);
  const Sphere sphere = icosphere(kSubdivisions);
  const double farthest = shape.width + shape.height + shape.depth;
  std::vector<double> reach(sphere.vertices.size());
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(reach.size()));
  std::size_t begin = 0;
  for (const std::size_t end : sphere.rounds) {
    for_each_in_parallel(end - begin, [&](std::size_t i) {
      const std::size_t v = begin + i;
      const auto [a, b] = sphere.ends[v];
      const double about = begin == 0 ? 0.0 : 0.5 * (reach[a] + reach[b]);
      const Vector3d& direction = sphere.vertices[v];
      reach[v] = reach_along(liver, direction, farthest, about);
      mesh.vertices.col(static_cast<Eigen::Index>(v)) = liver.middle() + reach[v] * direction;
    });
    begin = end;
  }
  mesh.triangles.resize(3, static_cast<Eigen::Index>(sphere.faces.size()));
  for (std::size_t f = 0; f < sphere.faces.size(); ++f) {
    mesh.triangles.col(static_cast<Eigen::Index>(f)) = sphere.faces[f];
  }
  return mesh;
}

MeshSurface liver_surface(const LiverShape& shape) {
  return MeshSurface(liver_mesh(shape));
}

SurfacePoint front_of_right_lobe(const LiverShape& shape, const Surface& surface) {
  return surface.nearest({0.5 * shape.width * (1.0 - shape.right_share), 0.0, -0.5 * shape.depth});
}

}  // namespace tpm::organ
