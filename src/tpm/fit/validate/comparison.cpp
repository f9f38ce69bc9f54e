#include "tpm/fit/validate/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/autoregressive.hpp"
#include "tpm/fit/predict/organ_readings.hpp"
#include "tpm/fit/select/clipping.hpp"
#include "tpm/fit/validate/grid_convergence.hpp"
#include "tpm/fit/validate/instrument_effects.hpp"
#include "tpm/fit/validate/joint_test.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr double kAllDegrees = std::numeric_limits<double>::infinity();
constexpr double kNumericalError = 1e-9;  // of the value: the closed forms err by less (LawModel)
constexpr const char* kFilling = "the place of the spheres";

/// Computes all quantities of a recording.
class Comparer {
 public:
  Comparer(const LawFile& law, const PreparedRecording& recording, const ComparisonOptions& options)
      : options_(options),
        prepared_(recording),
        r_(prepared_.recording),
        result_(begun_comparison(prepared_, options)),
        along_(law, prepared_, options.organ, options.motion.knots,
               mapped<DelayedRise>(result_.rises, &UnseenRise::expected)),
        degrees_of_law_(law.uncertainty->degrees_of_freedom.value_or(kAllDegrees)) {}

  RecordingComparison compare() {
    result_.sha256 = r_.header.sha256;
    result_.calibration = options_.calibration_data;
    result_.instrument = options_.instrument;
    const auto& ours = options_.instrument;
    const auto& theirs = options_.calibration_instrument;
    result_.same_instrument = ours && theirs && ours->id == theirs->id;
    result_.creep = along_.load_imposed();
    result_.probe = probe_words(ours, theirs);
    probe_ = probe_effect(ours, theirs);
    clipped_ = clipped_readings(prepared_);
    const bool own_zero = options_.known != KnownPlacement::surface && !result_.creep;
    const auto drift = own_zero ? take_out_drift(prepared_) : std::nullopt;
    const std::optional<double>& asked_s = options_.motion.hold_asked_s;
    result_.parts = asked_s ? parts_of_press(prepared_, *asked_s) : parts_of(prepared_);
    result_.part = compared_part(r_, result_.parts, asked_s);
    result_.scatter = scatter_of(prepared_, result_.parts, clipped_);
    result_.placement = place_for_validation(along_, prepared_, result_.parts, result_.scatter,
                                             options_.placement, known_placement());
    result_.placement.drift = drift;
    at_ = along_.at(result_.placement.contact);
    follow_rises();
    refine();
    const auto n = static_cast<Eigen::Index>(r_.response.size());
    measured_ = Eigen::VectorXd::Map(r_.response.data(), n).array() - result_.placement.zero;
    if (ours || theirs) follow_instrument();
    const bool chosen = !options_.quantities.empty();
    for (const QuantityOfInterest& q :
         chosen ? options_.quantities : default_quantities(result_.parts, result_.creep)) {
      add(q);
    }
    if (result_.quantities.empty()) {
      throw bad_input(fmt::format("recording '{}'", prepared_.name),
                      fmt::format("no quantity can be read ({})", result_.without.front().text),
                      "--quantity with one that both the recording and the law have");
    }
    judge();
    set_joint();
    set_curve();
    return std::move(result_);
  }

 private:
  [[nodiscard]] KnownPlacement known_placement() const {
    return result_.creep ? KnownPlacement::no_load : options_.known;
  }

  /// Refines the numerical uncertainty of S, and notes its source.
  void refine() {
    refinements_ = along_.refinements(result_.placement.contact);
    if (options_.fillings != nullptr) {
      result_.fillings = options_.fillings->words;
      by_filling_ = along_.by_filling(*options_.fillings, result_.placement.contact);
      if (by_filling_.empty() && !options_.fillings->organs.empty()) {
        result_.fillings =
            "without the effect of the places of the spheres: one of the other fillings is "
            "unstable";
      }
    }
    if (!options_.pick) return;
    const Protocol motion = beyond_contact(along_.motion(), result_.placement.contact);
    PickedAnswer pick = options_.pick(motion, r_.time_s);
    result_.pick = std::move(pick.name);
    at_.value = std::move(pick.value);
    claimed_limit_ = pick.claimed_limit;
  }

