#include "tpm/fit/fitted_law.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

/// Range over which a law was fitted: the largest depth beyond the contact point, and the time.
struct FittedRange {
  double depth = 0.0;  ///< of readings without a history: the deepest
  double duration_s = 0.0;
};

FittedRange range_of_recording(const RecordingFit& recording, double contact) {
  FittedRange range;
  std::optional<double> begin;
  for (std::size_t i = 0; i < recording.drive.size(); ++i) {
    if (!recording.fitted[i]) continue;
    if (!begin) begin = recording.time_s[i];
    range.duration_s = recording.time_s[i] - *begin;
    range.depth = std::max(range.depth, recording.law_drive(i) - contact);
  }
  return range;
}

FittedRange fitted_range(const FitResult& fit, std::size_t contact_place) {
  FittedRange range;
  const auto widen = [&range](const FittedRange& other) {
    range.depth = std::max(range.depth, other.depth);
    range.duration_s = std::max(range.duration_s, other.duration_s);
  };
  for (const RecordingFit& recording : fit.recordings) {
    const auto values = model_parameters(fit.config, fit.best.natural, recording.choice);
    widen(range_of_recording(recording, fit.config.law ? values[contact_place] : 0.0));
  }
  const bool contact = !fit.config.law || fit.config.law->drive == Quantity::indentation_depth;
  for (const FittedDatum& reading : fit.data) {
    if (!contact || reading.datum.held_out || !std::isfinite(reading.datum.time_s)) continue;
    widen({reading.imposed_depth_m.value_or(0.0), reading.datum.time_s});
  }
  return range;
}

double element_reference(const FitResult& fit) {
  constexpr double kUsual = 1e-3;  // the paper's reference length
  const double deepest = fitted_range(fit, 0).depth;
  return deepest > 0.0 ? deepest : kUsual;
}

LawSpec spec_of(const FitResult& fit) {
  if (fit.config.law) return *fit.config.law;
  LawSpec spec;
  spec.tension = Tension::elastic;
  spec.reference = element_reference(fit);
  return spec;
}

std::vector<double> values_of_element(const BondElement& p, const LawSpec& spec) {
  const double scale = p.modulus_to_stiffness_m();
  return {scale * p.equilibrium_Pa,
          scale * p.relaxing_Pa(),
          p.relaxation_time_s(),
          scale * lambda1_Pa(p.lateral_Pa, spec.reference, p.spacing_m),
          p.spacing_m,
          0.0,
          0.0};
}

/// Contact and offset belong to one recording; the slack length of a strip to the specimen.
bool is_of_one_recording(const LawSpec& spec, const LawParameter& parameter) {
  return parameter.nuisance &&
         (parameter.name == "offset" || spec.drive != Quantity::relative_length);
}

/// Mean slack length of a strip's recordings, which may have their own.
double mean_contact(const FitResult& fit, std::span<const double> natural, std::size_t place) {
  double sum = 0.0;
  for (std::size_t i = 0; i < fit.config.data.size(); ++i) {
    sum += model_parameters(fit.config, natural, i)[place];
  }
  return sum / static_cast<double>(fit.config.data.size());
}

/// The law's parameters at values of the fit's, SI.
std::vector<double> law_values(const FitResult& fit, const LawSpec& spec,
                               std::span<const double> natural) {
  if (!fit.config.law)
    return values_of_element(from_vector(fitted_element(fit.config, natural)), spec);
  std::vector<double> values = model_parameters(fit.config, natural, 0);
  if (fit.config.data.size() == 1) return values;
  const std::vector<LawParameter> parameters = law_parameters(spec);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (is_of_one_recording(spec, parameters[i])) {
      values[i] = 0.0;
    } else if (parameters[i].name == "contact" && has_own_slack(fit.config)) {
      values[i] = mean_contact(fit, natural, i);
    }
  }
  return values;
}

/// The coordinate in which each parameter of the law is stated.
std::vector<Coordinate> law_coordinates(const FitResult& fit, const LawSpec& spec) {
  const std::vector<LawParameter> parameters = law_parameters(spec);
  std::vector<Coordinate> coordinates(parameters.size(), Coordinate::linear);
  if (fit.config.law) {
    for (const EstimatedParameter& p : fit.config.parameters) {
      for (const Target& target : p.sets) {
        coordinates[target.parameter] = coordinate_of(p.fit.scale);
      }
    }
    return coordinates;
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool positive =
        parameters[i].dimension == Dimension::time ||
        (parameters[i].dimension == Dimension::stiffness && parameters[i].name != "k_tension");
    if (positive) coordinates[i] = Coordinate::log;
    if (parameters[i].name == "spacing") coordinates[i] = Coordinate::inverse_square;
  }
  return coordinates;
}

