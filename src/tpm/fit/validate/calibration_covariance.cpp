#include "tpm/fit/validate/calibration_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/select/placement.hpp"

namespace tpm::fit {
namespace {

/// Derivatives of the fitted samples of one recording, and what was measured of its placement.
struct FittedSlopes {
  std::vector<double> time_s;
  Eigen::MatrixXd by_law,
      by_placement;                 ///< placement: zero, contact, drift, where they were fitted
  Eigen::VectorXd prior_precision;  ///< 1/sd^2 of each column of by_placement; 0: no prior
};

/// Contact and zero of a recording in the fit, and which were estimated.
struct PlacementInFit {
  double contact = 0.0;
  bool fits_contact = false, fits_zero = false;
};

PlacementInFit placement_in(const LawFile& law, const LawAlong& along, const FittedFile& file,
                            bool only_one, const PreparedRecording& recording,
                            const RecordingParts& parts, const ReadingScatter& scatter) {
  PlacementInFit in;
  const auto& place = law.uncertainty->place;
  const auto estimated = [&](std::size_t parameter, const char* name) {
    return only_one ? std::ranges::find(place, parameter) != place.end()
                    : std::ranges::find(file.held, name) == file.held.end();
  };
  in.fits_zero = estimated(law.values.size() - 1, "offset");
  in.fits_contact = !along.contact_of_law() && estimated(law.values.size() - 2, "contact");
  if (along.contact_of_law() || only_one) {
    in.contact = along.contact_in_law();
  } else if (file.contact) {
    in.contact = *file.contact;
  } else {  // written before law files stated it
    in.contact = place_for_validation(along, recording, parts, scatter, PlacementRule::fitted,
                                      KnownPlacement::nothing)
                     .contact;
  }
  return in;
}

double precision_of(const std::optional<Measured>& measured) {
  return measured && measured->sd > 0.0 ? 1.0 / (measured->sd * measured->sd) : 0.0;
}

FittedSlopes slopes_of(const LawFile& law, const PreparedRecording& recording,
                       const FittedFile& file, bool only_one, const RecordingParts& parts,
                       const ReadingScatter& scatter) {
  const Recording& r = recording.recording;
  const LawAlong along(law, recording);
  const PlacementInFit in = placement_in(law, along, file, only_one, recording, parts, scatter);
  const LawAlong::At at = along.at(in.contact);
  std::vector<Eigen::Index> rows;
  FittedSlopes slopes;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (!file.holds(r.time_s[i]) || !std::isfinite(at.value[k])) continue;
    rows.push_back(k);
    slopes.time_s.push_back(r.time_s[i]);
  }
  slopes.by_law = at.by_law(rows, Eigen::all);
  MeasuredPlacement measured;
  const bool indents =
      law.spec.drive == Quantity::indentation_depth && law.spec.response == Quantity::contact_force;
  if (indents) measured = measure_placement(recording, law.spec, std::nullopt);
  const auto n = static_cast<Eigen::Index>(rows.size());
  std::vector<Eigen::VectorXd> columns;
  std::vector<double> precision;
  if (in.fits_zero) {
    columns.emplace_back(Eigen::VectorXd::Ones(n));
    precision.push_back(precision_of(measured.rests.zero));
  }
  if (in.fits_contact) {
    columns.emplace_back(at.by_contact(rows));
    precision.push_back(indents ? precision_of(measured.onset.drive) : 0.0);
  }
  if (file.drift) {
    const double origin_s = file.drift_origin_s.value_or(0.0);
    columns.emplace_back(Eigen::VectorXd::Map(slopes.time_s.data(), n).array() - origin_s);
    precision.push_back(precision_of(measured.rests.drift));
  }
  slopes.by_placement.resize(n, static_cast<Eigen::Index>(columns.size()));
  slopes.prior_precision =
      Eigen::VectorXd::Map(precision.data(), static_cast<Eigen::Index>(precision.size()));
  for (Eigen::Index k = 0; k < slopes.by_placement.cols(); ++k) {
    slopes.by_placement.col(k) = columns[static_cast<std::size_t>(k)];
  }
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
  // Where the size of the noise is estimated, a prior weighs against the variance of an independent
  // reading (docs/theory.md).
  const double of_independent = u.noise.absolute * u.noise.absolute * u.readings_per_independent;
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
    const Eigen::VectorXd prior = of_independent * all[i].prior_precision;
    a.diagonal().segment(place, width) += prior;
    b.diagonal().segment(place, width) += of_independent * prior;
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