  /// u_num by its sources, and what rendering adds to S.
  void set_numerical(QuantityComparison& q, Functional& s) const {
    CombinedUncertainty sum;
    const auto add = [&](const std::string& name, double u) {
      sum.add(u, kAllDegrees);
      q.parts.push_back({name, u});
      q.numerical.push_back({name, u});
    };
    add("rounding", kNumericalError * std::abs(s.value));
    for (const LawAlong::Refinement& refinement : refinements_) {
      std::vector<double> values;
      for (const Eigen::VectorXd& curve : refinement.values)
        values.push_back(weighted_sum(s.weight, curve));
      add(refinement.name, grid_convergence(values, refinement.ratio).u);
    }
    if (!by_filling_.empty()) {
      q.of_filling = root_of(mapped<double>(by_filling_, [&](const Eigen::VectorXd& curve) {
        return weighted_sum(s.weight, curve);
      }));
      add(kFilling, q.of_filling.norm());
    }
    if (claimed_limit_ > 0.0) {
      add(fmt::format("the claimed error of {}", result_.pick),
          claimed_limit_ * s.weight.lpNorm<1>() / std::numbers::sqrt3);
    }
    for (const RenderingError& rendering : options_.rendering) {
      if (rendering.quantity != q.quantity) continue;
      const double size = std::abs(s.value);
      s.value *= 1.0 + rendering.mean;
      add("rendering", rendering.limit * size / std::numbers::sqrt3);
    }
    std::ranges::stable_sort(q.numerical, std::greater<>(), &UncertaintyPart::u);
    q.u_num = sum.u();
  }

  void follow_rises() {
    for (std::size_t k = 0; k < result_.rises.size(); ++k) {
      by_rise_.push_back(result_.rises[k].u_s() * along_.by_delay(k, result_.placement.contact));
    }
  }

  void follow_instrument() {
    const double contact = result_.placement.contact;
    depth_scale_ = along_.by_depth_scale(contact);
    time_scale_ = along_.by_time_scale(contact);
    time_shift_ = along_.by_time_shift(contact);
  }

  [[nodiscard]] const char* zero_name() const {
    return result_.creep ? "the reading without a load" : "the zero of the force";
  }

  [[nodiscard]] ChannelSlopes slopes_of(const Functional& s, const Functional& d) const {
    return {weighted_sum(s.weight, depth_scale_), weighted_sum(s.weight, time_scale_),
            weighted_sum(s.weight, time_shift_),  -weighted_sum(s.weight, at_.by_contact),
            weighted_sum(s.weight, at_.value),    s.weight.sum(),
            weighted_sum(d.weight, measured_),    d.weight.sum()};
  }
  [[nodiscard]] ChannelSlopes slopes_of(Eigen::Index k) const {
    return {depth_scale_[k], time_scale_[k],
            time_shift_[k],  -at_.by_contact[k],
            at_.value[k],    1.0,
            measured_[k],    1.0};
  }
  [[nodiscard]] std::vector<InstrumentEffect> effects_of(const ChannelSlopes& by) const {
    return instrument_effects(by, options_.instrument, options_.calibration_instrument,
                              result_.creep);
  }