/// d (law's coordinate) / d (fit's theta) by central differences: the map is smooth and costs
/// nothing, and its error (1e-10) is far below what a covariance is known to.
Eigen::MatrixXd coordinate_changes(const FitResult& fit, const LawSpec& spec,
                                   const std::vector<Coordinate>& coordinates) {
  const Covariance& c = fit.covariance;
  const auto columns = static_cast<Eigen::Index>(c.free.size());
  Eigen::MatrixXd change(static_cast<Eigen::Index>(coordinates.size()), columns);
  for (Eigen::Index k = 0; k < columns; ++k) {
    const std::size_t j = c.free[static_cast<std::size_t>(k)];
    const FitParameter& p = fit.config.parameters[j].fit;
    const double theta = p.theta(fit.best.natural[j]);
    double step = std::max(1e-5 * std::abs(theta), 1e-4 * c.theta_sd[k]);
    if (p.scale == Scale::inverse_square)
      step = std::min(step, 0.5 * theta);  // not beyond infinity
    const auto at = [&](double moved) {
      std::vector<double> natural = fit.best.natural;
      natural[j] = p.natural(moved);
      const std::vector<double> values = law_values(fit, spec, natural);
      Eigen::VectorXd result(change.rows());
      for (Eigen::Index i = 0; i < change.rows(); ++i) {
        const auto place = static_cast<std::size_t>(i);
        const bool usable = coordinates[place] == Coordinate::linear || values[place] > 0.0;
        result[i] = usable ? to_coordinate(coordinates[place], values[place]) : 0.0;
      }
      return result;
    };
    const Eigen::VectorXd above = at(theta + step), below = at(theta - step);
    for (Eigen::Index i = 0; i < change.rows(); ++i) {  // an infinite spacing stays infinite
      change(i, k) = above[i] == below[i] ? 0.0 : (above[i] - below[i]) / (2.0 * step);
    }
  }
  return change;
}

ReadingNoise reading_noise(const FitResult& fit) {
  ReadingNoise noise;
  const DataChoice& data = fit.config.data.front();
  const double scale = std::sqrt(fit.variance_factor);
  if (fit.correlation) noise.lag_1 = fit.correlation->lag1;
  const bool of_strain = std::ranges::any_of(fit.config.data, &DataChoice::load_imposed);
  if (data.noise.shape != ErrorShape::normal || fit.config.loss.kind != Loss::none || of_strain) {
    noise.kind = "unknown";
    return noise;
  }
  noise.kind = noise_kind_name(data.noise.kind);
  const auto estimated = [&](const std::string& name, double stated) {
    for (std::size_t i = 0; i < fit.config.parameters.size(); ++i) {
      if (fit.config.parameters[i].fit.name == name) return fit.best.natural[i];
    }
    return stated * scale;
  };
  if (uses_absolute(data.noise.kind)) noise.absolute = estimated(data.sigma_a, data.noise.absolute);
  if (uses_relative(data.noise.kind)) noise.relative = estimated(data.sigma_b, data.noise.relative);
  if (data.noise.kind == NoiseKind::per_row) noise.column = scale;
  return noise;
}

/// Contact and offset of one of several recordings, which stand last in a law's parameters.
void set_placement(FittedFile& file, const FitConfig& config, std::span<const double> values,
                   std::size_t choice) {
  const auto estimated = [&](std::size_t parameter) {
    return std::ranges::any_of(config.parameters, [&](const EstimatedParameter& p) {
      return std::ranges::any_of(p.sets, [&](const Target& target) {
        return target.parameter == parameter && target.applies_to(choice);
      });
    });
  };
  file.contact = values[values.size() - 2];
  file.offset = values.back();
  if (!estimated(values.size() - 2)) file.held.emplace_back("contact");
  if (!estimated(values.size() - 1)) file.held.emplace_back("offset");
}

/// The drift of a recording's zero, if one was fitted.
void set_drift(FittedFile& file, const FitResult& fit, std::size_t choice) {
  for (std::size_t j = 0; j < fit.config.parameters.size(); ++j) {
    const std::optional<DriftTerm>& drift = fit.config.parameters[j].drift;
    if (!drift || drift->choice != choice) continue;
    file.drift = fit.best.natural[j];
    file.drift_origin_s = drift->origin_s;
  }
}

void set_rises(FittedFile& file, const FitResult& fit, std::size_t choice) {
  for (std::size_t j = 0; j < fit.config.parameters.size(); ++j) {
    const std::optional<RiseTerm>& rise = fit.config.parameters[j].rise;
    if (!rise || rise->choice != choice) continue;
    file.rises.push_back({rise->begin_s, rise->end_s, fit.best.natural[j]});
  }
}

