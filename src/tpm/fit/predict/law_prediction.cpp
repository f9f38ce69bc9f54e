#include "tpm/fit/predict/law_prediction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/quantity_text.hpp"
#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr auto kPlacementWords = std::to_array<Word<Placement>>(
    {{Placement::surface, "surface"}, {Placement::fitted, "fitted"}, {Placement::own, "own"}});
constexpr int kFewestSamples = 100;

const LawUncertainty& uncertainty_of(const LawFile& law) {
  if (law.uncertainty) return *law.uncertainty;
  throw bad_input(fmt::format("law {}", law_name(law.spec)), "carries no uncertainty of a fit",
                  "a law.json that tpm fit has written; data that determine all parameters");
}

void set_mean_band(LawPrediction& p) {
  for (std::size_t i = 0; i < p.response.size(); ++i) {
    p.mean_lower.push_back(p.response[i] - p.quantile * p.standard_error[i]);
    p.mean_upper.push_back(p.response[i] + p.quantile * p.standard_error[i]);
  }
}

/// The band of the mean, widened on both sides by the scatter of one reading.
void set_reading_band(LawPrediction& p, const LawUncertainty& u, std::span<const double> own_sd) {
  const bool logarithmic = u.noise.kind == "log";
  for (std::size_t i = 0; i < p.response.size(); ++i) {
    const double f = p.response[i];
    const auto sd = i < own_sd.size() ? std::optional<double>(own_sd[i]) : std::nullopt;
    const std::optional<double> sigma = reading_sigma(u.noise, f, sd);
    if (!sigma) {
      p.reading_lower.clear();
      p.reading_upper.clear();
      p.remarks.push_back(
          {"no_band_for_readings",
           u.noise.kind == "per_row"
               ? "no band for new readings: the size of their noise stood in the data"
               : "no band for new readings: the fit's noise is not normal"});
      return;
    }
    const double below = f - p.mean_lower[i], above = p.mean_upper[i] - f;
    if (logarithmic) {
      const double scatter = p.quantile * u.noise.relative;
      p.reading_lower.push_back(f * std::exp(-std::hypot(below / f, scatter)));
      p.reading_upper.push_back(f * std::exp(std::hypot(above / f, scatter)));
    } else {
      p.reading_lower.push_back(f - std::hypot(below, p.quantile * *sigma));
      p.reading_upper.push_back(f + std::hypot(above, p.quantile * *sigma));
    }
  }
}

/// Laws drawn from the uncertain coordinates about a centre. With an estimated size of the noise
/// the draws are of Student's t: normal over the root of a chi-square.
class LawDraws {
 public:
  LawDraws(const LawFile& law, const UncertainCoordinates& u, std::vector<double> centre,
           std::uint64_t seed)
      : model_(law.spec),
        u_(u),
        centre_(std::move(centre)),
        degrees_(law.uncertainty->degrees_of_freedom),
        random_(seed) {}

  /// Physical parameters, SI. Throws Error(numerical) if nearly no draw is physical.
  std::vector<double> next() {
    constexpr int kMost = 10'000;
    for (int attempt = 0; attempt < kMost; ++attempt) {
      std::vector<double> values = draw();
      if (is_physical(values)) return values;
      ++refused_;
    }
    throw Error(ExitCode::numerical, "prediction by samples",
                "nearly no law drawn from the covariance is physical", "a better known law");
  }
  [[nodiscard]] int refused() const { return refused_; }
  void refuse() { ++refused_; }

 private:
  std::vector<double> draw() {
    Eigen::VectorXd z(u_.root.cols());
    for (double& each : z) each = random_.normal();
    double scale = 1.0;
    if (degrees_) {
      const double share = std::max(random_.uniform(), 1e-12);
      scale = std::sqrt(*degrees_ / chi_squared_quantile(share, *degrees_));
    }
    const Eigen::VectorXd moved = scale * (u_.root * z);
    std::vector<double> values = centre_;
    for (std::size_t i = 0; i < u_.place.size(); ++i) {
      const double theta = to_coordinate(u_.coordinate[i], centre_[u_.place[i]]);
      values[u_.place[i]] =
          from_coordinate(u_.coordinate[i], theta + moved[static_cast<Eigen::Index>(i)]);
    }
    return values;
  }
  [[nodiscard]] bool is_physical(const std::vector<double>& values) const {
    try {
      model_.require_in_range(values);
    } catch (const Error&) {
      return false;
    }
    return true;
  }

  LawModel model_;
  const UncertainCoordinates& u_;
  std::vector<double> centre_;
  std::optional<double> degrees_;
  Random random_;
  int refused_ = 0;
};

/// The answer for a law that was drawn; draws under which an organ does not stand are refused.
Eigen::VectorXd drawn_answer(const LawPrediction& p, const Model& model, const Protocol& protocol,
                             LawDraws& draws) {
  constexpr int kMost = 100;
  for (int attempt = 0; attempt < kMost; ++attempt) {
    try {
      return model.respond(protocol, p.time_s, draws.next(), Want::values).value;
    } catch (const Error& error) {
      if (error.code() != ExitCode::numerical || attempt + 1 == kMost) throw;
      draws.refuse();
    }
  }
  return {};
}