  void add(const QuantityOfInterest& quantity) {
    const double contact = result_.placement.contact;
    const std::string name = quantity_words(quantity, r_.drive_quantity, r_.response_quantity);
    auto s = read_quantity(quantity, result_.parts, r_, contact, at_.value);
    const auto d = read_quantity(quantity, result_.parts, r_, contact, measured_);
    if (!s || !d) {
      result_.without.push_back(
          d ? Remark{"not_predicted", fmt::format("{}: the law does not predict it here", name)}
            : Remark{"not_recorded", fmt::format("{}: the recording does not have it", name)});
      return;
    }
    QuantityComparison q;
    q.quantity = quantity;
    q.name = name;
    q.unit = quantity_unit(quantity, r_.drive_quantity, r_.response_quantity);
    set_numerical(q, *s);
    q.simulated = s->value;
    q.measured = d->value;
    q.e.error = s->value - d->value;
    set_uncertainty(q, *s, *d);
    constexpr double kFirstOrder = 0.25;  // a time follows the readings to first order below this
    if (quantity.kind == QuantityKind::half_time && q.u_D > kFirstOrder * std::abs(s->value)) {
      weights_.pop_back();
      result_.without.push_back(
          {"scatter", fmt::format("{}: the readings scatter too much to tell it (u_D = {} s)", name,
                                  significant(q.u_D, 2))});
      return;
    }
    if ((d->weight.array() != 0.0 && clipped_.array()).any()) {
      q.remark = {"clipping", "read from readings that stand at a limit of the force cell"};
      q.unknown = true;
    }
    result_.quantities.push_back(std::move(q));
  }

  /// Where nothing tells the zero that a quantity depends on: what the instrument states of it.
  /// @return that uncertainty, 0 if there is none
  double add_untold_zero(QuantityComparison& q, double by_zero, const Functional& d) {
    const ValidationPlacement& p = result_.placement;
    const bool told = p.zero_readings > 0 || p.zero_known;
    if (told || std::abs(by_zero) <= 1e-9 * d.weight.cwiseAbs().sum()) return 0.0;
    if (!result_.creep && options_.instrument && options_.instrument->zero) {
      const double stated = std::abs(by_zero) * *options_.instrument->zero;
      q.parts.push_back({zero_name(), stated});
      return stated;
    }
    q.remark = {"zero_not_known",
                fmt::format("depends on {}, which nothing before {} and no instrument tells",
                            zero_name(), result_.creep ? "the load" : "contact")};
    q.unknown = true;
    return 0.0;
  }

  /// Combines the parts to u_D, u_input and the uncertainty of the error.
  /// @param stated what is stated of zero and contact, drift and rises
  void combine(QuantityComparison& q, double u_readings, double stated) {
    const double own_instrument = q.of_instrument.norm();
    q.u_D = std::hypot(u_readings, own_instrument, stated);
    const double by_filling = q.of_filling.norm();
    const double of_numbers = std::sqrt(std::max(q.u_num * q.u_num - by_filling * by_filling, 0.0));
    const double specimen = q.of_specimen.norm();
    q.u_own = std::hypot(u_readings, std::hypot(stated, of_numbers, specimen));
    CombinedUncertainty sum;
    sum.add(u_readings, result_.scatter.degrees);
    sum.add(q.u_input, degrees_of_law_);
    sum.add(of_numbers, kAllDegrees);
    sum.add(by_filling, static_cast<double>(std::max<Eigen::Index>(q.of_filling.size() - 1, 1)));
    sum.add(own_instrument, kAllDegrees);
    sum.add(stated, kAllDegrees);
    const double shared = q.shared.norm();
    sum.add(std::sqrt(std::max(shared * shared - q.u_input * q.u_input, 0.0)), kAllDegrees);
    sum.add(std::abs(q.of_probe), kAllDegrees);
    const double of_population = std::hypot(specimen, q.of_mean * specimen);
    if (q.specimen_degrees > 0) {
      sum.add_difference(of_population, std::hypot(1.0, q.of_mean) * q.specimen_with_own,
                         q.specimen_degrees);
    }
    if (q.specimen_degrees > 0 && sum.untold()) {
      q.remark = {
          "spread_hidden",
          "the spread between specimens is not known: the calibration's own uncertainty hides it"};
      q.unknown = true;
    }
    q.u_input = std::hypot(shared, q.of_probe, of_population);
    q.e.u_val = sum.u();
    q.e.degrees = sum.degrees();
    q.e.coverage = coverage_factor(q.e.degrees);
  }

