// The component organ alone: two spheres, turned and moved, are as far apart as before.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <tpmkit/organ.hpp>

int main() {
  tpm::organ::Organ organ;
  organ.name = "pair";
  organ.position.resize(3, 2);
  organ.position << 0.0, 0.002, 0.0, 0.0, 0.0, 0.0;
  organ.normal = Eigen::Vector3d::UnitZ().replicate(1, 2);
  organ.layer = {0, 0};
  organ.radius = 0.001;
  organ.spacing = 0.002;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const tpm::organ::Organ there = tpm::organ::moved(organ, turn, {1.0, 2.0, 3.0});
  tpm::organ::require_valid(there, "consumer");
  const double mean = tpm::organ::nearest_distances(there).front().mean;
  std::printf("%.12f spacings\n", mean);
  return std::abs(mean - 1.0) < 1e-12 ? 0 : 1;
}
