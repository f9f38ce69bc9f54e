#include "tpm/organ/body/mesh_polygon.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tpm::organ {

namespace {

// The angles of a quadrilateral and the normal of a polygon are computed in single precision and
// in a fixed order of operations: which diagonal a nearly straight corner gets hangs on their last
// bit, and the triangles decide where the spheres of a scene stand.
MeshCorner corner_difference(const MeshCorner& a, const MeshCorner& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

float single_dot(const MeshCorner& a, const MeshCorner& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Of length 1; a vector without length stays.
MeshCorner unit_side(const MeshCorner& a) {
  const float length = std::sqrt(single_dot(a, a));
  if (length == 0.0F) return a;
  const float inverse = 1.0F / length;
  return {a[0] * inverse, a[1] * inverse, a[2] * inverse};
}

/// Its corners are apart from each other, and lie on a line as closed_mesh() sees it.
bool lies_on_a_line(const MeshCorner& a, const MeshCorner& b, const MeshCorner& c) {
  if (a == b || b == c || c == a) return false;  // vanishes when vertices are joined
  std::array<double, 3> u{};
  std::array<double, 3> v{};
  double longest = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    u[i] = static_cast<double>(b[i]) - static_cast<double>(a[i]);
    v[i] = static_cast<double>(c[i]) - static_cast<double>(a[i]);
  }
  for (const auto& side : {u, v, {v[0] - u[0], v[1] - u[1], v[2] - u[2]}}) {
    longest = std::max(longest, std::hypot(side[0], side[1], side[2]));
  }
  const double area = 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                       u[0] * v[1] - u[1] * v[0]);
  return area <= 1e-12 * longest * longest;
}

bool lies_on_a_line(std::span<const MeshCorner> corners, const PolygonTriangle& triangle) {
  const auto at = [&](std::size_t i) { return corners[static_cast<std::size_t>(triangle[i])]; };
  return lies_on_a_line(at(0), at(1), at(2));
}

bool all_have_area(std::span<const MeshCorner> corners,
                   const std::vector<PolygonTriangle>& triangles) {
  return std::none_of(triangles.begin(), triangles.end(),
                      [&](const auto& triangle) { return lies_on_a_line(corners, triangle); });
}

/// The corner that is seen from inside at more than half a turn, else the first.
int concave_corner(std::span<const MeshCorner> corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const MeshCorner left = unit_side(corner_difference(corners[(i + 3) % 4], corners[i]));
    const MeshCorner across = unit_side(corner_difference(corners[(i + 2) % 4], corners[i]));
    const MeshCorner right = unit_side(corner_difference(corners[(i + 1) % 4], corners[i]));
    const float angle = std::acos(single_dot(left, across)) + std::acos(single_dot(right, across));
    if (angle > std::numbers::pi_v<float>) return static_cast<int>(i);
  }
  return 0;
}

std::vector<PolygonTriangle> cut_quadrilateral(std::span<const MeshCorner> corners) {
  const auto from = [](int first) -> std::vector<PolygonTriangle> {
    const auto corner = [first](int further) { return (first + further) % 4; };
    return {{corner(0), corner(1), corner(2)}, {corner(0), corner(2), corner(3)}};
  };
  const int first = concave_corner(corners);
  std::vector<PolygonTriangle> triangles = from(first);
  if (all_have_area(corners, triangles)) return triangles;
  std::vector<PolygonTriangle> other = from((first + 1) % 4);
  return all_have_area(corners, other) ? other : triangles;
}

struct FlatPoint {
  float x = 0.0F, y = 0.0F;
  bool operator==(const FlatPoint&) const = default;
};

/// Seen along the axis nearest to the normal (Newell), from outside.
std::vector<FlatPoint> flattened(std::span<const MeshCorner> corners) {
  const std::size_t n = corners.size();
  MeshCorner normal{};
  for (std::size_t i = 0; i < n; ++i) {
    const MeshCorner& before = corners[i];
    const MeshCorner& here = corners[(i + 1) % n];
    const MeshCorner& after = corners[(i + 2) % n];
    normal[2] += here[0] * (after[1] - before[1]);
    normal[0] += here[1] * (after[2] - before[2]);
    normal[1] += here[2] * (after[0] - before[0]);
  }
  const auto size = [&normal](std::size_t axis) { return std::abs(normal[axis]); };
  std::size_t axis = 2;
  if (size(0) > size(1)) {
    if (size(0) > size(2)) axis = 0;
  } else if (size(1) > size(2)) {
    axis = 1;
  }
  std::size_t right = (axis + 1) % 3;
  std::size_t up = (axis + 2) % 3;
  if (normal[axis] < 0.0F) std::swap(right, up);
  std::vector<FlatPoint> points;
  points.reserve(n);
  for (const MeshCorner& corner : corners) points.push_back({corner[right], corner[up]});
  return points;
}

