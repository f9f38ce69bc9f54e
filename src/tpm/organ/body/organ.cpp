#include "tpmkit/organ.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/organ/body/neighbours.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

std::string sphere_name(std::size_t index) {
  return fmt::format("sphere {}", index + 1);
}

std::string place(const Eigen::Vector3d& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x(), p.y(), p.z());
}

void require_sizes(const Organ& organ, std::string_view where) {
  const auto n = organ.position.cols();
  if (n == 0) throw bad_input(where, "the organ has no spheres", "at least 1");
  if (organ.normal.cols() != n || organ.layer.size() != organ.size()) {
    throw bad_input(where,
                    fmt::format("{} positions, {} normals and {} layers", n, organ.normal.cols(),
                                organ.layer.size()),
                    "one of each for every sphere");
  }
  const auto above_zero = [where](double value, std::string_view what) {
    if (std::isfinite(value) && value > 0.0) return;
    throw bad_input(where, fmt::format("{} is {} m", what, value), "a length above 0");
  };
  above_zero(organ.radius, "the radius of the spheres");
  above_zero(organ.spacing, "the spacing of the spheres");
  if (organ.contact && *organ.contact >= organ.size()) {
    throw bad_input(where, fmt::format("the contact is {}", sphere_name(*organ.contact)),
                    fmt::format("one of 1 to {}", organ.size()));
  }
}

void require_spheres(const Organ& organ, std::string_view where) {
  for (std::size_t i = 0; i < organ.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    if (!organ.position.col(column).allFinite()) {
      throw bad_input(where, fmt::format("{} has a coordinate that is not finite", sphere_name(i)),
                      "three finite coordinates");
    }
    const double length = organ.normal.col(column).norm();
    if (!(std::abs(length - 1.0) <= 1e-9)) {
      throw bad_input(where, fmt::format("the normal of {} has length {}", sphere_name(i), length),
                      "a unit vector");
    }
    if (organ.layer[i] < 0) {
      throw bad_input(where, fmt::format("{} lies in layer {}", sphere_name(i), organ.layer[i]),
                      "0 (outermost) or above");
    }
  }
}

void require_filled_layers(const Organ& organ, std::string_view where) {
  std::vector<int> found = organ.layer;
  std::sort(found.begin(), found.end());
  int expected = 0;
  for (const int layer : found) {
    if (layer > expected) {
      throw bad_input(where, fmt::format("layer {} has no spheres", expected),
                      fmt::format("spheres in every layer from 0 to {}", found.back()));
    }
    expected = layer + 1;
  }
}

}  // namespace

int Organ::layer_count() const {
  return layer.empty() ? 0 : *std::max_element(layer.begin(), layer.end()) + 1;
}

void require_valid(const Organ& organ, std::string_view where) {
  require_sizes(organ, where);
  require_spheres(organ, where);
  require_filled_layers(organ, where);
  if (organ.size() < 2) return;
  const std::vector<double> nearest = distances_to_nearest(organ.position);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] > 0.0) continue;
    throw bad_input(where,
                    fmt::format("{} lies where another sphere lies, at {}", sphere_name(i),
                                place(organ.position.col(static_cast<Eigen::Index>(i)))),
                    "every sphere at a place of its own");
  }
}

Organ moved(Organ organ, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& shift) {
  organ.position = (rotation * organ.position).colwise() + shift;
  organ.normal = rotation * organ.normal;
  return organ;
}

std::vector<NearestDistances> nearest_distances(const Organ& organ) {
  NearestDistances none;
  none.min = std::numeric_limits<double>::infinity();
  std::vector<NearestDistances> layers(static_cast<std::size_t>(organ.layer_count()), none);
  const std::vector<double> nearest = distances_to_nearest(organ.position);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    NearestDistances& layer = layers[static_cast<std::size_t>(organ.layer[i])];
    const double distance = nearest[i] / organ.spacing;
    ++layer.spheres;
    layer.min = std::min(layer.min, distance);
    layer.mean += distance;
    layer.max = std::max(layer.max, distance);
  }
  for (NearestDistances& layer : layers) layer.mean /= static_cast<double>(layer.spheres);
  return layers;
}

}  // namespace tpm::organ
