#include "tpm/fit/predict/organ_prediction.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/data/straight_pieces.hpp"
#include "tpm/files/blocks/law_json.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kContactShift = 1e-3;  // of the largest depth, for the derivative by the contact

/// Places of the times within a protocol.
std::vector<Eigen::Index> answered(const Protocol& protocol, std::span<const double> times_s) {
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    if (times_s[i] <= protocol.end_s()) places.push_back(static_cast<Eigen::Index>(i));
  }
  return places;
}

struct Placed {
  double contact, offset;
};
Placed placed(std::span<const double> parameters) {
  return {parameters[parameters.size() - 2], parameters.back()};
}

}  // namespace

OrganOfLaw::OrganOfLaw(Json scene, SceneOrgan organ, FittedBonds bonds, std::vector<double> natural,
                       Eigen::MatrixXd follows, LawFile law)
    : scene_(std::move(scene)),
      organ_(std::move(organ)),
      bonds_(std::move(bonds)),
      natural_(std::move(natural)),
      follows_(std::move(follows)),
      law_(std::move(law)),
      law_model_(law_.spec) {}

OrganOfLaw OrganOfLaw::at_tolerance(double tolerance) const {
  SceneOrgan organ = organ_;
  organ.model = std::make_shared<OrganModel>(organ_.tissue, tolerance);
  return with(std::move(organ));
}

OrganOfLaw OrganOfLaw::with(SceneOrgan organ) const {
  return {scene_, std::move(organ), bonds_, natural_, follows_, law_};
}

std::vector<double> OrganOfLaw::natural_at(std::span<const double> parameters) const {
  const LawUncertainty& u = *law_.uncertainty;
  Eigen::VectorXd moved(std::ssize(u.place));
  for (std::size_t k = 0; k < u.place.size(); ++k) {
    const std::size_t place = u.place[k];
    moved[static_cast<Eigen::Index>(k)] = to_coordinate(u.coordinate[k], parameters[place]) -
                                          to_coordinate(u.coordinate[k], law_.values[place]);
  }
  const Eigen::VectorXd factor = (follows_ * moved).array().exp();
  std::vector<double> natural = natural_;
  for (std::size_t i = 0; i < natural.size(); ++i) {
    natural[i] *= factor[static_cast<Eigen::Index>(i)];
  }
  return natural;
}

Response OrganOfLaw::respond(const Protocol& protocol, std::span<const double> times_s,
                             std::span<const double> parameters, Want want) const {
  const auto [contact, offset] = placed(parameters);
  const bool load = protocol.drive() == Drive::force;
  if (load && (contact != 0.0 || offset != 0.0)) {
    throw bad_input("prediction", "an organ under a load with a contact point and an offset",
                    "the placement surface");
  }
  const std::vector<Eigen::Index> places = answered(protocol, times_s);
  std::vector<double> times;
  for (const Eigen::Index i : places) times.push_back(times_s[static_cast<std::size_t>(i)]);
  const std::vector<double> natural = natural_at(parameters);
  const OrganModel& model = *organ_.model;
  const std::vector<double> values = FittedBonds::values(model, bonds_.material(natural));
  const bool slopes = want == Want::values_and_sensitivity;
  // Derivatives by the logarithms of the bonds' parameters.
  Eigen::MatrixXd along = bonds_.along(model);
  for (Eigen::Index k = 0; k < along.cols(); ++k) {
    along.col(k) *= natural[static_cast<std::size_t>(k)];
  }
  if (!slopes) along.resize(along.rows(), 0);
  const Response run = model.respond_along(load ? protocol : beyond_contact(protocol, contact),
                                           times, values, along);

  Response response;
  const auto n = std::ssize(times_s);
  response.value.setConstant(n, std::numeric_limits<double>::quiet_NaN());
  response.value(places) = run.value.array() + offset;
  if (!slopes) return response;
  const auto count = std::ssize(parameters);
  response.sensitivity.setConstant(n, count, std::numeric_limits<double>::quiet_NaN());
  response.sensitivity(places, Eigen::all).setZero();
  const LawUncertainty& u = *law_.uncertainty;
  const Eigen::MatrixXd of_law = run.sensitivity * follows_;
  for (std::size_t k = 0; k < u.place.size(); ++k) {
    const auto place = static_cast<Eigen::Index>(u.place[k]);
    response.sensitivity(places, place) = of_law.col(static_cast<Eigen::Index>(k)) /
                                          coordinate_slope(u.coordinate[k], parameters[u.place[k]]);
  }
  if (load) return response;
  response.sensitivity(places, count - 1).setOnes();
  const double h = kContactShift * protocol.peak();
  const auto beside = [&](double c) {
    return model.respond(beyond_contact(protocol, c), times, values, Want::values).value;
  };
  response.sensitivity(places, count - 2) = (beside(contact + h) - beside(contact - h)) / (2.0 * h);
  return response;
}

