#include "tpm/organ/balance/buckling.hpp"

#include <fmt/format.h>

#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"

namespace tpm::organ {

std::string buckling_place(Equilibrium& equilibrium, const Positions& position,
                           const ViscousState& viscous, Eigen::Index spheres) {
  constexpr int kIterations = 8;
  if (!equilibrium.choice().direct) return {};
  if (!equilibrium.factorise(position, viscous)) return {};
  Random random(1);
  Eigen::Matrix3Xd mode(3, position.cols());
  for (double& x : mode.reshaped()) x = random.normal();
  for (int i = 0; i < kIterations; ++i) {
    equilibrium.constraints().project(mode);
    const double size = mode.norm();
    if (!(size > 0.0)) return {};
    mode /= size;
    equilibrium.displace(mode);
  }
  if (!mode.allFinite()) return {};
  Eigen::Index most = 0;
  mode.leftCols(spheres).colwise().squaredNorm().maxCoeff(&most);
  const Eigen::Vector3d place = 1e3 * position.col(most);
  return fmt::format(" around sphere {} at ({}, {}, {}) mm", most + 1, significant(place.x(), 4),
                     significant(place.y(), 4), significant(place.z(), 4));
}

std::string buckling_words(DrivenTissue& tissue, const TissueState& state) {
  const auto spheres = static_cast<Eigen::Index>(tissue.bonds().without_tools().spheres());
  return fmt::format("buckles{}: its stiffness is no longer positive",
                     buckling_place(tissue.equilibrium(), state.position,
                                    {state.mean, 0.0, state.closed}, spheres));
}

}  // namespace tpm::organ
