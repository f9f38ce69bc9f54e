#include "tpmkit/law_uncertainty.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm {
using namespace files;

namespace {

constexpr auto kCoordinateWords =
    std::to_array<Word<Coordinate>>({{Coordinate::linear, "linear"},
                                     {Coordinate::log, "log"},
                                     {Coordinate::inverse_square, "inverse_square"}});

std::size_t place_of_key(const std::vector<LawParameter>& parameters, const std::string& key,
                         std::string_view where) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (law_key(parameters[i]) == key) return i;
  }
  throw unknown_word(where, "unknown parameter", key, mapped<std::string>(parameters, law_key));
}

Eigen::MatrixXd matrix_of(const std::vector<std::vector<double>>& rows, std::size_t size,
                          std::string_view where) {
  const auto n = static_cast<Eigen::Index>(size);
  Eigen::MatrixXd matrix(n, n);
  if (rows.size() != size) {
    throw bad_input(where, fmt::format("{} rows", rows.size()),
                    fmt::format("{}, one for each parameter", size));
  }
  for (std::size_t r = 0; r < size; ++r) {
    if (rows[r].size() != size) {
      throw bad_input(where, fmt::format("{} numbers in row {}", rows[r].size(), r),
                      fmt::format("{}", size));
    }
    matrix.row(static_cast<Eigen::Index>(r)) =
        Eigen::Map<const Eigen::RowVectorXd>(rows[r].data(), n);
  }
  return matrix;
}

/// In units of the standard deviations, so that the test does not depend on the parameters' units.
void require_covariance(const Eigen::MatrixXd& matrix, std::string_view where) {
  constexpr double kRounding = 1e-6;  // files are written by hand, too
  if (!matrix.allFinite() || matrix.diagonal().minCoeff() < 0.0) {
    throw bad_input(where, "has a diagonal below 0 or a number that is not finite",
                    "variances of 0 or more");
  }
  const Eigen::VectorXd sd = matrix.diagonal().cwiseSqrt();
  const Eigen::VectorXd scale = (sd.array() > 0.0).select(sd.cwiseInverse(), 1.0);
  const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  if ((scaled - scaled.transpose()).cwiseAbs().maxCoeff() > kRounding) {
    throw bad_input(where, "is not symmetric", "a covariance");
  }
  if (ordered_eigenvalues(scaled).minCoeff() < -kRounding) {
    throw bad_input(where, "has a negative eigenvalue", "a covariance, positive semidefinite");
  }
}

Json noise_json(const ReadingNoise& noise, const LawSpec& spec) {
  const bool stress = spec.response == Quantity::stress;
  Json json{{"kind", noise.kind}};
  json[stress ? "absolute_Pa" : "absolute_N"] = noise.absolute;
  json["relative"] = noise.relative;
  json["column_factor"] = noise.column;
  json["lag_1_correlation"] = noise.lag_1;
  return json;
}

struct NoiseKeys {
  ReadingNoise noise;
  std::optional<double> absolute_N, absolute_Pa;
};

const Block<NoiseKeys>& reading_noise_block() {
  using K = NoiseKeys;
  const auto of_noise = [](const Key<ReadingNoise>& one) { return within(&K::noise, one); };
  static const Block<K> block(
      "reading_noise", "scatter of one reading about the law",
      {required(of_noise(key("kind", &ReadingNoise::kind,
                             one_of({"absolute", "combined", "relative_to_datum",
                                     "relative_to_model", "log", "per_row", "unknown"}),
                             "kind of the fit's noise"))),
       key("absolute_N", &K::absolute_N, number(kZeroOrMore), "a of sigma = a + b |model|"),
       key("absolute_Pa", &K::absolute_Pa, number(kZeroOrMore), "the same of a stress"),
       of_noise(key("relative", &ReadingNoise::relative, number(kZeroOrMore),
                    "b; of log the standard deviation of the logarithm")),
       of_noise(key("column_factor", &ReadingNoise::column, number(kZeroOrMore),
                    "per_row: times the data's own standard deviations")),
       of_noise(key("lag_1_correlation", &ReadingNoise::lag_1, number({.least = -1.0, .most = 1.0}),
                    "of neighbouring residuals"))});
  return block;
}

const Block<DelayedRise>& delayed_rise_block() {
  using R = DelayedRise;
  static const Block<R> block(
      "delayed_rise", "a rise of the drive within the time between two samples",
      {required(key("begin_s", &R::begin_s, number(), "the sample before it")),
       required(key("end_s", &R::end_s, number(), "the sample behind it")),
       required(key("delay_s", &R::delay_s, number(),
                    "of its centre against that of the straight line between them"))});
  return block;
}

