#include "tpm/organ/balance/buckling.hpp"

#include <fmt/format.h>

#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"

namespace tpm::organ {
namespace {

std::string buckling_place(DrivenTissue& tissue, const TissueState& state) {
  constexpr int kIterations = 8;
  Equilibrium& equilibrium = tissue.equilibrium();
  if (!equilibrium.choice().direct) return {};
  if (!equilibrium.factorise(state.position, {state.mean, 0.0, state.closed})) return {};
  Random random(1);
  Eigen::Matrix3Xd mode(3, state.position.cols());
  for (double& x : mode.reshaped()) x = random.normal();
  for (int i = 0; i < kIterations; ++i) {
    tissue.constraints().project(mode);
    const double size = mode.norm();
    if (!(size > 0.0)) return {};
    mode /= size;
    equilibrium.displace(mode);
  }
  if (!mode.allFinite()) return {};
  const auto spheres = static_cast<Eigen::Index>(tissue.bonds().without_tools().spheres());
  Eigen::Index most = 0;
  mode.leftCols(spheres).colwise().squaredNorm().maxCoeff(&most);
  const Eigen::Vector3d place = 1e3 * state.position.col(most);
  return fmt::format(" around sphere {} at ({}, {}, {}) mm", most + 1, significant(place.x(), 4),
                     significant(place.y(), 4), significant(place.z(), 4));
}

}  // namespace

std::string buckling_words(DrivenTissue& tissue, const TissueState& state) {
  return fmt::format("buckles{}: its stiffness is no longer positive",
                     buckling_place(tissue, state));
}

}  // namespace tpm::organ
