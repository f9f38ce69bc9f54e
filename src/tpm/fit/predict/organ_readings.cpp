#include "tpm/fit/predict/organ_readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "tpm/fit/predict/organ_profile.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpm/work/give_up.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kContactDifference = 1e-3;  // of the largest depth
constexpr double kReadingsLevel = 0.95;

struct PressRange {
  double depth_m = 0.0, peak_N = 0.0;
};

PressRange press_range(const OrganReadings& r) {
  PressRange range;
  for (const Knot& knot : r.drive.knots()) {
    range.depth_m = std::max(range.depth_m, knot.value - r.contact_m);
  }
  for (const double f : r.force_N) range.peak_N = std::max(range.peak_N, std::abs(f));
  return range;
}

/// Stands in for the organ in searches, which learn all there is to know from the organ itself.
class NothingKnown final : public ResidualFunction {
 public:
  NothingKnown(Eigen::Index residuals, Eigen::Index parameters)
      : residuals_(residuals), parameters_(parameters) {}

  [[nodiscard]] Eigen::Index residual_count() const override { return residuals_; }
  [[nodiscard]] bool evaluate(std::span<const double> /*natural*/, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    residual.setZero(residuals_);
    if (jacobian != nullptr) jacobian->setZero(residuals_, parameters_);
    return true;
  }

 private:
  Eigen::Index residuals_, parameters_;
};

/// Organ and offset less reading, all recordings one below another, in parts of a unit.
class OrganLessReadings final : public ResidualFunction {
 public:
  OrganLessReadings(const OrganModel& model, const FittedBonds& bonds,
                    const std::vector<OrganReadings>& recordings, std::size_t bond_parameters)
      : model_(model),
        bonds_(bonds),
        recordings_(recordings),
        bond_parameters_(bond_parameters),
        surrogate_(rows_of(recordings),
                   static_cast<Eigen::Index>(bond_parameters) + 2 * std::ssize(recordings)) {
    double peak = 0.0;
    for (const OrganReadings& r : recordings) {
      ranges_.push_back(press_range(r));
      peak = std::max(peak, ranges_.back().peak_N);
    }
    constexpr double kPart = 1e-3;
    unit_N_ = kPart * peak;
  }

  [[nodiscard]] Eigen::Index residual_count() const override { return rows_of(recordings_); }
  [[nodiscard]] const ResidualFunction* surrogate() const override { return &surrogate_; }

  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    residual.resize(residual_count());
    if (jacobian != nullptr) jacobian->setZero(residual_count(), std::ssize(natural));
    Eigen::Index row = 0;
    const std::string buckled = gave_up([&] {
      for (std::size_t i = 0; i < recordings_.size(); ++i) {
        row = add_rows(i, natural, row, residual, jacobian);
      }
    });
    if (!buckled.empty()) return false;  // the search turns away
    return residual.allFinite() && (jacobian == nullptr || jacobian->allFinite());
  }

  /// Readings that count as independent ones.
  [[nodiscard]] Correlation correlation(std::span<const double> natural) const {
    Eigen::VectorXd residual;
    if (!evaluate(natural, residual, nullptr)) return {};
    std::vector<std::span<const double>> parts;
    std::size_t from = 0;
    for (const OrganReadings& r : recordings_) {
      parts.emplace_back(residual.data() + from, r.time_s.size());
      from += r.time_s.size();
    }
    return residual_correlation(parts);
  }

 private:
  static Eigen::Index rows_of(const std::vector<OrganReadings>& recordings) {
    Eigen::Index rows = 0;
    for (const OrganReadings& r : recordings) rows += std::ssize(r.time_s);
    return rows;
  }

  Eigen::Index add_rows(std::size_t i, std::span<const double> natural, Eigen::Index row,
                        Eigen::VectorXd& residual, RowMatrix* jacobian) const {
    const OrganReadings& r = recordings_[i];
    const auto n = std::ssize(r.time_s);
    const auto place = static_cast<Eigen::Index>(bond_parameters_ + 2 * i);
    const double contact = natural[static_cast<std::size_t>(place)];
    const double offset = natural[static_cast<std::size_t>(place) + 1];
    const std::vector<double> values =
        FittedBonds::values(model_, bonds_.material(natural.first(bond_parameters_)));
    Eigen::MatrixXd along = bonds_.along(model_);
    if (jacobian == nullptr) along.resize(along.rows(), 0);
    const Response here =
        model_.respond_along(beyond_contact(r.drive, contact), r.time_s, values, along);
    const Eigen::Map<const Eigen::VectorXd> reading(r.force_N.data(), n);
    residual.segment(row, n) = (here.value - reading).array() / unit_N_ + offset / unit_N_;
    if (jacobian == nullptr) return row + n;
    jacobian->block(row, 0, n, along.cols()) = here.sensitivity / unit_N_;
    const double step = kContactDifference * ranges_[i].depth_m;
    const Response deeper =
        model_.respond(beyond_contact(r.drive, contact - step), r.time_s, values, Want::values);
    jacobian->block(row, place, n, 1) = (here.value - deeper.value) / (step * unit_N_);
    jacobian->block(row, place + 1, n, 1).setConstant(1.0 / unit_N_);
    return row + n;
  }

  const OrganModel& model_;
  const FittedBonds& bonds_;
  const std::vector<OrganReadings>& recordings_;
  std::size_t bond_parameters_;
  std::vector<PressRange> ranges_;
  double unit_N_ = 1.0;
  NothingKnown surrogate_;
};

