#include "tpm/fit/predict/organ_material.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/enum_names.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"
#include "tpm/fit/predict/budget_parts.hpp"
#include "tpm/fit/predict/organ_bonds.hpp"
#include "tpm/fit/predict/organ_material_parts.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr double kBoundFactor = 1e4;        // of moduli about their start
constexpr double kTimeFactor = 100.0;       // of relaxation times
constexpr double kStiffeningFactor = 20.0;  // of the deepest depth
constexpr double kUnit_Pa = 1e3;
constexpr double kAsked = 1e-3;  // of the peak: a unit of the residuals

constexpr auto kIntervalsWords =
    std::to_array<Word<MaterialIntervals>>({{MaterialIntervals::law, "law"},
                                            {MaterialIntervals::readings, "readings"},
                                            {MaterialIntervals::profiles, "profiles"}});

/// The relaxation of a law in parallel form, and whether its kernel or tension bends.
struct Relaxing {
  Prony prony;
  double tension = 0.0;  ///< elastic, N/m
  bool bends = false;
};

Relaxing relaxing_of(const LawFile& law) {
  const LawSpec& spec = law.spec;
  const bool depth =
      spec.drive == Quantity::indentation_depth && spec.response == Quantity::contact_force;
  if (!depth || spec.fractional != Fractional::none) {
    throw bad_input(fmt::format("law {}", law_name(spec)), "cannot be put on an organ",
                    "a contact force over an indentation depth, relaxing by branches");
  }
  Relaxing r;
  r.bends = depends_on_reference(spec);
  KelvinChain chain;
  const std::vector<LawParameter> table = law_parameters(spec);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::string& name = table[i].name;
    const double value = law.values[i];
    if (name == "k_inf") r.prony.k_inf = value;
    if (name == "k0") chain.k0 = value;
    if (name == "k_tension") r.tension = value;
    if (name.starts_with("kc")) chain.k.push_back(value);
    if (name.starts_with('T')) chain.T_s.push_back(value);
    if (name.starts_with("tau")) r.prony.tau_s.push_back(value);
    if (name.size() > 1 && name[0] == 'k' && name[1] >= '1' && name[1] <= '9') {
      r.prony.k.push_back(value);
    }
  }
  if (spec.form == BranchForm::series && spec.branches > 0) r.prony = to_parallel(chain);
  if (spec.form == BranchForm::series && spec.branches == 0) r.prony.k_inf = chain.k0;
  return r;
}

/// An organ whose bonds have the fitted form of material.
class FittedOrgan {
 public:
  FittedOrgan(const Json& scene, std::string_view where, const std::filesystem::path& folder,
              const BondMaterial& unit);

  [[nodiscard]] const OrganModel& model() const { return *organ_.model; }
  /// The scene with another material.
  [[nodiscard]] Json scene_with(const BondMaterial& material) const;

 private:
  Json scene_;
  Json material_before_ = Json::object();
  SceneOrgan organ_;
};

FittedOrgan::FittedOrgan(const Json& scene, std::string_view where,
                         const std::filesystem::path& folder, const BondMaterial& unit)
    : scene_(with_mesh_listed(scene, where, folder)) {
  if (scene_.contains("material")) material_before_ = scene_.at("material");
  scene_["bonds"]["lateral"] = "relaxing";
  scene_["material"] = material_block(unit, material_before_);
  organ_ = organ_of_scene(scene_, where, folder);
}

Json FittedOrgan::scene_with(const BondMaterial& material) const {
  Json scene = scene_;
  scene["material"] = material_block(material, material_before_);
  return scene;
}

/// Organ less law over the motions, in thousandths of the peak, by the parameters of the bonds.
class OrganLessLaw final : public ResidualFunction {
 public:
  OrganLessLaw(const OrganModel& model, const std::vector<MaterialMotion>& motions,
               const OrganMaterial& target, FittedBonds bonds)
      : model_(model), motions_(motions), target_(target), bonds_(std::move(bonds)) {}

