#include "tpm/study/organ_material.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/core/dense_algebra.hpp"
#include "tpm/core/text.hpp"
#include "tpm/fit/least_squares.hpp"
#include "tpm/study/budget_parts.hpp"
#include "tpm/study/organ_bonds.hpp"
#include "tpm/study/organ_material_parts.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm {
namespace {

constexpr double kMotionWithin = 2e-3;      // of the depth
constexpr std::size_t kMostTimes = 200;     // that the forces are compared at
constexpr double kBoundFactor = 1e4;        // of moduli about their start
constexpr double kTimeFactor = 100.0;       // of relaxation times
constexpr double kStiffeningFactor = 20.0;  // of the deepest depth
constexpr double kUnit_Pa = 1e3;
constexpr double kAsked = 1e-3;  // of the peak: a unit of the residuals

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

/// Places of the knots that keep a path within a distance (Douglas and Peucker 1973), of values
/// at a time.
void keep_corners(const std::vector<double>& t, const std::vector<double>& u, std::size_t from,
                  std::size_t to, double within, std::vector<bool>& kept) {
  double furthest = within;
  std::size_t corner = from;
  for (std::size_t i = from + 1; i < to; ++i) {
    const double line = u[from] + (u[to] - u[from]) * (t[i] - t[from]) / (t[to] - t[from]);
    if (std::abs(u[i] - line) <= furthest) continue;
    furthest = std::abs(u[i] - line);
    corner = i;
  }
  if (corner == from) return;
  kept[corner] = true;
  keep_corners(t, u, from, corner, within, kept);
  keep_corners(t, u, corner, to, within, kept);
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

/// Organ less law over the motion, in thousandths of the peak, by the parameters of the bonds.
class OrganLessLaw final : public ResidualFunction {
 public:
  OrganLessLaw(const OrganModel& model, const MaterialMotion& motion, const OrganMaterial& target,
               FittedBonds bonds)
      : model_(model), motion_(motion), target_(target), bonds_(std::move(bonds)) {}

  [[nodiscard]] const FittedBonds& bonds() const { return bonds_; }

  [[nodiscard]] std::vector<double> force(const BondMaterial& m) const {
    const Response response = model_.respond(motion_.protocol, motion_.time_s,
                                             FittedBonds::values(model_, m), Want::values);
    return {response.value.begin(), response.value.end()};
  }

  [[nodiscard]] Eigen::Index residual_count() const override { return std::ssize(motion_.time_s); }

  [[nodiscard]] bool evaluate(std::span<const double> natural, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override {
    const std::vector<double> values = FittedBonds::values(model_, bonds_.material(natural));
    Eigen::MatrixXd along = bonds_.along(model_);
    if (jacobian == nullptr) along.resize(along.rows(), 0);
    Response response;
    try {
      response = model_.respond_along(motion_.protocol, motion_.time_s, values, along);
    } catch (const Error& error) {  // an organ that buckles: the search turns away
      if (error.code() != ExitCode::numerical) throw;
      return false;
    }
    const double unit = kAsked * target_.peak_N;
    residual =
        (response.value - Eigen::VectorXd::Map(target_.law_N.data(), std::ssize(target_.law_N))) /
        unit;
    if (jacobian != nullptr) *jacobian = response.sensitivity / unit;
    return residual.allFinite();
  }

 private:
  const OrganModel& model_;
  const MaterialMotion& motion_;
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

std::vector<FitParameter> fitted_parameters(const BondMaterial& start, bool fit_times,
                                            double deepest_m) {
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
  if (!start.potential.is_linear()) {
    parameters.push_back(
        about("stiffening", shown_unit(Dimension::length), deepest_m, kStiffeningFactor));
  }
  return parameters;
}

/// Derivatives of the law's force by the coordinates of its uncertainty; those that belong to the
/// recording and not to the material are 0.
Eigen::MatrixXd law_slopes(const LawFile& law, const MaterialMotion& motion) {
  const LawModel model(law.spec);
  const LawUncertainty& u = *law.uncertainty;
  const LawFile plain = at_surface(law);
  const Response r =
      model.respond(motion.protocol, motion.time_s, plain.values, Want::values_and_sensitivity);
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(r.value.size(), std::ssize(u.place));
  for (std::size_t i = 0; i < u.place.size(); ++i) {
    if (model.law_parameters()[u.place[i]].nuisance) continue;
    slopes.col(static_cast<Eigen::Index>(i)) =
        r.sensitivity.col(static_cast<Eigen::Index>(u.place[i])) *
        coordinate_slope(u.coordinate[i], law.values[u.place[i]]);
  }
  return slopes;
}

void add_intervals(OrganMaterial& m, const OrganLessLaw& function, const LawFile& law,
                   const MaterialMotion& motion) {
  std::vector<double> natural;
  for (const OrganMaterialParameter& p : m.parameters) natural.push_back(p.value);
  if (!law.uncertainty) {
    m.flags.emplace_back("the law carries no uncertainty: no intervals");
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
  const Eigen::MatrixXd slopes = law_slopes(law, motion);
  m.follows = Eigen::MatrixXd::Zero(std::ssize(natural), slopes.cols());
  const Eigen::MatrixXd d = solve_symmetric(gram, j.transpose() * slopes);
  m.follows(free, Eigen::all) = d;
  m.covariance = m.follows * law.uncertainty->covariance * m.follows.transpose();
  m.level = law.uncertainty->level;
  m.quantile = law.uncertainty->quantile();
  for (const Eigen::Index i : free) {
    OrganMaterialParameter& p = m.parameters[static_cast<std::size_t>(i)];
    const double theta = p.parameter.theta(p.value);
    const double half = m.quantile * std::sqrt(std::max(m.covariance(i, i), 0.0));
    p.lower = p.parameter.natural(theta - half);
    p.upper = p.parameter.natural(theta + half);
  }
}

}  // namespace

Protocol in_few_pieces(const std::vector<double>& time_s, const std::vector<double>& depth_m,
                       double contact_m) {
  const double deepest = *std::max_element(depth_m.begin(), depth_m.end()) - contact_m;
  std::vector<bool> kept(time_s.size(), false);
  kept.front() = kept.back() = true;
  keep_corners(time_s, depth_m, 0, time_s.size() - 1, kMotionWithin * deepest, kept);
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) knots.push_back({time_s[i], depth_m[i]});
  }
  Protocol motion(Drive::displacement, std::move(knots));
  motion.set_relaxed_at_start(true);
  return motion;
}

MaterialMotion motion_of_recording(const LawFile& law, const PreparedRecording& recording) {
  const Recording& r = recording.recording;
  const std::vector<LawParameter> table = law_parameters(law.spec);
  double contact = 0.0, offset = 0.0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].name == "contact") contact = law.values[i];
    if (table[i].name == "offset") offset = law.values[i];
  }
  std::vector<double> time_s, depth_m, force_N;
  for (std::size_t i = 0; i < r.time_s.size() && r.time_s[i] <= recording.to_s; ++i) {
    if (r.time_s[i] < recording.from_s) continue;
    time_s.push_back(r.time_s[i]);
    depth_m.push_back(std::max(r.drive[i] - contact, 0.0));
    force_N.push_back(r.response[i] - offset);
  }
  if (!(*std::max_element(depth_m.begin(), depth_m.end()) > 0.0)) {
    throw bad_input(fmt::format("recording '{}'", recording.name), "does not press the tissue",
                    "a depth beyond the law's contact");
  }
  MaterialMotion motion{
      in_few_pieces(time_s, depth_m, 0.0), {}, {}, fmt::format("along {}", recording.name)};
  const std::size_t stride = 1 + time_s.size() / kMostTimes;
  for (std::size_t i = 0; i < time_s.size(); i += stride) {
    motion.time_s.push_back(time_s[i]);
    motion.measured_N.push_back(force_N[i]);
  }
  return motion;
}

