#include "tpm/organ/body/liver.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/organ/body/filling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

constexpr std::size_t kContactNumber = 71;  // printed in the paper, as the coordinates are

Vector3d printed_place() {
  return {0.002, 0.136, 0.057};
}

struct SizedLiver {
  LiverShape shape;
  MeshSurface surface;
};

/// The liver at the size that count and spacing ask for.
SizedLiver sized(const LiverRequest& request) {
  TriangleMesh mesh = liver_mesh(request.shape);
  if (!request.spacing) return {request.shape, MeshSurface(std::move(mesh))};
  if (!std::isfinite(*request.spacing) || !(*request.spacing > 0.0)) {
    throw bad_input("spacing", fmt::format("{} m", *request.spacing), "a length above 0");
  }
  require_sphere_count(request.count);
  const auto layers = static_cast<std::size_t>(std::clamp(request.layers, 1, 100));
  const std::size_t outer = (request.count + layers - 1) / layers;
  const double factor = *request.spacing / even_spacing(mesh_area(mesh), outer);
  const LiverShape shape = scaled(request.shape, factor);
  require_valid(shape, "liver");
  mesh.vertices *= factor;
  return {shape, MeshSurface(std::move(mesh))};
}

/// The organ with the first `full` spheres of every layer moved on by `shift` numbers, cyclically.
Organ wrapped(const Organ& organ, std::size_t full, std::size_t shift) {
  std::vector<Eigen::Index> order(organ.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t first = 0; first < order.size();) {
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(first);
    std::rotate(begin, begin + static_cast<std::ptrdiff_t>(full - shift % full),
                begin + static_cast<std::ptrdiff_t>(full));
    const int layer = organ.layer[first];
    while (first < order.size() && organ.layer[first] == layer) ++first;
  }
  Organ result = organ;
  result.position = organ.position(Eigen::all, order);
  result.normal = organ.normal(Eigen::all, order);
  return result;
}

/// Turned and shifted so that the contact has the printed coordinates and looks against the probe.
Organ placed(const Organ& organ, std::size_t contact) {
  const auto column = static_cast<Eigen::Index>(contact);
  const Vector3d towards_probe = -Vector3d::UnitZ();
  const Eigen::Matrix3d turn = turn_onto(organ.normal.col(column), towards_probe);
  Organ result = moved(organ, turn, printed_place() - turn * organ.position.col(column));
  round_to_nanometres(result.position);
  result.normal.colwise().normalize();
  result.position.col(column) = printed_place();  // to the last bit
  result.normal.col(column) = towards_probe;
  result.contact = contact;
  return result;
}

}  // namespace

Organ fill_liver(const LiverRequest& request) {
  const auto [shape, surface] = sized(request);
  ShellRequest shell;
  shell.count = request.count;
  shell.layers = request.layers;
  shell.spacing = request.spacing;
  shell.seed = request.seed;
  shell.landing = front_of_right_lobe(shape, surface).position;
  Organ organ = fill_shell(surface, shell);
  const std::size_t full = organ.size() / static_cast<std::size_t>(request.layers);
  const std::size_t contact = std::min(kContactNumber, full) - 1;
  organ = placed(wrapped(organ, full, full + contact - *organ.contact), contact);
  organ.name = fmt::format("liver of {} spheres in {} layers", organ.size(), request.layers);
  organ.assumptions.insert(
      organ.assumptions.begin(),
      {{"coordinates_in_metres", "the printed coordinates of sphere 71 are metres"},
       {"shape_in_few_measures", "the shape is a liver's in a few measures"},
       {"contact_on_right_lobe",
        "sphere 71 lies on the front of the right lobe and is loaded along its inward normal"}});
  require_valid(organ, organ.name);
  return organ;
}

Organ paper_liver() {
  return fill_liver({});
}

}  // namespace tpm::organ