  [[nodiscard]] const FittedBonds& bonds() const { return bonds_; }

  /// Along every motion.
  [[nodiscard]] std::vector<std::vector<double>> forces(const BondMaterial& m) const {
    return mapped<std::vector<double>>(
        motions_, [&](const MaterialMotion& motion) { return force(m, motion.protocol, motion); });
  }
  [[nodiscard]] std::vector<double> force(const BondMaterial& m, const Protocol& protocol,
                                          const MaterialMotion& motion) const {
    const Response response =
        model_.respond(protocol, motion.time_s, FittedBonds::values(model_, m), Want::values);
    return {response.value.begin(), response.value.end()};
  }

  [[nodiscard]] Eigen::Index residual_count() const override {
    Eigen::Index rows = 0;
    for (const MaterialMotion& motion : motions_) rows += std::ssize(motion.time_s);
    return rows;
  }

  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    const std::vector<double> values = FittedBonds::values(model_, bonds_.material(natural));
    Eigen::MatrixXd along = bonds_.along(model_);
    if (jacobian == nullptr) along.resize(along.rows(), 0);
    const double unit = kAsked * target_.peak_N;
    residual.resize(residual_count());
    if (jacobian != nullptr) jacobian->resize(residual_count(), along.cols());
    Eigen::Index row = 0;
    const std::string buckled = gave_up([&] {
      for (std::size_t i = 0; i < motions_.size(); ++i) {
        const Response response =
            model_.respond_along(motions_[i].protocol, motions_[i].time_s, values, along);
        const std::vector<double>& law = target_.courses[i].law_N;
        const auto n = std::ssize(law);
        residual.segment(row, n) = (response.value - Eigen::VectorXd::Map(law.data(), n)) / unit;
        if (jacobian != nullptr) jacobian->middleRows(row, n) = response.sensitivity / unit;
        row += n;
      }
    });
    return buckled.empty() && residual.allFinite();  // the search turns away
  }

 private:
  const OrganModel& model_;
  const std::vector<MaterialMotion>& motions_;
  const OrganMaterial& target_;
  FittedBonds bonds_;
};

FitParameter about(std::string name, Unit unit, double start, double factor) {
  FitParameter p;
  p.name = std::move(name);
  p.unit = unit;
  p.scale = Scale::log;
  p.start = start;
  p.lower = start / factor;
  p.upper = start * factor;
  return p;
}

std::vector<FitParameter> fitted_parameters(const BondMaterial& start, bool fit_times) {
  const Unit modulus = shown_unit(Dimension::stress);
  const double whole = start.instantaneous_Pa();
  std::vector<FitParameter> parameters{
      about("Einf", modulus, std::max(start.equilibrium_Pa, whole / kBoundFactor), kBoundFactor)};
  int number = 0;
  for (const auto& branch : start.branches) {
    parameters.push_back(
        about(fmt::format("g{}", ++number), modulus, branch.modulus_Pa, kBoundFactor));
  }
  number = 0;
  for (const auto& branch : start.branches) {
    if (!fit_times) break;
    parameters.push_back(about(fmt::format("tau{}", ++number), shown_unit(Dimension::time),
                               branch.relaxation_time_s, kTimeFactor));
  }
  for (std::size_t k = 0; k < start.potential.parameters().size(); ++k) {
    const MaterialParameter& p = start.potential.parameters()[k];
    parameters.push_back(
        about(p.name, shown_unit(p.dimension), start.potential.values()[k], kStiffeningFactor));
  }
  return parameters;
}

