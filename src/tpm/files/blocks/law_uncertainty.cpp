#include "tpmkit/law_uncertainty.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/distributions.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm {
using namespace base;
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
  throw bad_input(where, fmt::format("unknown parameter '{}'", printable(key)),
                  "a parameter of the law");
}

Eigen::MatrixXd matrix_of(const Json& rows, std::size_t size, std::string_view where) {
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
    for (std::size_t c = 0; c < size; ++c) {
      matrix(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = rows[r][c].get<double>();
    }
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
  if (symmetric_modes(scaled).values.minCoeff() < -kRounding) {
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

ReadingNoise noise_of_block(const Json& json, const LawSpec& spec) {
  const bool stress = spec.response == Quantity::stress;
  ReadingNoise noise;
  noise.kind = json.at("kind").get<std::string>();
  noise.absolute = json.value(stress ? "absolute_Pa" : "absolute_N", 0.0);
  noise.relative = json.value("relative", 0.0);
  noise.column = json.value("column_factor", 1.0);
  noise.lag_1 = json.value("lag_1_correlation", 0.0);
  return noise;
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
  Json json{{"verdict", adequacy.verdict}, {"words", adequacy.words}};
  if (adequacy.residual_over_noise) {
    json["residual_over_noise"] = rounded(*adequacy.residual_over_noise, 6);
  }
  if (!adequacy.causes.empty()) json["causes"] = adequacy.causes;
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
    if (file.from_s) entry["from_s"] = *file.from_s;
    if (file.to_s) entry["to_s"] = *file.to_s;
    if (file.contact) entry["contact"] = *file.contact;
    if (file.offset) entry["offset"] = *file.offset;
    if (!file.held.empty()) entry["held"] = file.held;
    if (file.clipped_above) entry["clipped_above"] = *file.clipped_above;
    if (file.clipped_below) entry["clipped_below"] = *file.clipped_below;
    if (file.drift) entry["drift"] = *file.drift;
    if (file.drift_origin_s) entry["drift_origin_s"] = *file.drift_origin_s;
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
  return json;
}

LawUncertainty files::uncertainty_from_json(const Json& block, const LawSpec& spec,
                                            std::span<const double> values,
                                            std::string_view where) {
  const std::vector<LawParameter> parameters = law_parameters(spec);
  LawUncertainty u;
  for (const Json& name : block.at("parameters")) {
    u.place.push_back(place_of_key(parameters, name.get<std::string>(), where));
    if (std::count(u.place.begin(), u.place.end(), u.place.back()) == 1) continue;
    throw bad_input(where, fmt::format("'{}' twice", name.get<std::string>()), "each once");
  }
  for (const Json& word : block.at("coordinates")) {
    u.coordinate.push_back(
        parse_word(kCoordinateWords, "coordinates", word.get<std::string>(), where));
  }
  if (u.coordinate.size() != u.place.size()) {
    throw bad_input(where, fmt::format("{} coordinates", u.coordinate.size()),
                    fmt::format("{}, one for each parameter", u.place.size()));
  }
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    if (u.coordinate[i] == Coordinate::linear || values[u.place[i]] > 0.0) continue;
    throw bad_input(where, fmt::format("'{}' is not above 0", law_key(parameters[u.place[i]])),
                    "the coordinate linear");
  }
  u.covariance = matrix_of(block.at("covariance"), u.place.size(), where);
  require_covariance(u.covariance, where);
  u.level = block.value("level", u.level);
  u.readings_per_independent = block.value("readings_per_independent_reading", 1.0);
  if (block.contains("degrees_of_freedom")) {
    u.degrees_of_freedom = block.at("degrees_of_freedom").get<double>();
  }
  u.duration_s = block.value("duration_s", 0.0);
  u.noise = noise_of_block(block.at("noise"), spec);
  for (const Json& file : block.value("data", Json::array())) {
    FittedFile entry;
    entry.name = file.at("file").get<std::string>();
    entry.sha256 = file.value("sha256", "");
    entry.readings = file.value("readings", 0);
    const auto set = [&file](std::optional<double>& value, const char* key) {
      if (file.contains(key)) value = file.at(key).get<double>();
    };
    set(entry.from_s, "from_s");
    set(entry.to_s, "to_s");
    set(entry.contact, "contact");
    set(entry.offset, "offset");
    entry.held = file.value("held", std::vector<std::string>{});
    set(entry.clipped_above, "clipped_above");
    set(entry.clipped_below, "clipped_below");
    set(entry.drift, "drift");
    set(entry.drift_origin_s, "drift_origin_s");
    u.data.push_back(std::move(entry));
  }
  u.at_bound = block.value("at_bound", std::vector<std::string>{});
  u.not_separable = block.value("not_separable", std::vector<std::string>{});
  return u;
}

}  // namespace tpm
