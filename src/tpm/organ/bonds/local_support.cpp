#include "tpm/organ/bonds/local_support.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

using Eigen::Index;

constexpr double kRegularised = 1e-9;  // of the mean diagonal, against exact mechanisms
constexpr std::size_t kMostNamed = 10;

/// The 3x3 stiffness of each bond at rest, found from either end.
class BondsOfSpheres {
 public:
  BondsOfSpheres(const BondSystem& bonds, const Positions& rest)
      : bonds_(bonds), rest_(rest), of_(static_cast<std::size_t>(rest.cols())) {
    for (std::size_t i = 0; i < bonds.size(); ++i) {
      of_[bonds.end_a()[i]].push_back({i, bonds.end_b()[i]});
      of_[bonds.end_b()[i]].push_back({i, bonds.end_a()[i]});
    }
  }
  struct End {
    std::size_t bond, other;
  };
  [[nodiscard]] const std::vector<End>& of(std::size_t sphere) const { return of_[sphere]; }
  [[nodiscard]] Eigen::Matrix3d stiffness(std::size_t sphere, const End& end) const {
    const Eigen::Vector3d along =
        (rest_.col(static_cast<Index>(end.other)) - rest_.col(static_cast<Index>(sphere)))
            .normalized();
    return bonds_.stiffness()(static_cast<Index>(end.bond)) * along * along.transpose();
  }

 private:
  const BondSystem& bonds_;
  const Positions& rest_;
  std::vector<std::vector<End>> of_;
};

/// The stiffness of a sphere and its neighbours, all others fixed, on their free coordinates.
Eigen::MatrixXd patch_stiffness(const BondsOfSpheres& bonds, const Constraints& constraints,
                                const std::vector<std::size_t>& patch) {
  const auto n = static_cast<Index>(patch.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (Index i = 0; i < n; ++i) {
    const std::size_t sphere = patch[static_cast<std::size_t>(i)];
    const Eigen::Matrix3d& p = constraints.projector(sphere);
    for (const auto& end : bonds.of(sphere)) {
      const Eigen::Matrix3d block = bonds.stiffness(sphere, end);
      matrix.block<3, 3>(3 * i, 3 * i) += p * block * p;
      const Index j = std::find(patch.begin(), patch.end(), end.other) - patch.begin();
      if (j < n) {
        matrix.block<3, 3>(3 * i, 3 * j) -= p * block * constraints.projector(end.other);
      }
    }
  }
  const double scale = matrix.trace() / static_cast<double>(3 * n);
  for (Index i = 0; i < n; ++i) {
    const std::size_t sphere = patch[static_cast<std::size_t>(i)];
    matrix.block<3, 3>(3 * i, 3 * i) +=
        scale *
        (Eigen::Matrix3d::Identity() - (1.0 - kRegularised) * constraints.projector(sphere));
  }
  return matrix;
}

}  // namespace

std::vector<double> local_support(const BondSystem& bonds, const Organ& organ,
                                  const Constraints& constraints) {
  const BondsOfSpheres of(bonds, organ.position);
  std::vector<double> support(organ.size(), 1.0);
  for_each_in_parallel(organ.size(), [&](std::size_t i) {
    const Eigen::Vector3d normal = organ.normal.col(static_cast<Index>(i));
    const Eigen::Vector3d along = constraints.projector(i) * normal;
    if (along.norm() < 1e-6) return;
    std::vector<std::size_t> patch{i};
    for (const auto& end : of.of(i)) {
      if (std::find(patch.begin(), patch.end(), end.other) == patch.end()) {
        patch.push_back(end.other);
      }
    }
    const Eigen::MatrixXd matrix = patch_stiffness(of, constraints, patch);
    const double held = along.dot(matrix.topLeftCorner<3, 3>() * along);
    if (!(matrix.trace() > 0.0) || of.of(i).empty()) {
      support[i] = 0.0;
      return;
    }
    Eigen::VectorXd motion = Eigen::VectorXd::Zero(matrix.rows());
    motion.head<3>() = along;
    motion = solve_symmetric(matrix, motion);
    const double compliance = along.dot(motion.head<3>()) / std::pow(along.squaredNorm(), 2);
    support[i] = held > 0.0 ? 1.0 / (compliance * held) : 0.0;
  });
  return support;
}

std::vector<std::size_t> loose_spheres(const std::vector<double>& support) {
  std::vector<std::size_t> loose;
  for (std::size_t i = 0; i < support.size(); ++i) {
    if (support[i] < kLooseSupport) loose.push_back(i);
  }
  std::stable_sort(loose.begin(), loose.end(),
                   [&](std::size_t a, std::size_t b) { return support[a] < support[b]; });
  return loose;
}

std::string sphere_list(const std::vector<std::size_t>& spheres) {
  std::string list;
  const std::size_t named = std::min(spheres.size(), kMostNamed);
  for (std::size_t i = 0; i < named; ++i) {
    list += fmt::format("{}{}", i == 0 ? "" : ", ", spheres[i] + 1);
  }
  if (spheres.size() > named) list += fmt::format(" and {} more", spheres.size() - named);
  return fmt::format("sphere{} {}", spheres.size() == 1 ? "" : "s", list);
}

std::string sphere_list(const std::vector<std::size_t>& spheres, const Positions& position) {
  if (spheres.empty()) return sphere_list(spheres);
  const Eigen::Vector3d place = 1e3 * position.col(static_cast<Index>(spheres.front()));
  return fmt::format("{}{} at ({}, {}, {}) mm", sphere_list(spheres),
                     spheres.size() == 1 ? "" : ", the first", significant(place.x(), 4),
                     significant(place.y(), 4), significant(place.z(), 4));
}

void require_supported(const BondSystem& bonds, const Organ& organ, const Constraints& constraints,
                       std::string_view where) {
  const std::vector<double> support = local_support(bonds, organ, constraints);
  const std::vector<std::size_t> loose = loose_spheres(support);
  if (loose.empty()) return;
  const bool one = loose.size() == 1;
  throw bad_input(where,
                  fmt::format("nearly a mechanism: {} loose: {}, held by {} neighbours with "
                              "less than {} of {} bonds' stiffness (least {})",
                              one ? "1 sphere is" : fmt::format("{} spheres are", loose.size()),
                              sphere_list(loose, organ.position), one ? "its" : "their",
                              shortest(kLooseSupport), one ? "its" : "their",
                              significant(support[loose.front()], 2)),
                  "diagonal bonds between the layers, or a wider support");
}

}  // namespace tpm::organ
