#include "tpm/fit/validate/measured_placement_weights.hpp"

#include <cmath>
#include <vector>

#include "tpm/base/dense_algebra.hpp"

namespace tpm::fit {

std::optional<Eigen::VectorXd> zero_by_reading(const Recording& recording,
                                               const RestReadings& rests) {
  if (!rests.zero || rests.before == 0 || rests.after > 0) return std::nullopt;
  const auto all = static_cast<Eigen::Index>(recording.response.size());
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(all);
  weights.head(static_cast<Eigen::Index>(rests.before))
      .setConstant(1.0 / static_cast<double>(rests.before));
  return weights;
}

std::optional<Eigen::VectorXd> onset_by_reading(const PreparedRecording& recording,
                                                const Onset& onset, double exponent, double zero,
                                                const Eigen::VectorXd& zero_weights) {
  if (!onset.from_rest || onset.samples == 0) return std::nullopt;
  const Recording& r = recording.recording;
  const double contact = onset.drive.value;
  const double length = onset.part * (recording.phases.peak_drive - recording.phases.contact_drive);
  std::vector<Eigen::Index> rows;
  std::vector<double> places;
  for (std::size_t i = 0; i < r.drive.size(); ++i) {
    const double x = (r.drive[i] - contact) / length;
    if (x > 1.0) break;  // the first loading has passed
    if (!(x > 0.0)) continue;
    rows.push_back(static_cast<Eigen::Index>(i));
    places.push_back(x);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  constexpr Eigen::Index kFewest = 4;
  if (n < kFewest) return std::nullopt;
  const auto x = Eigen::VectorXd::Map(places.data(), n).array();
  Eigen::MatrixXd loading(n, 2);
  loading << x.pow(exponent), x.pow(exponent + 1.0);
  const Eigen::VectorXd y =
      Eigen::VectorXd::Map(r.response.data(), std::ssize(r.response))(rows).array() - zero;
  const Eigen::VectorXd size =
      solve_symmetric(loading.transpose() * loading, Eigen::MatrixXd(loading.transpose() * y));
  Eigen::MatrixXd by(n, 3);
  by.col(0) =
      -(exponent * size[0] * x.pow(exponent - 1.0) + (exponent + 1.0) * size[1] * x.pow(exponent)) /
      length;
  by.rightCols(2) = loading;
  const Eigen::RowVectorXd scale = by.colwise().norm().cwiseInverse();
  by = by * scale.asDiagonal();
  const Eigen::MatrixXd pseudo = solve_symmetric(by.transpose() * by, by.transpose());
  const Eigen::VectorXd own = scale[0] * pseudo.row(0).transpose();
  if (!own.allFinite()) return std::nullopt;
  Eigen::VectorXd weights = -own.sum() * zero_weights;
  weights(rows) += own;
  return weights;
}

}  // namespace tpm::fit