/// Derivatives of the law's force by the coordinates of its uncertainty, along all motions; those
/// that belong to the recording and not to the material are 0.
Eigen::MatrixXd law_slopes(const LawFile& law, const std::vector<MaterialMotion>& motions,
                           Eigen::Index rows) {
  const LawModel model(law.spec);
  const LawUncertainty& u = *law.uncertainty;
  const LawFile plain = at_surface(law);
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(rows, std::ssize(u.place));
  Eigen::Index row = 0;
  for (const MaterialMotion& motion : motions) {
    const Response r =
        model.respond(motion.protocol, motion.time_s, plain.values, Want::values_and_sensitivity);
    for (std::size_t i = 0; i < u.place.size(); ++i) {
      if (model.law_parameters()[u.place[i]].nuisance) continue;
      slopes.block(row, static_cast<Eigen::Index>(i), r.value.size(), 1) =
          r.sensitivity.col(static_cast<Eigen::Index>(u.place[i])) *
          coordinate_slope(u.coordinate[i], law.values[u.place[i]]);
    }
    row += r.value.size();
  }
  return slopes;
}

/// Derivatives of the bonds by the law's parameters, and the intervals that follow from its
/// covariance where the readings give none.
void carry_uncertainty(OrganMaterial& m, const OrganLessLaw& function, const LawFile& law,
                       const std::vector<MaterialMotion>& motions) {
  const auto natural = mapped<double>(m.parameters, &OrganMaterialParameter::value);
  if (law.adequacy && !law.adequacy->is_adequate()) {
    m.remarks.push_back({"law_in_doubt", law.adequacy->summary});
  }
  if (!law.uncertainty) {
    if (!m.readings) {
      m.remarks.push_back({"no_uncertainty", "the law carries no uncertainty: no intervals"});
    }
    return;
  }
  Eigen::VectorXd residual;
  RowMatrix jacobian;
  if (!function.evaluate(natural, residual, &jacobian)) return;
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < natural.size(); ++i) {
    const FitParameter& p = m.parameters[i].parameter;
    jacobian.col(static_cast<Eigen::Index>(i)) *=
        kAsked * m.peak_N * p.natural_slope(p.theta(natural[i]));
    if (!m.parameters[i].at_bound) free.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::MatrixXd j = jacobian(Eigen::all, free);
  const Eigen::MatrixXd gram = j.transpose() * j;
  const Eigen::MatrixXd slopes = law_slopes(law, motions, jacobian.rows());
  m.follows = Eigen::MatrixXd::Zero(std::ssize(natural), slopes.cols());
  const Eigen::MatrixXd d = solve_symmetric(gram, j.transpose() * slopes);
  m.follows(free, Eigen::all) = d;
  m.covariance = m.follows * law.uncertainty->covariance * m.follows.transpose();
  m.quantile = law.uncertainty->quantile();
  if (m.readings) return;
  m.level = law.uncertainty->level;
  for (const Eigen::Index i : free) {
    OrganMaterialParameter& p = m.parameters[static_cast<std::size_t>(i)];
    const double theta = p.parameter.theta(p.value);
    const double half = m.quantile * std::sqrt(std::max(m.covariance(i, i), 0.0));
    p.lower = p.parameter.natural(theta - half);
    p.upper = p.parameter.natural(theta + half);
  }
}

}  // namespace

std::string_view intervals_name(MaterialIntervals intervals) noexcept {
  return entry_of(kIntervalsWords, intervals).text;
}

MaterialIntervals parse_intervals(std::string_view text, std::string_view where) {
  return parse_word(kIntervalsWords, "kind of intervals", text, where);
}