const Block<FittedFile>& fitted_file_block() {
  using F = FittedFile;
  static const Block<F> block(
      "fitted_file", "what was fitted",
      {required(key("file", &F::name, text(), "its name")),
       key("sha256", &F::sha256, text_if_any(), "of its bytes"),
       key("samples_sha256", &F::samples_sha256, text_if_any(),
           "of the numbers alone (time, drive, response with 9 digits, SI): a copy of the "
           "recording has the same, however it is named or formatted"),
       key("readings", &F::readings, whole<int>(0, 2147483647), "how many were fitted"),
       key("from_s", &F::from_s, number(), "of a recording: earlier samples were not fitted"),
       key("to_s", &F::to_s, number(), "of a recording: later samples were not fitted"),
       key("contact", &F::contact, number(),
           "of a recording that was fitted together with others: its own contact, m or a relative "
           "length"),
       key("offset", &F::offset, number(), "and its own offset, N or Pa"),
       key("held", &F::held, list(one_of({"contact", "offset"})),
           "which of contact and offset were not estimated"),
       key("clipped_above", &F::clipped_above, number(),
           "readings from here on stood at the limit of the force cell and were censored, N or "
           "Pa"),
       key("clipped_below", &F::clipped_below, number(), "the same of the smallest reading"),
       key("drift", &F::drift, number(), "of the force cell's zero in this recording, N/s or Pa/s"),
       key("drift_origin_s", &F::drift_origin_s, number(), "when the drift is 0, s"),
       key("rises", &F::rises, list(delayed_rise_block().type()),
           "of the drive within the time between two samples")});
  return block;
}

struct UncertaintyKeys {
  std::vector<std::string> parameters;
  std::vector<Coordinate> coordinates;
  std::vector<std::vector<double>> covariance;
  LawUncertainty rest;
  NoiseKeys noise;
};

const Block<UncertaintyKeys>& uncertainty_block() {
  using K = UncertaintyKeys;
  using U = LawUncertainty;
  const auto of_rest = [](const Key<U>& one) { return within(&K::rest, one); };
  static const Block<K> block(
      "law_uncertainty", "what the fit knows about the parameters",
      {required(key("parameters", &K::parameters, list(text(1), {.fewest = 1}),
                    "keys of the uncertain parameters")),
       required(key("coordinates", &K::coordinates, list(word(kCoordinateWords)),
                    "of each: the coordinate of the covariance, p, ln p or 1/p^2")),
       required(
           key("covariance", &K::covariance, list(list(number())), "of these coordinates, SI")),
       of_rest(key("level", &U::level, number({.least = 0.0, .most = 1.0, .above = true}),
                   "confidence level of the fit's intervals")),
       of_rest(key("degrees_of_freedom", &U::degrees_of_freedom, number(kAboveZero),
                   "of Student's t; without it the size of the noise was known")),
       of_rest(key("readings_per_independent_reading", &U::readings_per_independent,
                   number({.least = 1.0}), "n / n_eff of correlated residuals")),
       required(key("noise", &K::noise, reading_noise_block().type(),
                    "scatter of one reading about the law")),
       of_rest(key("duration_s", &U::duration_s, number(kZeroOrMore),
                   "longest fitted stretch of time; 0: not known")),
       of_rest(key("data", &U::data, list(fitted_file_block().type()), "what was fitted")),
       of_rest(key("at_bound", &U::at_bound, list(text()),
                   "estimated parameters on a bound: fixed there")),
       of_rest(key("not_separable", &U::not_separable, list(text()),
                   "estimated parameters that the recordings cannot tell from a drift or a slow "
                   "branch")),
       of_rest(key("unconfirmed", &U::unconfirmed, list(text()),
                   "estimated parameters whose minimum is not trusted: not identified"))},
      {{"a confidence level below 1", [](const K& keys) -> std::optional<Fault> {
          if (keys.rest.level < 1.0) return std::nullopt;
          return Fault{"level", "is 1"};
        }}});
  return block;
}

}  // namespace

std::string_view coordinate_name(Coordinate coordinate) noexcept {
  return entry_of(kCoordinateWords, coordinate).text;
}

double to_coordinate(Coordinate coordinate, double natural) {
  if (coordinate == Coordinate::log) return std::log(natural);
  if (coordinate == Coordinate::inverse_square) return 1.0 / (natural * natural);
  return natural;
}

double from_coordinate(Coordinate coordinate, double theta) {
  if (coordinate == Coordinate::log) return std::exp(theta);
  if (coordinate == Coordinate::inverse_square) return 1.0 / std::sqrt(std::max(theta, 0.0));
  return theta;
}

double coordinate_slope(Coordinate coordinate, double natural) {
  if (coordinate == Coordinate::log) return natural;
  if (coordinate == Coordinate::inverse_square) return -0.5 * natural * natural * natural;
  return 1.0;
}

double LawUncertainty::quantile(double at_level) const {
  const double tail = 0.5 + 0.5 * at_level;
  if (!degrees_of_freedom) return base::normal_quantile(tail);
  return base::student_quantile(tail, *degrees_of_freedom);
}