/// Replaces the band of the mean by quantiles over drawn laws.
void set_sampled_mean_band(LawPrediction& p, const Model& model, const Protocol& protocol,
                           LawDraws draws, int count) {
  const auto n = static_cast<Eigen::Index>(p.time_s.size());
  Eigen::MatrixXd answers(n, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    answers.col(k) = drawn_answer(p, model, protocol, draws);
  }
  std::vector<double> sorted(static_cast<std::size_t>(count));
  const auto at = [&](double share) {
    const auto place = static_cast<std::ptrdiff_t>(share * (count - 1) + 0.5);
    std::nth_element(sorted.begin(), sorted.begin() + place, sorted.end());
    return sorted[static_cast<std::size_t>(place)];
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!answers.row(i).allFinite()) continue;
    Eigen::VectorXd::Map(sorted.data(), count) = answers.row(i);
    p.mean_lower[static_cast<std::size_t>(i)] = at(0.5 - 0.5 * p.level);
    p.mean_upper[static_cast<std::size_t>(i)] = at(0.5 + 0.5 * p.level);
  }
  p.samples = count;
  if (draws.refused() > 0) {
    p.remarks.push_back(
        {"laws_drawn_again",
         fmt::format("{} laws drawn were outside their physical range and drawn again",
                     draws.refused())});
  }
}

void require_known_drive(const LawFile& law, const Protocol& protocol) {
  const bool load = protocol.drive() == Drive::force;
  if (law.spec.drive == Quantity::indentation_depth || !load) return;
  throw bad_input(fmt::format("law {}", law_name(law.spec)), "of a strip under a load",
                  "an imposed relative length");
}

}  // namespace

void add_range_remarks(LawPrediction& p, const LawFile& law) {
  double deepest = 0.0;
  for (const double drive : p.imposed) deepest = std::max(deepest, drive - p.contact);
  if (p.drive_kind == Drive::force) {
    deepest = 0.0;
    for (const double depth : p.response) {
      if (std::isfinite(depth)) deepest = std::max(deepest, depth - p.contact);
    }
  }
  const Unit unit = shown_unit(quantity_dimension(law.spec.drive));
  const auto text = [&](double value) {
    return with_unit(significant(value / unit.to_si, 3), unit);
  };
  if (law.fitted_to && deepest > 1.001 * *law.fitted_to) {
    p.remarks.push_back(
        {"deeper_than_fitted", fmt::format("extrapolates: {} deep, and the law was fitted to {}",
                                           text(deepest), text(*law.fitted_to))});
  }
  const auto [first, last] = std::ranges::minmax_element(p.time_s);
  const double duration = p.time_s.empty() ? 0.0 : *last - *first;
  const double fitted = law.uncertainty ? law.uncertainty->duration_s : 0.0;
  if (fitted > 0.0 && duration > 1.5 * fitted && std::isfinite(duration)) {
    p.remarks.push_back({"longer_than_fitted",
                         fmt::format("extrapolates: lasts {} s, and the law was fitted to {} s",
                                     significant(duration, 3), significant(fitted, 3))});
  }
  if (law.adequacy && !law.adequacy->is_adequate()) {
    p.remarks.insert(p.remarks.begin(), {"law_in_doubt", law.adequacy->summary});
  }
  if (law.uncertainty) {
    for (const std::string& name : law.uncertainty->at_bound) {
      p.remarks.push_back(
          {"parameter_at_bound",
           fmt::format("{} stood on a bound of the fit: its uncertainty is not in the bands",
                       name)});
    }
    for (const std::string& name : law.uncertainty->not_separable) {
      p.remarks.push_back(
          {"parameter_not_separable",
           fmt::format(
               "{} was not told from something else (a drift, a slower branch, a floor of the "
               "instrument or a loading that is no power): the bands suppose that there was none",
               name)});
    }
    for (const std::string& name : law.uncertainty->unconfirmed) {
      p.remarks.push_back(
          {"parameter_unconfirmed",
           fmt::format("{} was not identified: the minimum of the fit, or what it rests on, is not "
                       "trusted, and the bands suppose it",
                       name)});
    }
  }
  const auto missing = std::count_if(p.response.begin(), p.response.end(),
                                     [](double f) { return !std::isfinite(f); });
  if (missing > 0) {
    p.remarks.push_back(
        {"not_predicted", fmt::format("nothing is predicted at {} of {} times (docs/predict.md)",
                                      missing, p.response.size())});
  }
}

Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  // Scaled to correlations first: parameters differ by many orders of magnitude.
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = (sd.array() > 0.0).select(sd.cwiseInverse(), 0.0);
  const SymmetricModes modes =
      symmetric_modes(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return sd.asDiagonal() * modes.vectors * modes.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

LawFile at_surface(const LawFile& law) {
  LawFile plain = law;
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (belongs_to_recording(law.spec, parameters[i])) plain.values[i] = 0.0;
  }
  return plain;
}

