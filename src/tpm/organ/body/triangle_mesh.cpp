#include "tpm/organ/body/triangle_mesh.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "tpm/organ/body/neighbours.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

constexpr double kWeld = 1e-7;    // of the diagonal of the bounding box
constexpr double kVolume = 1e-9;  // of the cube over the diagonal

std::string at(const Eigen::Vector3d& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x(), p.y(), p.z());
}

/// A triangle of the mesh as given: its number and its first corner.
struct Faces {
  std::string_view where;
  const TriangleMesh& mesh;
  std::vector<int> number;  ///< in the order given, from 1

  [[nodiscard]] std::string name(int triangle) const {
    return fmt::format("triangle {} at {}", number[static_cast<std::size_t>(triangle)],
                       at(mesh.corner(triangle, 0)));
  }
};

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int root(int element) {
    while (parent(element) != element) {
      parent(element) = parent(parent(element));
      element = parent(element);
    }
    return element;
  }
  /// The smaller root stays.
  void join(int a, int b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent(high) = low;
  }

 private:
  int& parent(int element) { return parent_[static_cast<std::size_t>(element)]; }
  std::vector<int> parent_;
};

/// For every vertex the first one at exactly its place, so that a fan of copies costs no pairs.
std::vector<int> exact_copies(const Positions& vertices) {
  std::vector<int> order(static_cast<std::size_t>(vertices.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int v) {
    return std::tuple(vertices(0, v), vertices(1, v), vertices(2, v));
  };
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::tuple(key(a), a) < std::tuple(key(b), b); });
  std::vector<int> first(order.size());
  int current = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key(order[i]) != key(order[i - 1])) current = order[i];
    first[static_cast<std::size_t>(order[i])] = current;
  }
  return first;
}

/// For every vertex its new number; `kept` receives the old numbers of those that stay.
std::vector<int> weld_map(const Positions& vertices, std::vector<int>& kept) {
  const std::vector<int> first = exact_copies(vertices);
  std::vector<int> distinct;
  for (std::size_t v = 0; v < first.size(); ++v) {
    if (first[v] == static_cast<int>(v)) distinct.push_back(static_cast<int>(v));
  }
  const Positions points = vertices(Eigen::all, distinct);
  const double diagonal = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  DisjointSets sets(distinct.size());
  if (diagonal > 0.0) {
    for (const NeighbourPair& pair : pairs_within(points, kWeld * diagonal)) {
      sets.join(static_cast<int>(pair.first), static_cast<int>(pair.second));
    }
  }
  std::vector<int> renamed(first.size(), -1);
  for (std::size_t d = 0; d < distinct.size(); ++d) {
    const auto own = static_cast<std::size_t>(distinct[d]);
    const int root = sets.root(static_cast<int>(d));
    if (root == static_cast<int>(d)) {
      renamed[own] = static_cast<int>(kept.size());
      kept.push_back(distinct[d]);
    } else {
      renamed[own] = renamed[static_cast<std::size_t>(distinct[static_cast<std::size_t>(root)])];
    }
  }
  std::vector<int> map(first.size());
  for (std::size_t v = 0; v < first.size(); ++v) {
    map[v] = renamed[static_cast<std::size_t>(first[v])];
  }
  return map;
}

/// Joined vertices; triangles with two corners in one place are gone. `number` receives what each
/// triangle was called.
TriangleMesh welded(const TriangleMesh& mesh, std::vector<int>& number) {
  std::vector<int> kept;
  const std::vector<int> map = weld_map(mesh.vertices, kept);
  TriangleMesh result;
  result.vertices = mesh.vertices(Eigen::all, kept);
  result.triangles.resize(3, mesh.triangles.cols());
  Eigen::Index count = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    const auto renamed = [&](Eigen::Index which) {
      return map[static_cast<std::size_t>(mesh.triangles(which, t))];
    };
    const Eigen::Vector3i corner(renamed(0), renamed(1), renamed(2));
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    result.triangles.col(count++) = corner;
    number.push_back(static_cast<int>(t) + 1);
  }
  result.triangles.conservativeResize(3, count);
  return result;
}

void require_triangles(const Faces& faces) {
  const TriangleMesh& mesh = faces.mesh;
  if (mesh.triangles.cols() < 4) {
    throw bad_input(faces.where, fmt::format("{} triangles with area", mesh.triangles.cols()),
                    "a closed surface, at least 4 triangles");
  }
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t) {
    const double longest = std::max({(mesh.corner(t, 1) - mesh.corner(t, 0)).norm(),
                                     (mesh.corner(t, 2) - mesh.corner(t, 1)).norm(),
                                     (mesh.corner(t, 0) - mesh.corner(t, 2)).norm()});
    if (mesh.area_vector(t).norm() <= 1e-12 * longest * longest) {
      throw bad_input(faces.where,
                      fmt::format("{} has no area: its corners lie on a line", faces.name(t)),
                      "triangles with area");
    }
  }
}

struct HalfEdge {
  int low = 0, high = 0;  ///< vertices
  int triangle = 0;
  bool forwards = false;  ///< runs from low to high
};