namespace {

OrganMaterial law_along(const LawFile& law, const std::vector<MaterialMotion>& motions) {
  OrganMaterial m;
  m.law = law_name(law.spec);
  m.fitted_law = law;
  const LawFile plain = at_surface(law);
  std::vector<std::string> names;
  for (const MaterialMotion& motion : motions) {
    names.push_back(motion.name.empty() ? "the protocol" : motion.name);
    MaterialCourse& course = m.courses.emplace_back();
    course.name = motion.name;
    course.time_s = motion.time_s;
    course.measured_N = motion.measured_N;
    course.provenance = motion.provenance;
    course.by_law = course.by_organ = motion.placement;
    for (const double t : course.time_s) course.depth_m.push_back(value_at(motion.protocol, t));
    course.law_N = law_stage(plain, motion.protocol, course.time_s).force_N;
    m.peak_N = std::max(m.peak_N, *std::max_element(course.law_N.begin(), course.law_N.end()));
  }
  m.motion = fmt::format("along {}", fmt::join(names, ", "));
  if (m.peak_N > 0.0) return m;
  throw bad_input(fmt::format("law {}", m.law), "answers the motion without a force",
                  "a motion that presses");
}

/// All bonds relax by the law's normalised function; instantaneous moduli of 1 kPa.
BondMaterial unit_material(const Relaxing& relaxing) {
  BondMaterial unit;
  unit.lateral = LateralBond::relaxing;
  double whole = relaxing.prony.k_inf + relaxing.tension;
  for (const double k : relaxing.prony.k) whole += k;
  unit.equilibrium_Pa = kUnit_Pa * (relaxing.prony.k_inf + relaxing.tension) / whole;
  for (std::size_t j = 0; j < relaxing.prony.k.size(); ++j) {
    if (!(relaxing.prony.k[j] > 0.0)) continue;
    unit.branches.push_back({kUnit_Pa * relaxing.prony.k[j] / whole, relaxing.prony.tau_s[j]});
  }
  unit.lateral_Pa = unit.instantaneous_Pa();  // as FittedBonds keeps it
  return unit;
}

/// The factor on all moduli, and with it on the force, that comes nearest to the law.
BondMaterial by_correspondence(OrganMaterial& m, const OrganLessLaw& organ, BondMaterial unit,
                               std::string_view where) {
  const std::vector<std::vector<double>> forces = organ.forces(unit);
  double product = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < forces.size(); ++k) {
    m.courses[k].correspondence_N = forces[k];
    for (std::size_t i = 0; i < forces[k].size(); ++i) {
      product += forces[k][i] * m.courses[k].law_N[i];
      squares += forces[k][i] * forces[k][i];
    }
  }
  const double factor = product / squares;
  if (!(factor > 0.0) || !std::isfinite(factor)) {
    throw Error(ExitCode::numerical, std::string(where), "the organ does not answer the motion",
                "a contact sphere that is not fixed");
  }
  for (MaterialCourse& course : m.courses) {
    for (double& f : course.correspondence_N) f *= factor;
  }
  unit.equilibrium_Pa *= factor;
  for (auto& branch : unit.branches) branch.modulus_Pa *= factor;
  unit.lateral_Pa *= factor;
  return unit;
}

/// Finds the material near a start whose force is the law's.
void fit_to_law(OrganMaterial& m, const OrganLessLaw& function,
                const std::vector<FitParameter>& parameters, std::string_view where) {
  const Minimum best = minimise_near(function, parameters, start_values(parameters));
  if (!best.usable) {
    throw Error(ExitCode::numerical, std::string(where), "the organ's material was not found",
                "an organ that stands at the depths of the motion");
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    m.parameters.push_back(
        {parameters[i], parameters[i].start, best.natural[i], best.natural[i], {}, {}, false});
  }
  if (!best.converged) m.remarks.push_back({"not_converged", "the fit ended before it converged"});
}