/// Twice the area of a triangle, above 0 for one that winds to the left.
double left_turn(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  return -(a.x * (static_cast<double>(c.y) - b.y) + b.x * (static_cast<double>(a.y) - c.y) +
           c.x * (static_cast<double>(b.y) - a.y));
}

/// Of barycentric coordinates. Products are formed in single precision, as above.
bool is_within_triangle(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c,
                        const FlatPoint& p) {
  const auto product = [](const FlatPoint& u, const FlatPoint& v) {
    return static_cast<double>(u.x * v.x + u.y * v.y);
  };
  const FlatPoint u{b.x - a.x, b.y - a.y};
  const FlatPoint v{c.x - a.x, c.y - a.y};
  const FlatPoint w{p.x - a.x, p.y - a.y};
  const double uu = product(u, u), vv = product(v, v), uv = product(u, v);
  const double uw = product(u, w), vw = product(v, w);
  const double denominator = uu * vv - uv * uv;
  if (denominator == 0.0) return false;
  const double inverse = 1.0 / denominator;
  const double along_u = (vv * uw - uv * vw) * inverse;
  const double along_v = (uu * vw - uv * uw) * inverse;
  return along_u > 0.0 && along_v > 0.0 && along_u + along_v < 1.0;
}

/// As is_within_triangle(), or on a side.
bool is_covered(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& p) {
  return left_turn(a, b, p) >= 0.0 && left_turn(b, c, p) >= 0.0 && left_turn(c, a, p) >= 0.0;
}

enum class Ears {
  any,       ///< also one whose corners lie on a line
  with_area  ///< and no other corner on its border
};

/// Cuts ears off until three corners are left.
class EarCutter {
 public:
  EarCutter(std::span<const MeshCorner> corners, const std::vector<FlatPoint>& points, Ears ears)
      : corners_(corners), points_(points), ears_(ears), is_cut_(corners.size(), false) {}

  std::vector<PolygonTriangle> cut() {
    const auto n = static_cast<int>(points_.size());
    std::vector<PolygonTriangle> triangles;
    int before = n - 1;
    int next = 0;
    for (int left = n; left > 3; --left) {
      int ear = next;
      for (int looked = 0;; before = ear, ear = next, ++looked) {
        if (looked > 2 * left) return {};
        next = following(ear);
        if (is_ear(before, ear, next)) break;
      }
      triangles.push_back({before, ear, next});
      is_cut_[static_cast<std::size_t>(ear)] = true;
    }
    const int first = following(n - 1);
    const int second = following(first);
    triangles.push_back({first, second, following(second)});
    return triangles;
  }

 private:
  [[nodiscard]] int following(int corner) const {
    do {
      corner = (corner + 1) % static_cast<int>(points_.size());
    } while (is_cut_[static_cast<std::size_t>(corner)]);
    return corner;
  }
  [[nodiscard]] bool is_ear(int before, int ear, int next) const {
    const auto at = [this](int corner) { return points_[static_cast<std::size_t>(corner)]; };
    const FlatPoint a = at(before), b = at(ear), c = at(next);
    if (left_turn(a, b, c) < 0.0) return false;
    if (ears_ == Ears::with_area && lies_on_a_line(corners_, {before, ear, next})) return false;
    return std::none_of(points_.begin(), points_.end(), [&](const FlatPoint& p) {
      if (p == a || p == b || p == c) return false;
      return ears_ == Ears::any ? is_within_triangle(a, b, c, p) : is_covered(a, b, c, p);
    });
  }

  std::span<const MeshCorner> corners_;
  const std::vector<FlatPoint>& points_;
  Ears ears_;
  std::vector<bool> is_cut_;
};

/// No two triangles in a row begin with the same corner.
void turn_first_corners(std::vector<PolygonTriangle>& triangles) {
  for (std::size_t t = 1; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    if (a == triangles[t - 1][0]) triangles[t] = {c, a, b};
  }
}

}  // namespace

std::vector<PolygonTriangle> cut_polygon(std::span<const MeshCorner> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  if (corners.size() == 4) return cut_quadrilateral(corners);
  const std::vector<FlatPoint> points = flattened(corners);
  std::vector<PolygonTriangle> triangles = EarCutter(corners, points, Ears::any).cut();
  if (triangles.empty() || !all_have_area(corners, triangles)) {
    std::vector<PolygonTriangle> better = EarCutter(corners, points, Ears::with_area).cut();
    if (!better.empty()) triangles = std::move(better);
  }
  turn_first_corners(triangles);
  return triangles;
}

}  // namespace tpm::organ