namespace {

const LawUncertainty& carried_by(const LawFile& law, std::string_view where) {
  if (law.uncertainty) return *law.uncertainty;
  throw bad_input(std::string(where), "the law that was put on the organ carries no uncertainty",
                  "a law.json that tpm fit has written, put on the organ by tpm material");
}

OrganOfLaw assembled(const Json& scene, const std::vector<std::string>& names,
                     std::vector<double> natural, Eigen::MatrixXd follows, LawFile law,
                     std::string_view where) {
  SceneOrgan organ = organ_of_scene(scene, where, {});
  const bool times = std::find(names.begin(), names.end(), "tau1") != names.end();
  FittedBonds bonds(organ.tissue->materials.materials.front(), times);
  if (bonds.names() != names) {
    throw bad_input(
        fmt::format("{}: /uncertainty/parameters", where),
        fmt::format("not the parameters of the scene's bonds: {}", fmt::join(names, ", ")),
        fmt::format("{}", fmt::join(bonds.names(), ", ")));
  }
  return {scene,         std::move(organ), std::move(bonds), std::move(natural), std::move(follows),
          std::move(law)};
}

/// A value of a material.json. Throws Error(bad_input) that names what is missing.
const Json& part(const Json& document, const char* pointer, std::string_view where) {
  const Json::json_pointer place(pointer);
  if (document.contains(place)) return document.at(place);
  throw bad_input(fmt::format("{}: {}", where, pointer), "missing",
                  "a material.json that tpm material has written");
}

Eigen::MatrixXd matrix_of(const Json& rows, Eigen::Index height, Eigen::Index width,
                          std::string_view where) {
  Eigen::MatrixXd matrix(height, width);
  const auto wrong = [&] {
    return bad_input(fmt::format("{}: /uncertainty/follows_law", where),
                     "not a matrix of that size",
                     fmt::format("{} rows of {} numbers", height, width));
  };
  if (!rows.is_array() || std::ssize(rows) != height) throw wrong();
  for (Eigen::Index i = 0; i < height; ++i) {
    const Json& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || std::ssize(row) != width) throw wrong();
    for (Eigen::Index k = 0; k < width; ++k) {
      const Json& entry = row[static_cast<std::size_t>(k)];
      if (!entry.is_number()) throw wrong();
      matrix(i, k) = entry.get<double>();
    }
  }
  return matrix;
}

}  // namespace

OrganOfLaw organ_of_law(const OrganMaterial& m, std::string_view where) {
  (void)carried_by(m.fitted_law, where);
  std::vector<std::string> names;
  std::vector<double> natural;
  for (const OrganMaterialParameter& p : m.parameters) {
    names.push_back(p.parameter.name);
    natural.push_back(p.value);
  }
  return assembled(m.scene, names, std::move(natural), m.follows, m.fitted_law, where);
}

OrganOfLaw organ_of_law(const Json& material, std::string_view where) {
  LawFile law = law_from_json(part(material, "/fitted_law", where), where);
  const LawUncertainty& u = carried_by(law, where);
  const Json& order = part(material, "/uncertainty/parameters", where);
  const Json& parameters = part(material, "/parameters", where);
  std::vector<std::string> names;
  std::vector<double> natural;
  for (const Json& entry : order) {
    const std::string key = entry.is_string() ? entry.get<std::string>() : std::string();
    const Json& value = part(parameters, ("/" + key + "/value").c_str(), where);
    if (!value.is_number() || !(value.get<double>() > 0.0)) {
      throw bad_input(fmt::format("{}: /parameters/{}", where, key), "not a value above 0",
                      "a material.json that tpm material has written");
    }
    natural.push_back(value.get<double>());
    names.push_back(key.substr(0, key.rfind('_')));
  }
  Eigen::MatrixXd follows = matrix_of(part(material, "/uncertainty/follows_law", where),
                                      std::ssize(names), std::ssize(u.place), where);
  Json scene = part(material, "/scene", where);
  return assembled(std::move(scene), names, std::move(natural), std::move(follows), std::move(law),
                   where);
}

bool is_organ_document(const Json& document) {
  return document.is_object() && (document.contains("organ") || document.contains("scene"));
}