std::vector<HalfEdge> half_edges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t) {
    for (Eigen::Index which = 0; which < 3; ++which) {
      const int from = mesh.triangles(which, t);
      const int to = mesh.triangles((which + 1) % 3, t);
      edges.push_back({std::min(from, to), std::max(from, to), t, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

/// Every edge belongs to two triangles that run along it in opposite directions; all are connected.
void require_closed(const Faces& faces) {
  const TriangleMesh& mesh = faces.mesh;
  const std::vector<HalfEdge> edges = half_edges(mesh);
  DisjointSets pieces(static_cast<std::size_t>(mesh.triangles.cols()));
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t next = i + 1;
    while (next < edges.size() && edges[next].low == edges[i].low &&
           edges[next].high == edges[i].high) {
      ++next;
    }
    const auto edge = [&] {
      return fmt::format("the edge from {} to {}", at(mesh.vertices.col(edges[i].low)),
                         at(mesh.vertices.col(edges[i].high)));
    };
    if (next - i == 1) {
      throw bad_input(faces.where,
                      fmt::format("the surface is open: {} belongs only to {}", edge(),
                                  faces.name(edges[i].triangle)),
                      "a closed surface, two triangles at every edge");
    }
    if (next - i > 2) {
      throw bad_input(faces.where,
                      fmt::format("{} belongs to {} triangles, the first is {}", edge(), next - i,
                                  faces.name(edges[i].triangle)),
                      "two triangles at every edge");
    }
    if (edges[i].forwards == edges[i + 1].forwards) {
      throw bad_input(
          faces.where,
          fmt::format("{} and {} wind differently: both run the same way along {}",
                      faces.name(edges[i].triangle), faces.name(edges[i + 1].triangle), edge()),
          "all triangles counter-clockwise seen from outside");
    }
    pieces.join(edges[i].triangle, edges[i + 1].triangle);
    i = next;
  }
  for (int t = 0; t < static_cast<int>(mesh.triangles.cols()); ++t) {
    if (pieces.root(t) == 0) continue;
    throw bad_input(faces.where,
                    fmt::format("{} is not connected with {}", faces.name(t), faces.name(0)),
                    "one surface in one piece, without inner cavities");
  }
}

void require_volume(const Faces& faces) {
  const Positions& v = faces.mesh.vertices;
  const double diagonal = (v.rowwise().maxCoeff() - v.rowwise().minCoeff()).norm();
  const double volume = mesh_volume(faces.mesh);
  if (std::abs(volume) > kVolume * diagonal * diagonal * diagonal) return;
  throw bad_input(faces.where, fmt::format("the surface encloses {:.3g} m^3", volume),
                  "a surface that encloses a volume");
}

void require_no_crossing(const Faces& faces) {
  const Eigen::Vector2i pair = first_crossing(faces.mesh);
  if (pair[0] < 0) return;
  throw bad_input(
      faces.where,
      fmt::format("the surface cuts itself: {} meets {}", faces.name(pair[0]), faces.name(pair[1])),
      "a surface that does not cut or touch itself");
}

}  // namespace

Eigen::Vector3d TriangleMesh::area_vector(Eigen::Index triangle) const {
  const Eigen::Vector3d a = corner(triangle, 0);
  return 0.5 * (corner(triangle, 1) - a).cross(corner(triangle, 2) - a);
}

double mesh_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) area += mesh.area_vector(t).norm();
  return area;
}

double mesh_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.cols() == 0) return 0.0;
  // Measured from a vertex, so that a body far from the origin loses no digits.
  const Eigen::Vector3d origin = mesh.vertices.col(0);
  double volume = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    volume += mesh.area_vector(t).dot(mesh.corner(t, 0) - origin) / 3.0;
  }
  return volume;
}

ClosedMesh closed_mesh(const TriangleMesh& mesh, std::string_view where) {
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    if (mesh.vertices.col(v).allFinite()) continue;
    throw bad_input(where, fmt::format("vertex {} is not finite", v + 1), "finite coordinates");
  }
  if (mesh.triangles.cols() == 0) throw bad_input(where, "holds no triangles", "a closed surface");
  std::vector<int> number;
  ClosedMesh result;
  result.mesh = welded(mesh, number);
  const Faces faces{where, result.mesh, std::move(number)};
  require_triangles(faces);
  require_closed(faces);
  require_volume(faces);
  require_no_crossing(faces);
  const Eigen::Index dropped = mesh.triangles.cols() - result.mesh.triangles.cols();
  if (dropped > 0) {
    result.notes.push_back(
        {"triangles_dropped",
         fmt::format("{} triangles shrunk to a point or a line were dropped", dropped)});
  }
  if (mesh_volume(result.mesh) < 0.0) {
    result.mesh.triangles.row(1).swap(result.mesh.triangles.row(2));
    result.notes.push_back({"triangles_turned", "the triangles faced inwards and were turned"});
  }
  return result;
}

}  // namespace tpm::organ