  void set_uncertainty(QuantityComparison& q, const Functional& s, Functional d) {
    const ValidationPlacement& p = result_.placement;
    // A time read from scattered readings may lie where they happen to be steep.
    if (q.quantity.kind == QuantityKind::half_time &&
        result_.scatter.of(r_.time_s, s.weight) > result_.scatter.of(r_.time_s, d.weight)) {
      d.weight = s.weight;
    }
    const double by_contact = weighted_sum(s.weight, at_.by_contact);
    const double by_zero = d.weight.sum();
    const Eigen::VectorXd from_contact = by_contact * p.contact_by_reading;
    const Eigen::VectorXd from_zero = by_zero * p.zero_by_reading;
    const Eigen::VectorXd weight = from_contact + from_zero - d.weight;
    weights_.push_back(weight);
    const auto u_of = [&](const Eigen::VectorXd& w) { return result_.scatter.of(r_.time_s, w); };
    const double u_readings = u_of(weight);
    q.parts.push_back({"the scatter of the readings", u_of(d.weight)});
    q.parts.push_back({zero_name(), u_of(from_zero)});
    q.of_contact = by_contact * p.contact_u_sampled;
    q.parts.push_back({"the contact point", std::hypot(u_of(from_contact), q.of_contact)});
    const double by_drift = p.drift ? p.drift->u(weight, r_.time_s) : 0.0;
    q.parts.push_back({"the drift of the zero", by_drift});
    const Eigen::RowVectorXd by_law = weighted_sum(s.weight, at_.by_law) +
                                      by_contact * p.contact_by_law + by_zero * p.zero_by_law;
    q.shared = by_law * along_.root();
    q.u_input = q.shared.norm();
    q.parts.push_back({"the law's parameters", q.u_input});
    const double stated_zero = add_untold_zero(q, by_zero, d);
    add_instrument(q, s, d);
    add_probe(q, s);
    if (options_.specimens != nullptr) add_specimen(q, s);
    for (const Eigen::VectorXd& slope : by_rise_) extend(q.of_rises, weighted_sum(s.weight, slope));
    const double by_rises = q.of_rises.norm();
    q.parts.push_back({"the time of a change between two samples", by_rises});
    const double stated = std::hypot(std::hypot(stated_zero, q.of_contact), by_drift, by_rises);
    combine(q, u_readings, stated);
    std::erase_if(q.parts, [](const UncertaintyPart& part) { return !(part.u > 0.0); });
    std::stable_sort(q.parts.begin(), q.parts.end(),
                     [](const auto& a, const auto& b) { return a.u > b.u; });
  }

  /// Effects of the same instrument add with their sign before they are squared.
  void add_instrument(QuantityComparison& q, const Functional& s, const Functional& d) const {
    if (!options_.instrument && !options_.calibration_instrument) return;
    for (const InstrumentEffect& effect : effects_of(slopes_of(s, d))) {
      double ours = effect.validation * effect.u_validation;
      double theirs = effect.calibration * effect.u_calibration;
      if (result_.same_instrument) {
        ours += theirs;
        theirs = 0.0;
      }
      q.parts.push_back({fmt::format("{} of the instrument", effect.name), std::abs(ours)});
      if (theirs != 0.0) {
        q.parts.push_back(
            {fmt::format("{} of the calibration's instrument", effect.name), std::abs(theirs)});
      }
      extend(q.of_instrument, ours);
      extend(q.shared, theirs);
    }
  }

  /// The law holds the calibration's probe, and S would grow with that of the recording.
  void add_probe(QuantityComparison& q, const Functional& s) const {
    if (!probe_.stated || probe_.same) return;
    const double slope = slope_by_radius(weighted_sum(s.weight, at_.value),
                                         weighted_sum(s.weight, depth_scale_), result_.creep);
    q.of_probe = -slope * probe_.u_validation;
    const double theirs = slope * probe_.u_calibration;
    q.parts.push_back({"the radius of the probe", std::abs(q.of_probe)});
    q.parts.push_back({"the radius of the calibration's probe", std::abs(theirs)});
    extend(q.shared, theirs);
  }