OrganOfLaw read_organ_of_law(const std::filesystem::path& path) {
  const Json document = read_json(path);
  if (document.contains("scene")) return organ_of_law(document, path.string());
  const std::filesystem::path beside = path.parent_path() / "material.json";
  if (!std::filesystem::exists(beside)) {
    throw bad_input(path.string(), "a scene without the material.json of its fit beside it",
                    "a scene.json in the folder that tpm material has written");
  }
  const Json material = read_json(beside);
  const Json& fitted = part(material, "/scene", beside.string());
  for (const char* key : {"organ", "bonds", "material", "anchors", "sliders", "contacts"}) {
    const bool same = document.contains(key) == fitted.contains(key) &&
                      (!document.contains(key) || document.at(key) == fitted.at(key));
    if (same) continue;
    throw bad_input(fmt::format("{}: /{}", path.string(), key),
                    fmt::format("differs from the scene that was fitted ({})", beside.string()),
                    "the tissue that tpm material has written");
  }
  return organ_of_law(material, beside.string());
}

namespace {

/// Contact and offset with which the organ comes nearest to a recording in least squares.
OwnPlacement place_on_organ(const OrganOfLaw& organ, const PreparedRecording& recording,
                            const Protocol& motion, const PredictionOptions& held) {
  constexpr int kMostSteps = 12;
  constexpr std::size_t kMostPlacedTimes = 200;
  constexpr double kSmall = 1e-6;  // of the largest depth
  OwnPlacement own = place_recording(organ.law(), recording, held);
  const Recording& r = recording.recording;
  std::vector<double> times, observed;
  const std::size_t stride = 1 + r.time_s.size() / kMostPlacedTimes;
  for (std::size_t i = 0; i < r.time_s.size(); i += stride) {
    if (r.time_s[i] < recording.from_s || r.time_s[i] > motion.end_s()) continue;
    times.push_back(r.time_s[i]);
    observed.push_back(r.response[i]);
  }
  const std::vector<Eigen::Index> columns(own.place.begin(), own.place.end());
  const Eigen::Map<const Eigen::VectorXd> target(observed.data(), std::ssize(observed));
  for (int step = 0; step < kMostSteps; ++step) {
    const Response response =
        organ.respond(motion, times, own.values, Want::values_and_sensitivity);
    const Eigen::MatrixXd slopes = response.sensitivity(Eigen::all, columns);
    const Eigen::VectorXd change =
        (slopes.transpose() * slopes).ldlt().solve(slopes.transpose() * (target - response.value));
    double moved = 0.0;
    for (std::size_t i = 0; i < own.place.size(); ++i) {
      const double by = change[static_cast<Eigen::Index>(i)];
      own.values[own.place[i]] += by;
      if (own.place[i] + 2 == own.values.size()) moved = std::abs(by);
    }
    if (moved <= kSmall * motion.peak()) return own;
  }
  throw Error(ExitCode::numerical, fmt::format("recording '{}'", recording.name),
              "the contact point of the organ was not found", "--placement fitted or surface");
}

LawPrediction named(LawPrediction p, const OrganOfLaw& organ) {
  p.organ_spheres = organ.spheres();
  p.remarks.push_back(
      {"organ_less_law_not_in_band",
       "the band is that of the law carried over to the organ: what the organ cannot reproduce of "
       "the law is not in it"});
  return p;
}

}  // namespace

LawPrediction predict_organ(const OrganOfLaw& organ, const Protocol& protocol,
                            std::span<const double> times_s, const PredictionOptions& options) {
  return named(predict_by(organ, organ.law(), protocol, times_s, options), organ);
}

LawPrediction predict_organ(const OrganOfLaw& organ, const PreparedRecording& recording,
                            const PredictionOptions& options) {
  const Recording& r = recording.recording;
  std::vector<double> time_s, depth_m;
  for (std::size_t i = 0; i < r.time_s.size() && r.time_s[i] <= recording.to_s; ++i) {
    time_s.push_back(r.time_s[i]);
    depth_m.push_back(r.drive[i]);
  }
  Protocol whole = measured_history(Drive::displacement, time_s, depth_m);
  whole.set_equilibrium_at_start(true);
  const Protocol motion = followed_by_organ(whole, placed(organ.law().values).contact);
  return named(predict_recording_by(
                   organ, organ.law(), recording, motion,
                   [&] { return place_on_organ(organ, recording, motion, options); }, options),
               organ);
}

}  // namespace tpm::fit
