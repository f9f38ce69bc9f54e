#include "tpm/fit/validate/calibration_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/validate/measured_placement_weights.hpp"

namespace tpm::fit {
namespace {

/// Derivatives of one recording by the law and by its own placement.
struct FittedSlopes {
  /// Of all samples: what each adds to the scores of law and placement, the derivatives of the
  /// fitted ones and, of a placement that was measured, its weight in what the fit took for it.
  Eigen::MatrixXd scores;
  /// J'J of the fitted samples; placement: zero, contact, drift, delays of rises, where they were
  /// fitted.
  Eigen::MatrixXd gram;
  /// Of each column of the placement, times the variance of an independent reading: 1/sd^2 that the
  /// fit weighed its prior by (0: no prior), and the variance of what was measured by readings that
  /// `scores` does not hold.
  Eigen::VectorXd prior, prior_variance;
  /// u of the scores where --contact-force held contact between two samples; else 0.
  Eigen::VectorXd by_contact;
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

/// u of a contact that --contact-force put between two samples: a rectangle of one step of the
/// drive.
double contact_u_by_threshold(const PreparedRecording& recording, double contact) {
  const std::size_t at = recording.phases.contact_index;
  if (at == 0 || !is_at_threshold(recording, contact)) return 0.0;
  const std::vector<double>& drive = recording.recording.drive;
  return std::abs(drive[at] - drive[at - 1]) / std::numbers::sqrt3;
}

double precision_of(const std::optional<Measured>& measured) {
  return measured && measured->sd > 0.0 ? 1.0 / (measured->sd * measured->sd) : 0.0;
}

/// @param of_independent variance of an independent reading, against which priors were weighed
FittedSlopes slopes_of(const LawFile& law, const PreparedRecording& recording,
                       const FittedFile& file, bool only_one, const RecordingParts& parts,
                       const ReadingScatter& scatter, double of_independent) {
  const Recording& r = recording.recording;
  const LawAlong along(law, recording, nullptr, {}, file.rises);
  const PlacementInFit in = placement_in(law, along, file, only_one, recording, parts, scatter);
  const bool by_threshold = is_at_threshold(recording, in.contact);
  const LawAlong::At at = along.at(in.contact);
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const bool fitted = file.holds(r.time_s[i]) && !file.clips(r.response[i]);
    if (fitted && std::isfinite(at.value[k])) rows.push_back(k);
  }
  MeasuredPlacement measured;
  const bool indents =
      law.spec.drive == Quantity::indentation_depth && law.spec.response == Quantity::contact_force;
  if (indents) measured = measure_placement(recording, law.spec, std::nullopt);
  const std::optional<Eigen::VectorXd> zero_weights = zero_by_reading(r, measured.rests);
  std::optional<Eigen::VectorXd> onset_weights;
  const std::optional<double> exponent = first_loading_exponent(law.spec, std::nullopt);
  if (exponent && zero_weights && !file.drift) {
    onset_weights = onset_by_reading(recording, measured.onset, *exponent,
                                     measured.rests.zero->value, *zero_weights);
  }
  struct Column {
    Eigen::VectorXd slope;  ///< of the fitted samples
    double precision = 0.0;
    std::optional<Eigen::VectorXd> weights;  ///< of what was measured
  };
  std::vector<Column> columns;
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (in.fits_zero) {
    columns.push_back({Eigen::VectorXd::Ones(n), precision_of(measured.rests.zero), zero_weights});
  }
  if (in.fits_contact && !by_threshold) {
    columns.push_back(
        {at.by_contact(rows), indents ? precision_of(measured.onset.drive) : 0.0, onset_weights});
  }
  if (file.drift) {
    const double origin_s = file.drift_origin_s.value_or(0.0);
    const auto time = Eigen::VectorXd::Map(r.time_s.data(), std::ssize(r.time_s));
    columns.push_back(
        {time(rows).array() - origin_s, precision_of(measured.rests.drift), std::nullopt});
  }
  const std::vector<UnseenRise> unseen = unseen_rises(recording);
  for (std::size_t k = 0; k < file.rises.size(); ++k) {
    const auto known = std::ranges::find(unseen, file.rises[k].begin_s, &UnseenRise::begin_s);
    columns.push_back({along.by_delay(k, in.contact)(rows),
                       known == unseen.end() ? 0.0 : std::pow(known->prior_sd_s(unseen.size()), -2),
                       std::nullopt});
  }
  const Eigen::Index p = at.by_law.cols(), width = std::ssize(columns);
  FittedSlopes slopes;
  slopes.prior = slopes.prior_variance = Eigen::VectorXd::Zero(width);
  Eigen::MatrixXd j(n, p + width);
  j.leftCols(p) = at.by_law(rows, Eigen::all);
  for (Eigen::Index k = 0; k < width; ++k)
    j.col(p + k) = columns[static_cast<std::size_t>(k)].slope;
  slopes.gram = j.transpose() * j;
  slopes.by_contact = Eigen::VectorXd::Zero(p + width);
  if (by_threshold && !along.contact_of_law()) {
    slopes.by_contact =
        contact_u_by_threshold(recording, in.contact) * (j.transpose() * at.by_contact(rows));
  }
  slopes.scores = Eigen::MatrixXd::Zero(std::ssize(r.time_s), p + width);
  slopes.scores(rows, Eigen::all) = j;
  for (Eigen::Index k = 0; k < width; ++k) {
    const Column& column = columns[static_cast<std::size_t>(k)];
    if (!(column.precision > 0.0)) continue;
    slopes.prior[k] = of_independent * column.precision;
    if (column.weights) {
      slopes.scores.col(p + k) += slopes.prior[k] * *column.weights;
    } else {
      slopes.prior_variance[k] = 1.0 / column.precision;
    }
  }
  return slopes;
}

}  // namespace

bool is_at_threshold(const PreparedRecording& recording, double contact) {
  constexpr double kHeld = 1e-5;  // of the travel; a fit to several holds it within 1e-6
  const double travel = recording.phases.peak_drive - recording.phases.contact_drive;
  return recording.contact_held &&
         std::abs(contact - recording.phases.contact_drive) <= kHeld * std::abs(travel);
}

std::optional<LawFile> with_calibration_covariance(const LawFile& law,
                                                   std::span<const PreparedRecording> calibration) {
  const LawUncertainty& u = law.uncertainty.value();
  if (calibration.empty() || calibration.size() != u.data.size() || u.noise.kind != "absolute") {
    return std::nullopt;
  }
  // Where the size of the noise is estimated, a prior weighs against the variance of an independent
  // reading (docs/theory.md).
  const double of_independent = u.noise.absolute * u.noise.absolute * u.readings_per_independent;
  std::vector<FittedSlopes> all;
  std::vector<ReadingScatter> scatters;
  Eigen::Index own = 0;
  double degrees = 0.0;
  for (std::size_t i = 0; i < calibration.size(); ++i) {
    const RecordingParts parts = parts_of(calibration[i]);
    scatters.push_back(scatter_of(calibration[i], parts));
    degrees += scatters.back().degrees;
    all.push_back(slopes_of(law, calibration[i], u.data[i], calibration.size() == 1, parts,
                            scatters.back(), of_independent));
    own += all.back().prior.size();
  }
  const Eigen::Index p = all.front().gram.cols() - all.front().prior.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(p + own, p + own), b = a;
  Eigen::Index place = p;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::Index width = all[i].prior.size();
    const Eigen::MatrixXd noisy =
        scatters[i].covariance(calibration[i].recording.time_s, all[i].scores);
    const auto add = [&](Eigen::MatrixXd& sum, const Eigen::MatrixXd& part) {
      sum.topLeftCorner(p, p) += part.topLeftCorner(p, p);
      sum.block(0, place, p, width) += part.topRightCorner(p, width);
      sum.block(place, 0, width, p) += part.bottomLeftCorner(width, p);
      sum.block(place, place, width, width) += part.bottomRightCorner(width, width);
    };
    add(a, all[i].gram);
    add(b, noisy);
    add(b, all[i].by_contact * all[i].by_contact.transpose());
    const Eigen::VectorXd& prior = all[i].prior;
    a.diagonal().segment(place, width) += prior;
    b.diagonal().segment(place, width) += prior.cwiseAbs2().cwiseProduct(all[i].prior_variance);
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