FitParameter placement_parameter(std::string name, Dimension dimension, double start, double down,
                                 double up) {
  FitParameter p;
  p.name = std::move(name);
  p.unit = shown_unit(dimension);
  p.scale = Scale::linear;
  p.start = start;
  p.lower = start - down;
  p.upper = start + up;
  return p;
}

/// Of the linearised interval in theta; a part of the bounds where there is none.
double half_width(const FitResult& fit, std::size_t index, const Threshold& threshold) {
  const FitParameter& p = fit.parameters[index].parameter;
  constexpr double kPart = 0.02;
  const double searched = p.theta_upper() - p.theta_lower();
  const Covariance& c = fit.covariance;
  const auto place = std::find(c.free.begin(), c.free.end(), index);
  if (!c.full_rank || place == c.free.end()) return kPart * searched;
  return threshold.multiplier(fit.best.deviance) * c.theta_sd[place - c.free.begin()];
}

/// Profiles of the bonds' parameters, contacts and offsets fitted again at every point.
/// @return a deeper point, if one is met: the fit is then void
std::optional<Minimum> profile_bonds(FitResult& fit, const ResidualFunction& function,
                                     std::span<const FitParameter> all, std::size_t bonds,
                                     const Threshold& threshold) {
  Progress progress("profiling the bonds", bonds);
  for (std::size_t i = 0; i < bonds; ++i) {
    const double half = half_width(fit, i, threshold);
    Profile profile =
        short_profile(function, all, fit.best, i, half, threshold.rise(fit.best.deviance));
    if (profile.better) return profile.better;
    ParameterResult& p = fit.parameters[i];
    p.lower = profile.lower;
    p.upper = profile.upper;
    p.profile = std::move(profile);
    p.verdict = verdict_of(p);
    progress.advance();
  }
  return std::nullopt;
}

/// Fits from a start, and from every deeper minimum that a profile meets: covariance, independent
/// readings and intervals are always those of the minimum that is returned.
/// @param threshold on return with the inflation at that minimum
FitResult fit_and_profile(const OrganLessReadings& function, const std::vector<FitParameter>& all,
                          std::size_t bonds, Threshold& threshold, bool profiles) {
  std::vector<double> start = start_values(all);
  constexpr int kMostDescents = 5;
  for (int descents = 0; descents <= kMostDescents; ++descents) {
    FitResult fit = fit_residuals(function, all, {start}, threshold, false, StartKind::solved,
                                  [&](std::span<const double> best, Threshold& at) {
                                    at.inflation = function.correlation(best).inflation();
                                  });
    threshold.inflation = fit.inflation;
    linear_intervals(fit, all, threshold);
    if (!profiles) return fit;
    std::optional<Minimum> deeper = profile_bonds(fit, function, all, bonds, threshold);
    if (!deeper) return fit;
    start = std::move(deeper->natural);
  }
  throw Error(ExitCode::numerical, "profiles",
              "a deeper minimum was met again and again; expected one that stays: fewer bonds to "
              "fit, or another start");
}

}  // namespace

Protocol beyond_contact(const Protocol& drive, double contact_m) {
  std::vector<Knot> knots;
  const auto own = drive.knots();
  for (std::size_t i = 0; i < own.size(); ++i) {
    const double depth = own[i].value - contact_m;
    if (i > 0) {
      const double earlier = own[i - 1].value - contact_m;
      const bool met = (earlier < 0.0) != (depth < 0.0) && own[i].time_s > own[i - 1].time_s;
      if (met && earlier != 0.0 && depth != 0.0) {
        const double share = earlier / (earlier - depth);
        knots.push_back({own[i - 1].time_s + share * (own[i].time_s - own[i - 1].time_s), 0.0});
      }
    }
    knots.push_back({own[i].time_s, std::max(depth, 0.0)});
  }
  Protocol result(drive.drive(), std::move(knots), drive.name(), std::isinf(drive.end_s()));
  result.set_equilibrium_at_start(drive.equilibrium_at_start());
  return result;
}

ReadingsFit fit_to_readings(const OrganModel& model, const FittedBonds& bonds,
                            const std::vector<FitParameter>& parameters,
                            const std::vector<OrganReadings>& recordings, bool profiles) {
  std::vector<FitParameter> all = parameters;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const OrganReadings& r = recordings[i];
    const std::string number = recordings.size() > 1 ? fmt::format("_{}", i + 1) : std::string();
    const auto [depth_m, peak_N] = press_range(r);
    constexpr double kUp = 0.5;  // of the depth: contact cannot lie at the deepest place
    all.push_back(placement_parameter("contact" + number, Dimension::length, r.contact_m, depth_m,
                                      kUp * depth_m));
    all.push_back(
        placement_parameter("offset" + number, Dimension::force, r.offset_N, peak_N, peak_N));
  }
  const OrganLessReadings function(model, bonds, recordings, parameters.size());
  Threshold threshold{kReadingsLevel, false, static_cast<int>(function.residual_count()),
                      static_cast<int>(all.size())};
  ReadingsFit result;
  result.fit = fit_and_profile(function, all, parameters.size(), threshold, profiles);
  result.readings = threshold.data_count;
  result.independent = threshold.data_count / threshold.inflation;
  result.rise = threshold.rise(result.fit.best.deviance);
  result.level = threshold.level;
  return result;
}

}  // namespace tpm::fit
