#include "tpm/contact/condensed/condensed_fit.hpp"

#include <Eigen/LU>

#include "tpm/base/dense_algebra.hpp"

namespace tpm::contact {
namespace {

constexpr std::array<int, 3> kDegrees{4, 2, 0};  // in the depth, by degree in the tangents
constexpr int kTerms = CondensedMatrices::kTerms;

using Terms = Eigen::Matrix<double, kTerms, 1>;

Terms terms(const CondensedFrame& frame, const Eigen::Vector3d& w) {
  const double p = (w[0] - frame.middle_depth_m) / frame.half_depth_m;
  const double s = w[1] / frame.tangential_m;
  const double t = w[2] / frame.tangential_m;
  Terms result;
  Eigen::Index k = 0;
  const auto add = [&](double factor, int degree) {
    for (int n = 0; n <= degree; ++n, factor *= p) result[k++] = factor;
  };
  add(1.0, kDegrees[0]);
  add(s, kDegrees[1]);
  add(t, kDegrees[1]);
  add(s * s, kDegrees[2]);
  add(s * t, kDegrees[2]);
  add(t * t, kDegrees[2]);
  return result;
}

constexpr std::array<std::array<Eigen::Index, 2>, 6> kEntries{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

void put(const Eigen::Matrix3d& matrix, const CondensedFrame& frame,
         Eigen::Ref<Eigen::Matrix<double, 6, 1>> row) {
  const Eigen::Matrix3d local = frame.axes.transpose() * matrix * frame.axes;
  Eigen::Index k = 0;
  for (const auto& [i, j] : kEntries) row[k++] = 0.5 * (local(i, j) + local(j, i));
}

}  // namespace

CondensedMatrices::CondensedMatrices(const CondensedFrame& frame,
                                     std::span<const CondensedMetric> metrics) {
  const auto count = static_cast<Eigen::Index>(metrics.size());
  Eigen::MatrixXd rows(count, kTerms);
  Eigen::Matrix<double, 18, Eigen::Dynamic> values(18, count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const CondensedMetric& at = metrics[static_cast<std::size_t>(m)];
    rows.row(m) = terms(frame, frame.local(at.w_m));
    put(at.metric.inverse(), frame, values.col(m).segment<6>(0));
    put(at.second_metric, frame, values.col(m).segment<6>(6));
    put(at.second_energy, frame, values.col(m).segment<6>(12));
  }
  coefficients_ = least_squares(rows, values.transpose()).transpose();
}

}  // namespace tpm::contact
