// Prints the measured numbers of reports/networks/report.md: build/release/tests/measure_organ
#include <fmt/format.h>

#include <chrono>

#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/liver.hpp"

using namespace tpm;
using namespace tpm::organ;

namespace {

void print_organ(const Organ& organ, double seconds) {
  fmt::print("{}, spacing {:.4g} mm, {:.2f} s\n", organ.name, organ.spacing * 1e3, seconds);
  const auto layers = nearest_distances(organ);
  const std::size_t shown = std::min<std::size_t>(layers.size(), 4);
  for (std::size_t k = 0; k < shown; ++k) {
    fmt::print("  layer {}: {} spheres, nearest other sphere {:.3f} / {:.3f} / {:.3f} spacings\n",
               k, layers[k].spheres, layers[k].min, layers[k].mean, layers[k].max);
  }
  if (layers.size() > shown) fmt::print("  and {} more layers\n", layers.size() - shown);
}

template <class Fill>
Organ timed(Fill&& fill) {
  const auto start = std::chrono::steady_clock::now();
  Organ organ = fill();
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  print_organ(organ, taken.count());
  return organ;
}

/// How far the spheres of the inner layer lie from the ends of straight columns.
void print_columns(const Organ& organ) {
  const Eigen::Index n = organ.position.cols() / 2;
  int straight = 0;
  int near = 0;
  double most = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double off =
        (organ.position.col(i) - organ.spacing * organ.normal.col(i) - organ.position.col(n + i))
            .norm();
    straight += off < 1e-6 ? 1 : 0;
    near += off < 0.25 * organ.spacing ? 1 : 0;
    most = std::max(most, off);
  }
  fmt::print(
      "  of {} columns {} are straight, {} within a quarter of a spacing, the worst is {:.1f} mm "
      "off\n",
      n, straight, near, most * 1e3);
}

Organ liver_of(std::size_t count, int layers) {
  LiverRequest request;
  request.count = count;
  request.layers = layers;
  return fill_liver(request);
}

}  // namespace

int main() {
  const LiverShape shape;
  const double unscaled = even_spacing(liver_surface(shape), 212);
  const MeshSurface surface = liver_surface(scaled(shape, 0.020 / unscaled));
  const Eigen::Vector3d size = surface.bounds().sizes() * 1e3;
  fmt::print("liver of the paper: area {:.4f} m^2, volume {:.3f} l, {:.0f} x {:.0f} x {:.0f} mm\n",
             surface.area(), surface.volume() * 1e3, size.x(), size.y(), size.z());
  print_columns(timed(paper_liver));
  for (const int layers : {1, 3}) timed([&] { return liver_of(424, layers); });
  for (const int layers : {1, 2, 3}) timed([&] { return liver_of(4001, layers); });
  timed([] { return liver_of(400'000, 2); });
  for (const std::size_t count : {424U, 4001U, 400'000U, 1'000'000U}) {
    SolidRequest request;
    request.count = count;
    timed([&] { return fill_solid(surface, request); });
  }
  return 0;
}