/// Goes on from there to the readings themselves.
void go_on_to_readings(OrganMaterial& m, const OrganLessLaw& function, const OrganModel& model,
                       const std::vector<MaterialMotion>& motions, bool profiles) {
  std::vector<FitParameter> parameters;
  for (const OrganMaterialParameter& p : m.parameters) {
    parameters.push_back(p.parameter);
    parameters.back().start = p.by_law;
  }
  const auto recordings = mapped<OrganReadings>(motions, [&](const MaterialMotion& motion) {
    const auto [contact, offset] = motion.placement;
    OrganReadings r{*motion.drive, motion.time_s, motion.measured_N, contact, offset};
    for (double& f : r.force_N) f += offset;
    return r;
  });
  ReadingsFit readings = fit_to_readings(model, function.bonds(), parameters, recordings, profiles);
  const std::vector<ParameterResult>& found = readings.fit.parameters;
  for (std::size_t i = 0; i < m.parameters.size(); ++i) {
    m.parameters[i].value = found[i].estimate;
    m.parameters[i].lower = found[i].lower;
    m.parameters[i].upper = found[i].upper;
  }
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const std::size_t place = m.parameters.size() + 2 * i;
    m.courses[i].by_organ = {found[place].estimate, found[place + 1].estimate};
    for (const std::size_t k : {place, place + 1}) {
      if (!found[k].at_lower_bound && !found[k].at_upper_bound) continue;
      m.remarks.push_back({"parameter_at_bound", fmt::format("{} stands on a bound of its search",
                                                             found[k].parameter.name)});
    }
  }
  if (!readings.fit.best.converged) {
    m.remarks.push_back(
        {"readings_not_converged", "the fit to the readings ended before it converged"});
  }
  m.level = readings.level;
  m.readings = std::move(readings);
}

/// Response of the organ with the material that was found.
void answer(OrganMaterial& m, const OrganLessLaw& function,
            const std::vector<MaterialMotion>& motions) {
  std::vector<double> natural;
  for (OrganMaterialParameter& p : m.parameters) {
    natural.push_back(p.value);
    p.at_bound = p.parameter.at_lower(p.value) || p.parameter.at_upper(p.value);
    if (!p.at_bound) continue;
    m.remarks.push_back({"parameter_at_bound",
                         fmt::format("{} stands on a bound of its search", p.parameter.name)});
  }
  m.material = function.bonds().material(natural);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    MaterialCourse& course = m.courses[i];
    const MaterialMotion& motion = motions[i];
    const Protocol pressed =
        m.readings ? beyond_contact(*motion.drive, course.by_organ.contact_m) : motion.protocol;
    course.organ_N = function.force(m.material, pressed, motion);
    for (double& f : course.organ_N) f += course.by_organ.offset_N - course.by_law.offset_N;
  }
}

void require_recordings(const std::vector<MaterialMotion>& motions) {
  for (const MaterialMotion& motion : motions) {
    if (motion.drive) continue;
    throw bad_input("material", "intervals of readings along a protocol",
                    "the recording that was fitted, or intervals of the law");
  }
}

}  // namespace

OrganMaterial put_on_organ(const LawFile& law, const std::vector<MaterialMotion>& motions,
                           const Json& scene, std::string_view where,
                           const std::filesystem::path& folder,
                           const OrganMaterialOptions& options) {
  const Relaxing relaxing = relaxing_of(law);
  if (options.intervals != MaterialIntervals::law) require_recordings(motions);
  OrganMaterial m = law_along(law, motions);
  m.intervals = options.intervals;
  const BondMaterial unit = unit_material(relaxing);
  const FittedOrgan plain(scene, where, folder, unit);
  const OrganLessLaw first(plain.model(), motions, m, FittedBonds(unit, false));
  BondMaterial start = by_correspondence(m, first, unit, where);
  double deepest = 0.0;
  for (const MaterialMotion& motion : motions) {
    deepest = std::max(deepest, motion.protocol.peak());
  }
  if (options.stiffens.value_or(relaxing.bends)) {
    start.potential = elongation_function("cubic", {deepest});
    if (options.branches_stiffen) start.kernel = start.potential;
  }

  const FittedOrgan organ(scene, where, folder, start);
  const OrganLessLaw function(organ.model(), motions, m, FittedBonds(start, options.fit_times));
  fit_to_law(m, function, fitted_parameters(start, options.fit_times), where);
  if (options.intervals != MaterialIntervals::law) {
    go_on_to_readings(m, function, organ.model(), motions,
                      options.intervals == MaterialIntervals::profiles);
  }
  answer(m, function, motions);
  carry_uncertainty(m, function, law, motions);
  compare(m, motions);
  m.scene = organ.scene_with(m.material);
  add_protocol_and_session(m);
  return m;
}

}  // namespace tpm::fit