std::vector<FittedFile> fitted_files(const FitResult& fit) {
  std::vector<FittedFile> files;
  for (std::size_t i = 0; i < fit.config.data.size(); ++i) {
    FittedFile file;
    file.name = fit.config.data[i].dataset;
    if (std::isfinite(fit.config.data[i].from_s)) file.from_s = fit.config.data[i].from_s;
    if (std::isfinite(fit.config.data[i].to_s)) file.to_s = fit.config.data[i].to_s;
    file.clipped_above = fit.config.data[i].clipped_above;
    file.clipped_below = fit.config.data[i].clipped_below;
    if (i < fit.data_sha256.size()) file.sha256 = fit.data_sha256[i];
    for (const RecordingFit& r : fit.recordings) {
      if (r.choice != i) continue;
      if (fit.config.law && fit.config.data.size() > 1) {
        set_placement(file, fit.config, model_parameters(fit.config, fit.best.natural, i), i);
      }
      set_drift(file, fit, i);
      set_rises(file, fit, i);
      file.readings += static_cast<int>(std::count(r.fitted.begin(), r.fitted.end(), true));
    }
    for (const FittedDatum& d : fit.data) file.readings += d.datum.choice == i && !d.datum.held_out;
    files.push_back(std::move(file));
  }
  return files;
}

std::optional<LawUncertainty> uncertainty_of(const FitResult& fit, const LawSpec& spec) {
  const Threshold threshold = threshold_of(fit);
  if (!fit.covariance.full_rank || !threshold.estimable()) return std::nullopt;
  const std::vector<Coordinate> coordinates = law_coordinates(fit, spec);
  const Eigen::MatrixXd change = coordinate_changes(fit, spec, coordinates);
  LawUncertainty u;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < change.rows(); ++i) {
    if (change.row(i).cwiseAbs().maxCoeff() == 0.0) continue;
    rows.push_back(i);
    u.place.push_back(static_cast<std::size_t>(i));
    u.coordinate.push_back(coordinates[static_cast<std::size_t>(i)]);
  }
  const Eigen::MatrixXd some = change(rows, Eigen::all);
  u.covariance = some * fit.covariance.theta_covariance() * some.transpose();
  u.covariance = 0.5 * (u.covariance + u.covariance.transpose()).eval();
  u.level = threshold.level;
  if (!threshold.scale_known) u.degrees_of_freedom = threshold.residual_degrees();
  u.readings_per_independent = fit.inflation;
  u.noise = reading_noise(fit);
  u.duration_s = fitted_range(fit, law_parameters(spec).size() - 2).duration_s;
  u.data = fitted_files(fit);
  for (const ParameterResult& p : fit.parameters) {
    if (p.at_lower_bound || p.at_upper_bound) u.at_bound.push_back(p.parameter.name);
    if (p.not_separable) u.not_separable.push_back(p.parameter.name);
    if (p.unconfirmed) u.unconfirmed.push_back(p.parameter.name);
  }
  return u;
}

}  // namespace

Coordinate coordinate_of(Scale scale) {
  if (scale == Scale::log) return Coordinate::log;
  return scale == Scale::linear ? Coordinate::linear : Coordinate::inverse_square;
}

std::optional<std::string> no_law_because(const FitConfig& config) {
  if (config.law) return std::nullopt;
  if (config.organ) return "an organ was fitted, and no single contact";
  if (config.tension.kind != TensionRule::Kind::exact) {
    return "its tension is frozen at one value, which no law of the family does";
  }
  return std::nullopt;
}

LawFile fitted_law(const FitResult& fit) {
  if (const auto reason = no_law_because(fit.config)) {
    throw bad_input("law file", *reason, "a law of the family or the paper's element");
  }
  LawFile law;
  law.spec = spec_of(fit);
  law.values = law_values(fit, law.spec, fit.best.natural);
  law.provenance = Provenance::derived;
  // contact and offset stand last.
  const double depth = fitted_range(fit, law.values.size() - 2).depth;
  if (depth > 0.0) law.fitted_to = depth;
  law.note = fmt::format("fitted: {}", fit.config.title);
  law.uncertainty = uncertainty_of(fit, law.spec);
  law.adequacy = fit.adequacy;
  return law;
}

bool has_own_slack(const FitConfig& config) {
  if (!config.law || config.law->drive != Quantity::relative_length) return false;
  const std::size_t contact = LawModel(*config.law).index("contact");
  return std::ranges::any_of(config.parameters, [contact](const EstimatedParameter& p) {
    return p.sets.size() == 1 && p.sets.front().parameter == contact &&
           !p.sets.front().data.empty();
  });
}

}  // namespace tpm::fit