MaterialMotion motion_of_protocol(const Protocol& protocol, std::vector<double> times_s) {
  if (protocol.drive() != Drive::displacement || !(protocol.peak() > 0.0)) {
    throw bad_input("protocol", "does not press the tissue to a depth", "imposed depths above 0");
  }
  std::vector<double> times;
  const std::size_t stride = 1 + times_s.size() / kMostTimes;
  for (std::size_t i = 0; i < times_s.size(); i += stride) times.push_back(times_s[i]);
  return {protocol, std::move(times), {}, "along the protocol"};
}

namespace {

OrganMaterial law_along(const LawFile& law, const MaterialMotion& motion) {
  OrganMaterial m;
  m.law = law_name(law.spec);
  m.fitted_law = law;
  m.motion = motion.words;
  m.time_s = motion.time_s;
  m.measured_N = motion.measured_N;
  for (const double t : m.time_s) m.depth_m.push_back(value_at(motion.protocol, t));
  m.law_N = law_stage(at_surface(law), motion.protocol, m.time_s).force_N;
  m.peak_N = *std::max_element(m.law_N.begin(), m.law_N.end());
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
  m.correspondence_N = organ.force(unit);
  double product = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < m.law_N.size(); ++i) {
    product += m.correspondence_N[i] * m.law_N[i];
    squares += m.correspondence_N[i] * m.correspondence_N[i];
  }
  const double factor = product / squares;
  if (!(factor > 0.0) || !std::isfinite(factor)) {
    throw Error(ExitCode::numerical, std::string(where), "the organ does not answer the motion",
                "a contact sphere that is not held");
  }
  for (double& f : m.correspondence_N) f *= factor;
  unit.equilibrium_Pa *= factor;
  for (auto& branch : unit.branches) branch.modulus_Pa *= factor;
  unit.lateral_Pa *= factor;
  return unit;
}

