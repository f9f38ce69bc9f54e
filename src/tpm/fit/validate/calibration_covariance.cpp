#include "tpm/fit/validate/calibration_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/fit/autoregressive.hpp"

namespace tpm::fit {
namespace {

/// Derivatives of the fitted samples of one recording.
struct FittedSlopes {
  std::vector<double> time_s;
  Eigen::MatrixXd by_law, by_placement;
};

FittedSlopes slopes_of(const LawFile& law, const PreparedRecording& recording,
                       const FittedFile& file, bool only_one, const RecordingParts& parts,
                       const ReadingScatter& scatter) {
  const Recording& r = recording.recording;
  const LawAlong along(law, recording);
  const auto& place = law.uncertainty->place;
  const std::size_t contact_place = law.values.size() - 2;
  const bool known = std::ranges::find(place, contact_place) != place.end();
  const bool fitted = !along.contact_of_law() && (only_one ? known : true);
  const double contact =
      along.contact_of_law() || only_one
          ? along.contact_in_law()
          : place_for_validation(along, recording, parts, scatter, PlacementRule::fitted, false)
                .contact;
  const LawAlong::At at = along.at(contact);
  std::vector<Eigen::Index> rows;
  FittedSlopes slopes;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (!file.holds(r.time_s[i]) || !std::isfinite(at.value[k])) continue;
    rows.push_back(k);
    slopes.time_s.push_back(r.time_s[i]);
  }
  slopes.by_law = at.by_law(rows, Eigen::all);
  slopes.by_placement.resize(static_cast<Eigen::Index>(rows.size()), fitted ? 2 : 1);
  slopes.by_placement.col(0).setOnes();
  if (fitted) slopes.by_placement.col(1) = at.by_contact(rows);
  return slopes;
}

}  // namespace

std::optional<LawFile> with_calibration_covariance(const LawFile& law,
                                                   std::span<const PreparedRecording> calibration) {
  const LawUncertainty& u = law.uncertainty.value();
  if (calibration.empty() || calibration.size() != u.data.size() || u.noise.kind != "absolute") {
    return std::nullopt;
  }
  std::vector<FittedSlopes> all;
  std::vector<ReadingScatter> scatters;
  Eigen::Index own = 0;
  double degrees = 0.0;
  for (std::size_t i = 0; i < calibration.size(); ++i) {
    const RecordingParts parts = parts_of(calibration[i]);
    scatters.push_back(scatter_of(calibration[i], parts));
    degrees += scatters.back().degrees;
    all.push_back(
        slopes_of(law, calibration[i], u.data[i], calibration.size() == 1, parts, scatters.back()));
    own += all.back().by_placement.cols();
  }
  const Eigen::Index p = all.front().by_law.cols();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(p + own, p + own), b = a;
  Eigen::Index place = p;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Index width = all[i].by_placement.cols();
    Eigen::MatrixXd j(all[i].by_law.rows(), p + width);
    j << all[i].by_law, all[i].by_placement;
    const Eigen::MatrixXd gram = j.transpose() * j;
    const Eigen::MatrixXd noisy = scatters[i].covariance(all[i].time_s, j);
    const auto add = [&](Eigen::MatrixXd& sum, const Eigen::MatrixXd& part) {
      sum.topLeftCorner(p, p) += part.topLeftCorner(p, p);
      sum.block(0, place, p, width) += part.topRightCorner(p, width);
      sum.block(place, 0, width, p) += part.bottomLeftCorner(width, p);
      sum.block(place, place, width, width) += part.bottomRightCorner(width, width);
    };
    add(a, gram);
    add(b, noisy);
    place += width;
  }
  // Columns of one size: coordinates differ by many orders of magnitude.
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::MatrixXd scaled = scale.asDiagonal() * a * scale.asDiagonal();
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * solve_symmetric(scaled, Eigen::MatrixXd::Identity(p + own, p + own)) *
      scale.asDiagonal();
  const Eigen::MatrixXd covariance = inverse * b * inverse;
  if (!covariance.allFinite()) return std::nullopt;
  LawFile result = law;
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    if (!belongs_to_recording(law.spec, parameters[u.place[i]])) {
      kept.push_back(static_cast<Eigen::Index>(i));
    }
  }
  result.uncertainty->covariance.setZero();
  result.uncertainty->covariance(kept, kept) =
      0.5 * (covariance + covariance.transpose()).topLeftCorner(p, p);
  result.uncertainty->degrees_of_freedom = degrees;
  return result;
}

}  // namespace tpm::fit