Json files::to_json(const LawAdequacy& adequacy) {
  Json json{{"verdict", adequacy.verdict}, {"summary", adequacy.summary}};
  if (adequacy.residual_over_noise) {
    json["residual_over_noise"] = rounded(*adequacy.residual_over_noise, 6);
  }
  if (!adequacy.causes.empty()) json["causes"] = remarks_json(adequacy.causes);
  return json;
}

Json files::to_json(const LawUncertainty& uncertainty, const LawSpec& spec) {
  const std::vector<LawParameter> parameters = law_parameters(spec);
  Json names = Json::array(), coordinates = Json::array(), rows = Json::array();
  for (std::size_t i = 0; i < uncertainty.place.size(); ++i) {
    names.push_back(law_key(parameters[uncertainty.place[i]]));
    coordinates.push_back(coordinate_name(uncertainty.coordinate[i]));
    Json row = Json::array();
    for (std::size_t j = 0; j < uncertainty.place.size(); ++j) {
      row.push_back(
          uncertainty.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
    rows.push_back(std::move(row));
  }
  Json data = Json::array();
  for (const FittedFile& file : uncertainty.data) {
    Json entry{{"file", file.name}, {"readings", file.readings}};
    if (!file.sha256.empty()) entry["sha256"] = file.sha256;
    if (!file.samples_sha256.empty()) entry["samples_sha256"] = file.samples_sha256;
    if (file.from_s) entry["from_s"] = *file.from_s;
    if (file.to_s) entry["to_s"] = *file.to_s;
    if (file.contact) entry["contact"] = *file.contact;
    if (file.offset) entry["offset"] = *file.offset;
    if (!file.held.empty()) entry["held"] = file.held;
    if (file.clipped_above) entry["clipped_above"] = *file.clipped_above;
    if (file.clipped_below) entry["clipped_below"] = *file.clipped_below;
    if (file.drift) entry["drift"] = *file.drift;
    if (file.drift_origin_s) entry["drift_origin_s"] = *file.drift_origin_s;
    for (const DelayedRise& rise : file.rises) {
      entry["rises"].push_back(
          {{"begin_s", rise.begin_s}, {"end_s", rise.end_s}, {"delay_s", rise.delay_s}});
    }
    data.push_back(std::move(entry));
  }
  Json json{{"parameters", std::move(names)},
            {"coordinates", std::move(coordinates)},
            {"covariance", std::move(rows)},
            {"level", uncertainty.level},
            {"readings_per_independent_reading", uncertainty.readings_per_independent},
            {"noise", noise_json(uncertainty.noise, spec)},
            {"data", std::move(data)}};
  if (uncertainty.degrees_of_freedom) json["degrees_of_freedom"] = *uncertainty.degrees_of_freedom;
  if (uncertainty.duration_s > 0.0) json["duration_s"] = uncertainty.duration_s;
  if (!uncertainty.at_bound.empty()) json["at_bound"] = uncertainty.at_bound;
  if (!uncertainty.not_separable.empty()) json["not_separable"] = uncertainty.not_separable;
  if (!uncertainty.unconfirmed.empty()) json["unconfirmed"] = uncertainty.unconfirmed;
  return json;
}

const FormPtr& files::uncertainty_form() {
  return uncertainty_block().form();
}

LawUncertainty files::uncertainty_from_json(const Json& block, const LawSpec& spec,
                                            std::span<const double> values,
                                            const DocumentPlace& place) {
  const std::string& where = place.where;
  UncertaintyKeys keys = uncertainty_block().made(block, place);
  const std::vector<LawParameter> parameters = law_parameters(spec);
  LawUncertainty u = std::move(keys.rest);
  for (const std::string& name : keys.parameters) {
    u.place.push_back(place_of_key(parameters, name, where));
    if (std::count(u.place.begin(), u.place.end(), u.place.back()) == 1) continue;
    throw bad_input(where, fmt::format("'{}' twice", printable(name)), "each once");
  }
  u.coordinate = std::move(keys.coordinates);
  if (u.coordinate.size() != u.place.size()) {
    throw bad_input(where, fmt::format("{} coordinates", u.coordinate.size()),
                    fmt::format("{}, one for each parameter", u.place.size()));
  }
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    if (u.coordinate[i] == Coordinate::linear || values[u.place[i]] > 0.0) continue;
    throw bad_input(where, fmt::format("'{}' is not above 0", law_key(parameters[u.place[i]])),
                    "the coordinate linear");
  }
  u.covariance = matrix_of(keys.covariance, u.place.size(), where);
  require_covariance(u.covariance, where);
  u.noise = std::move(keys.noise.noise);
  const bool stress = spec.response == Quantity::stress;
  u.noise.absolute = (stress ? keys.noise.absolute_Pa : keys.noise.absolute_N).value_or(0.0);
  return u;
}

}  // namespace tpm