/// Finds the material near a start, and how it answers.
void fit_material(OrganMaterial& m, const OrganLessLaw& function,
                  const std::vector<FitParameter>& parameters, std::string_view where) {
  std::vector<double> begin;
  for (const FitParameter& p : parameters) begin.push_back(p.start);
  const Minimum best = minimise_near(function, parameters, begin);
  if (!best.usable) {
    throw Error(ExitCode::numerical, std::string(where), "the organ's material was not found",
                "an organ that stands at the depths of the motion");
  }
  m.material = function.bonds().material(best.natural);
  m.organ_N = function.force(m.material);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const FitParameter& p = parameters[i];
    const bool bound = p.at_lower(best.natural[i]) || p.at_upper(best.natural[i]);
    m.parameters.push_back({p, p.start, best.natural[i], {}, {}, bound});
    if (bound) m.flags.push_back(fmt::format("{} stands on a bound of its search", p.name));
  }
  if (!best.converged) m.flags.emplace_back("the fit ended before it converged");
}

}  // namespace

OrganMaterial put_on_organ(const LawFile& law, const MaterialMotion& motion, const Json& scene,
                           std::string_view where, const std::filesystem::path& folder,
                           const OrganMaterialOptions& options) {
  const Relaxing relaxing = relaxing_of(law);
  OrganMaterial m = law_along(law, motion);
  const BondMaterial unit = unit_material(relaxing);
  const FittedOrgan plain(scene, where, folder, unit);
  const OrganLessLaw first(plain.model(), motion, m, FittedBonds(unit, false));
  BondMaterial start = by_correspondence(m, first, unit, where);
  const double deepest = *std::max_element(m.depth_m.begin(), m.depth_m.end());
  if (options.stiffens.value_or(relaxing.bends)) {
    start.potential = {ElongationShape::cubic, deepest};
    if (options.branches_stiffen) start.kernel = start.potential;
  }

  const FittedOrgan organ(scene, where, folder, start);
  const OrganLessLaw function(organ.model(), motion, m, FittedBonds(start, options.fit_times));
  fit_material(m, function, fitted_parameters(start, options.fit_times, deepest), where);
  add_intervals(m, function, law, motion);
  compare(m, motion.protocol);
  m.scene = organ.scene_with(m.material);
  add_protocol_and_session(m);
  return m;
}

}  // namespace tpm