  void add_specimen(QuantityComparison& q, const Functional& s) const {
    const auto found = std::ranges::find_if(*options_.specimens, [&](const SpecimenSpread& own) {
      return own.quantity == q.quantity && own.creep == result_.creep;
    });
    if (found == options_.specimens->end()) {
      q.remark = {
          "spread_not_known",
          "the spread between specimens is not known: fewer than two recordings of the calibration "
          "have it"};
      q.unknown = true;
      return;
    }
    q.of_specimen = s.value * found->deviations;
    q.of_mean = found->of_mean;
    q.specimen_with_own = std::abs(s.value) * found->with_own;
    q.specimen_degrees = found->degrees();
    q.parts.push_back(
        {"the spread between specimens", q.of_specimen.norm() * std::hypot(1.0, q.of_mean)});
  }

  static void extend(Eigen::RowVectorXd& row, double value) {
    row.conservativeResize(row.size() + 1);
    row[row.size() - 1] = value;
  }

  void judge() {
    lack_history(result_, along_.law(), prepared_);
    const auto peak = read_quantity({QuantityKind::peak}, result_.parts, r_,
                                    result_.placement.contact, measured_);
    judge_quantities(result_, options_.requirement, quantity_dimension(r_.response_quantity),
                     peak ? std::abs(peak->value) : 0.0);
  }

  void set_joint() {
    std::vector<std::size_t> known;  // what hangs on something unknown says nothing of the model
    for (std::size_t i = 0; i < result_.quantities.size(); ++i) {
      if (!result_.quantities[i].unknown) known.push_back(i);
    }
    const auto count = static_cast<Eigen::Index>(known.size());
    const auto quantity = [&](Eigen::Index i) -> const QuantityComparison& {
      return result_.quantities[known[static_cast<std::size_t>(i)]];
    };
    Eigen::MatrixXd weights(static_cast<Eigen::Index>(r_.response.size()), count);
    Eigen::VectorXd error(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      weights.col(i) = weights_[known[static_cast<std::size_t>(i)]];
      error[i] = quantity(i).e.error;
    }
    Eigen::MatrixXd covariance = result_.scatter.covariance(r_.time_s, weights);
    double degrees = kAllDegrees;
    for (Eigen::Index i = 0; i < count; ++i) {
      const QuantityComparison& a = quantity(i);
      degrees = std::min(degrees, a.e.degrees);
      for (Eigen::Index j = 0; j < count; ++j) {
        const QuantityComparison& b = quantity(j);
        covariance(i, j) += a.shared.dot(b.shared) + a.of_instrument.dot(b.of_instrument) +
                            a.of_filling.dot(b.of_filling) + a.of_contact * b.of_contact +
                            a.of_rises.dot(b.of_rises) + a.of_probe * b.of_probe;
        if (a.of_specimen.size() == b.of_specimen.size()) {
          covariance(i, j) += (1.0 + a.of_mean * b.of_mean) * a.of_specimen.dot(b.of_specimen);
        }
      }
      // Contributions to this quantity alone: numerical errors, and a zero that was stated.
      const double own = a.e.u_val * a.e.u_val - covariance(i, i);
      if (own > 0.0) covariance(i, i) += own;
    }
    const auto has = [&](QuantityKind kind) {
      return std::ranges::any_of(result_.quantities, [kind](const auto& q) {
        return q.quantity.kind == kind && !q.unknown;
      });
    };
    const bool ratio_follows = has(QuantityKind::peak) && has(QuantityKind::end_of_hold);
    std::vector<bool> follows;
    for (Eigen::Index i = 0; i < count; ++i) {
      follows.push_back(quantity(i).quantity.kind == QuantityKind::relaxation_ratio &&
                        ratio_follows);
    }
    for (const std::size_t i : test_together(result_.joint, error, covariance, follows, degrees)) {
      result_.joint.dependent.push_back(quantity(static_cast<Eigen::Index>(i)).name);
    }
  }

