#include "tpm/organ/body/simple_organs.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/organ/body/filling.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

double length_above_zero(double value, std::string_view what) {
  if (std::isfinite(value) && value > 0.0) return value;
  throw bad_input(what, fmt::format("{} m", value), "a length above 0");
}

void require_cells(int cells, std::string_view axis) {
  if (cells >= 1 && cells <= 1'000'000) return;
  throw bad_input("block", fmt::format("{} cells along {}", cells, axis), "1 to 1000000");
}

void set_normals(Organ& organ) {
  organ.normal = Eigen::Vector3d::UnitZ().replicate(1, organ.position.cols());
}

}  // namespace

Organ block(int nx, int ny, int nz, double spacing, Lattice lattice) {
  require_cells(nx, "x");
  require_cells(ny, "y");
  require_cells(nz, "z");
  const LatticePoints points(lattice, length_above_zero(spacing, "spacing of the block"));
  // A bcc or fcc cell holds two and four spheres, so the cells already bound the count from below.
  require_sphere_count(
      static_cast<std::size_t>(std::min((nx + 1.0) * (ny + 1.0) * (nz + 1.0), 1e9)));
  std::vector<Eigen::Vector3i> kept;
  for (int k = points.cell() * nz; k >= 0; --k) {
    for (int j = 0; j <= points.cell() * ny; ++j) {
      for (int i = 0; i <= points.cell() * nx; ++i) {
        if (points.holds(i, j, k)) kept.emplace_back(i, j, k);
      }
    }
  }
  require_sphere_count(kept.size());
  Organ organ;
  organ.name = fmt::format("{} block of {} x {} x {} cells", entry_of(kLatticeWords, lattice).text,
                           nx, ny, nz);
  organ.spacing = spacing;
  organ.radius = 0.5 * spacing;
  organ.position.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t s = 0; s < kept.size(); ++s) {
    organ.position.col(static_cast<Eigen::Index>(s)) = points.pitch() * kept[s].cast<double>();
    organ.layer.push_back(points.cell() * nz - kept[s].z());
  }
  set_normals(organ);
  return organ;
}

Organ star(double spacing, double length) {
  length_above_zero(spacing, "spacing of the star");
  length_above_zero(length, "length of the star's inter-layer bond");
  Organ organ;
  organ.name = "star of four spheres";
  organ.spacing = spacing;
  organ.radius = 0.5 * std::min(spacing, length);
  organ.position.setZero(3, 4);
  organ.position(0, 0) = -spacing;
  organ.position(0, 2) = spacing;
  organ.position(2, 3) = -length;
  organ.layer = {0, 0, 0, 1};
  organ.contact = 1;
  set_normals(organ);
  return organ;
}

}  // namespace tpm::organ
