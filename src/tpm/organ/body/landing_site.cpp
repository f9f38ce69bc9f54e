#include "tpm/organ/body/landing_site.hpp"

#include <cmath>
#include <vector>

namespace tpm::organ {

namespace {

constexpr double kMostMoved = 0.25;  // spacings
/// Cosine of the angle between the normals of a sphere and of the contact up to which the sphere
/// lies on another face: the edge or the far side of a thin body.
constexpr double kOtherFace = 1e-6;

}  // namespace

LandingSite flatten_landing_site(const Surface& surface, Positions& outer, std::size_t sphere,
                                 double spacing) {
  const auto contact = static_cast<Eigen::Index>(sphere);
  LandingSite site;
  site.normal = surface.nearest(outer.col(contact)).normal;
  const Eigen::Matrix3Xd from_contact = outer.colwise() - outer.col(contact).eval();
  const Eigen::RowVectorXd height = site.normal.transpose() * from_contact;
  std::vector<Eigen::Index> members;
  double mean = 0.0;
  for (Eigen::Index i = 0; i < outer.cols(); ++i) {
    const bool beside =
        from_contact.col(i).norm() <= 2.0 * kLandingReach * spacing &&  // not the far side
        (from_contact.col(i) - height(i) * site.normal).norm() <= kLandingReach * spacing;
    if (!beside || surface.nearest(outer.col(i)).normal.dot(site.normal) <= kOtherFace) continue;
    members.push_back(i);
    mean += height(i);
  }
  mean /= static_cast<double>(members.size());
  for (const Eigen::Index i : members) {
    if (std::abs(mean - height(i)) > kMostMoved * spacing) return site;
  }
  for (const Eigen::Index i : members) outer.col(i) += (mean - height(i)) * site.normal;
  site.flat = true;
  return site;
}

}  // namespace tpm::organ