  /// u^2 of what is no scatter of one sample: the instruments and the numbers of S.
  [[nodiscard]] double systematic_square(Eigen::Index k) const {
    double square = claimed_limit_ * claimed_limit_ / 3.0;
    for (const LawAlong::Refinement& refinement : refinements_) {
      std::vector<double> values;
      for (const Eigen::VectorXd& curve : refinement.values) {
        if (std::isfinite(curve[k])) values.push_back(curve[k]);
      }
      if (values.size() < 2) continue;
      square += std::pow(grid_convergence(values, refinement.ratio).u, 2);
    }
    for (const Eigen::VectorXd& by_rise : by_rise_) square += by_rise[k] * by_rise[k];
    const auto at_sample = [k](const Eigen::VectorXd& curve) { return curve[k]; };
    square += root_of(mapped<double>(by_filling_, at_sample)).squaredNorm();
    if (!options_.instrument && !options_.calibration_instrument) return square;
    for (const InstrumentEffect& effect : effects_of(slopes_of(k))) {
      const double ours = effect.validation * effect.u_validation;
      const double theirs = effect.calibration * effect.u_calibration;
      square +=
          result_.same_instrument ? std::pow(ours + theirs, 2) : ours * ours + theirs * theirs;
    }
    const double by_radius = slope_by_radius(at_.value[k], depth_scale_[k], result_.creep);
    square += std::pow(by_radius * std::hypot(probe_.u_validation, probe_.u_calibration), 2);
    return square;
  }

  void set_curve() {
    const RecordingParts& parts = result_.parts;
    const ValidationPlacement& p = result_.placement;
    const std::size_t last = parts.hold_last.value_or(parts.ramp_last);
    CurveComparison& curve = result_.curve;
    std::vector<double> times;
    std::vector<double> errors;
    const double sigma = result_.scatter.sigma;
    for (std::size_t i = parts.ramp_first; i <= last; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      if (!std::isfinite(at_.value[k]) || clipped_[k]) continue;
      const double e = at_.value[k] - measured_[k];
      const double contact = at_.by_contact[k] * p.contact_u;
      times.push_back(r_.time_s[i]);
      errors.push_back(e);
      curve.mean_square_error += e * e;
      curve.mean_square_u += sigma * sigma + contact * contact + p.zero_u * p.zero_u +
                             (at_.by_law.row(k) * along_.root()).squaredNorm() +
                             systematic_square(k);
    }
    curve.samples = times.size();
    if (times.empty()) return;
    curve.mean_square_error /= static_cast<double>(times.size());
    curve.mean_square_u /= static_cast<double>(times.size());
    if (!(sigma > 0.0)) return;
    Eigen::VectorXd whitened = Eigen::VectorXd::Map(errors.data(), std::ssize(errors));
    AutoregressiveNoise(result_.scatter.phi, result_.scatter.step_s).whiten(times, whitened);
    curve.chi_squared = whitened.squaredNorm() / (sigma * sigma);
  }

  const ComparisonOptions& options_;
  PreparedRecording prepared_;
  const Recording& r_;
  RecordingComparison result_;
  LawAlong along_;
  double degrees_of_law_;
  LawAlong::At at_;
  Eigen::VectorXd measured_, depth_scale_, time_scale_, time_shift_;
  std::vector<Eigen::VectorXd> weights_, by_rise_;
  Eigen::Array<bool, Eigen::Dynamic, 1> clipped_;  ///< readings at a limit of the force cell
  std::vector<LawAlong::Refinement> refinements_;
  std::vector<Eigen::VectorXd> by_filling_;  ///< of the organ, then of other fillings
  double claimed_limit_ = 0.0;
  ProbeEffect probe_;
};

}  // namespace

RecordingComparison compare_with_recording(const LawFile& law, const PreparedRecording& recording,
                                           const ComparisonOptions& options) {
  const bool creep = recording.load_imposed || is_load(recording.recording.drive_quantity);
  return Comparer(law, creep ? as_load_imposed(recording) : recording, options).compare();
}

}  // namespace tpm::fit