UncertainCoordinates fitted_coordinates(const LawFile& law, Placement placement) {
  const LawUncertainty& u = uncertainty_of(law);
  const std::vector<LawParameter> parameters = law_parameters(law.spec);
  std::vector<Eigen::Index> kept;
  UncertainCoordinates result;
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    const LawParameter& p = parameters[u.place[i]];
    if (placement != Placement::fitted && belongs_to_recording(law.spec, p)) continue;
    kept.push_back(static_cast<Eigen::Index>(i));
    result.place.push_back(u.place[i]);
    result.coordinate.push_back(u.coordinate[i]);
  }
  result.root = covariance_root(u.covariance(kept, kept));
  return result;
}

Eigen::MatrixXd coordinate_slopes(const Response& response, const UncertainCoordinates& u,
                                  std::span<const double> values) {
  Eigen::MatrixXd slopes(response.value.size(), static_cast<Eigen::Index>(u.place.size()));
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    slopes.col(static_cast<Eigen::Index>(i)) =
        response.sensitivity.col(static_cast<Eigen::Index>(u.place[i])) *
        coordinate_slope(u.coordinate[i], values[u.place[i]]);
  }
  return slopes;
}

std::optional<double> reading_sigma(const ReadingNoise& noise, double answer,
                                    std::optional<double> own_sd) {
  if (noise.kind == "per_row") {
    if (!own_sd) return std::nullopt;
    return noise.column * *own_sd;
  }
  if (noise.kind == "unknown") return std::nullopt;
  return noise.absolute + noise.relative * std::abs(answer);
}

LawPrediction begin_prediction(const LawFile& law, const PredictionOptions& options) {
  const LawUncertainty& u = uncertainty_of(law);
  LawPrediction p;
  p.spec = law.spec;
  p.level = options.level.value_or(u.level);
  if (!(p.level > 0.0 && p.level < 1.0)) {
    throw bad_input("prediction", fmt::format("level {}", shortest(p.level)),
                    "a level between 0 and 1");
  }
  if (options.samples != 0 && options.samples < kFewestSamples) {
    throw bad_input("prediction", fmt::format("{} samples", options.samples),
                    fmt::format("none, or at least {}", kFewestSamples));
  }
  p.quantile = u.quantile(p.level);
  return p;
}

void fill_prediction(LawPrediction& p, const Model& model, const LawFile& law,
                     const Protocol& protocol, const UncertainCoordinates& u,
                     const std::vector<double>& values, std::span<const double> own_sd,
                     const PredictionOptions& options) {
  const Response response = model.respond(protocol, p.time_s, values, Want::values_and_sensitivity);
  const Eigen::VectorXd se = (coordinate_slopes(response, u, values) * u.root).rowwise().norm();
  p.response.assign(response.value.begin(), response.value.end());
  p.standard_error.assign(se.begin(), se.end());
  p.imposed.reserve(p.time_s.size());
  for (const double t : p.time_s) p.imposed.push_back(value_at(protocol, t));
  p.drive_kind = protocol.drive();
  set_mean_band(p);
  if (options.samples > 0) {
    set_sampled_mean_band(p, model, protocol, LawDraws(law, u, values, options.seed),
                          options.samples);
  }
  set_reading_band(p, *law.uncertainty, own_sd);
  add_range_remarks(p, law);
}

std::string_view placement_name(Placement placement) noexcept {
  return entry_of(kPlacementWords, placement).text;
}

Placement parse_placement(std::string_view text, std::string_view where) {
  return parse_word(kPlacementWords, "placement", text, where);
}

Dimension LawPrediction::response_dimension() const {
  return quantity_dimension(drive_kind == Drive::force ? spec.drive : spec.response);
}

std::string LawPrediction::subject() const {
  if (organ_spheres == 0) return law_name(spec);
  return fmt::format("{} on an organ of {} spheres", law_name(spec), organ_spheres);
}

LawPrediction predict_law(const LawFile& law, const Protocol& protocol,
                          std::span<const double> times_s, const PredictionOptions& options) {
  return predict_by(LawModel(law.spec), law, protocol, times_s, options);
}

LawPrediction predict_by(const Model& model, const LawFile& law, const Protocol& protocol,
                         std::span<const double> times_s, const PredictionOptions& options) {
  LawPrediction p = begin_prediction(law, options);
  require_known_drive(law, protocol);
  p.placement = options.placement.value_or(Placement::surface);
  if (p.placement == Placement::own) {
    throw bad_input("prediction", "a protocol has no contact point and offset of its own",
                    "surface or fitted");
  }
  const UncertainCoordinates u = fitted_coordinates(law, p.placement);
  const std::vector<double> values =
      p.placement == Placement::surface ? at_surface(law).values : law.values;
  p.contact = values[values.size() - 2];
  p.offset = values.back();
  p.time_s.assign(times_s.begin(), times_s.end());
  fill_prediction(p, model, law, protocol, u, values, {}, options);
  if (protocol.drive() == Drive::force) {  // the noise of the fit is one of forces
    p.reading_lower.clear();
    p.reading_upper.clear();
    p.remarks.push_back(
        {"no_band_for_readings",
         "no band for new readings: the fit knows the noise of forces, not of depths"});
  }
  return p;
}

}  // namespace tpm::fit
